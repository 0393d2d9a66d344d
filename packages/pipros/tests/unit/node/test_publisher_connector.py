import asyncio
from itertools import pairwise
from typing import Any

import pytest

from pipros.basics.budget import Budget
from pipros.basics.errors import Refused, Unreachable
from pipros.basics.limits import Limits
from pipros.net import unreachable
from pipros.net.busy_poll import PublishCount
from pipros.net.held_bytes import HeldBytes
from pipros.net.refusals import Refusals
from pipros.node.attempts import Attempts
from pipros.node.context import NodeContext
from pipros.node.publisher_connector import LOST_GRACE_S, RETRY_FIRST_S, LinkEnd, PublisherConnector
from pipros.node.timings import NODE_TIMINGS
from tests.support.constants import Constants
from tests.support.instant_loop import instantly
from tests.support.nodes import listening_log

A, B, C = "http://a:1/", "http://b:1/", "http://c:1/"


class Publishers:
    """Connect at once, unless set otherwise; record the time and the publisher of each attempt.

    Attributes:
        moments: the times of the attempts, by URI.
        ends: the futures of the links that were made, the latest by URI.
        errors: raised instead of a link, by URI.
        hangs: the URIs of publishers that never answer.
    """

    def __init__(self) -> None:
        self.moments: dict[str, list[float]] = {}
        self.ends: dict[str, LinkEnd] = {}
        self.errors: dict[str, Exception] = {}
        self.hangs: set[str] = set()

    async def connect(self, uri: str) -> LinkEnd:
        loop = asyncio.get_running_loop()
        self.moments.setdefault(uri, []).append(loop.time())
        if uri in self.hangs:
            await loop.create_future()
        if uri in self.errors:
            raise self.errors[uri]
        self.ends[uri] = loop.create_future()
        return self.ends[uri]

    def attempts(self) -> dict[str, int]:
        return {uri: len(moments) for uri, moments in self.moments.items()}


def following(
    publishers: Publishers, topic: str = "/chatter", **limits: Any
) -> tuple[PublisherConnector, list[str]]:
    (connector,), lines = following_topics(publishers, topic, **limits)
    return connector, lines


def following_topics(
    publishers: Publishers, *topics: str, **limits: Any
) -> tuple[list[PublisherConnector], list[str]]:
    """Return the connectors of one node, and the lines of its log."""
    log, lines = listening_log()
    loop: Any = type("Loop", (), {"asyncio": asyncio.get_running_loop()})
    context = NodeContext(
        "/node", loop, log, lambda: 1, Limits(**limits), None, Attempts(100), PublishCount(),
        PublishCount(), Budget(0), HeldBytes(limit_bytes=0, refusals=Refusals()), set(),
    )  # fmt: skip
    return [PublisherConnector(topic, context, publishers.connect) for topic in topics], lines


@pytest.fixture
def publishers() -> Publishers:
    return Publishers()


async def update(topic: PublisherConnector, uris: list[str]) -> None:
    """Give the topic a list of publishers, and time for the links to them."""
    topic.update(uris)
    await asyncio.sleep(0.01)


@pytest.fixture
def advice(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same advice for every unreachable publisher."""

    async def explain(_: str) -> str:
        return ". Is it switched on?"

    monkeypatch.setattr(unreachable, "explain", explain)


@instantly
async def test_each_listed_publisher_gets_one_link(publishers: Publishers) -> None:
    topic, _ = following(publishers)
    await update(topic, [A, B, A])
    await update(topic, [B, C])
    assert publishers.attempts() == {A: 1, B: 1, C: 1}
    assert not publishers.ends[A].done(), "a link stays until its publisher ends it"
    topic.stop()


@instantly
async def test_an_ended_link_is_reopened_only_while_its_publisher_is_registered(publishers) -> None:
    topic, _ = following(publishers)
    await update(topic, [A, B])
    topic.update([A])
    for end in list(publishers.ends.values()):
        end.set_result("")
    await asyncio.sleep(2 * RETRY_FIRST_S)
    assert publishers.attempts() == {A: 2, B: 1}
    topic.stop()


@instantly
async def test_an_attempt_ends_when_its_publisher_leaves_the_list(publishers: Publishers) -> None:
    publishers.hangs.add(A)
    topic, lines = following(publishers)
    await update(topic, [A])
    topic.update([])
    publishers.hangs.clear()
    await asyncio.sleep(10)
    assert (publishers.attempts(), publishers.ends, lines) == ({A: 1}, {}, [])
    await update(topic, [A])
    assert A in publishers.ends, "it came back"
    topic.stop()


@pytest.mark.usefixtures("advice")
@instantly
async def test_an_unreachable_publisher_is_retried_with_growing_delays_and_logged_once(publishers) -> None:
    publishers.errors[A] = Unreachable(A, "Connection refused")
    topic, lines = following(publishers)
    topic.update([A])
    await asyncio.sleep(40)
    moments = publishers.moments[A]
    waits = [round(later - earlier, 3) for earlier, later in pairwise(moments)]
    assert waits[:3] == [RETRY_FIRST_S, 2 * RETRY_FIRST_S, 4 * RETRY_FIRST_S]
    assert set(waits[-2:]) == {NODE_TIMINGS.retry_longest_s}
    (line,) = lines
    assert "cannot receive [/chatter]" in line
    assert "Is it switched on?" in line
    topic.stop()


@pytest.mark.usefixtures("advice")
@pytest.mark.parametrize(("topic", "logged"), [("/rosout", [B]), ("/chatter", [A, B])])
@instantly
async def test_only_a_log_of_a_node_that_has_ended_is_not_missed(publishers, topic, logged) -> None:
    publishers.errors = {A: Unreachable(A, "Connection refused"), B: Unreachable(B, "No route to host")}
    publishers.errors[A].__cause__ = ConnectionRefusedError()
    connector, lines = following(publishers, topic=topic)
    connector.update([A, B])
    await asyncio.sleep(60)
    assert [uri for uri in (A, B) if any(f" at {uri}: " in line for line in lines)] == logged
    connector.stop()


@instantly
async def test_a_refusing_publisher_is_retried_rarely_and_at_once_when_it_is_listed_again(publishers) -> None:
    publishers.errors[A] = Refused(A, 0, "wrong md5sum")
    topic, lines = following(publishers)
    topic.update([A])
    await asyncio.sleep(100)
    waits = [round(later - earlier, 3) for earlier, later in pairwise(publishers.moments[A])]
    assert (waits, len(lines)) == ([5, 10, 20, 40], 1)
    assert "wrong md5sum" in lines[0]
    await update(topic, [A])
    assert publishers.attempts() == {A: 6}
    del publishers.errors[A]
    await asyncio.sleep(6)
    assert A in publishers.ends, "it has room now"
    topic.stop()


@instantly
async def test_the_reason_of_a_broken_link_is_logged(publishers: Publishers) -> None:
    topic, lines = following(publishers)
    await update(topic, [A])
    publishers.ends[A].set_result("the link is broken: not a message")
    await asyncio.sleep(0.01)
    assert lines == ["the link is broken: not a message"]
    topic.stop()


@instantly
async def test_a_list_beyond_the_limit_keeps_the_existing_links(publishers, constants: Constants) -> None:
    constants(PUBLISHERS_PER_TOPIC=2)
    topic, lines = following(publishers)
    await update(topic, [C])
    await update(topic, [A, B, C])
    assert publishers.attempts() == {C: 1, A: 1}
    assert lines == ["[/chatter] has 3 publishers; the limit is 2"]
    topic.stop()


@instantly
async def test_a_stopped_topic_connects_to_no_publisher(publishers: Publishers) -> None:
    topic, _ = following(publishers)
    topic.stop()
    await update(topic, [A])
    assert publishers.attempts() == {}


@pytest.mark.usefixtures("advice")
@instantly
async def test_a_lost_publisher_is_logged_only_if_it_stays_registered(publishers: Publishers) -> None:
    topic, lines = following(publishers)
    await update(topic, [A, B])
    publishers.errors = {uri: Unreachable(uri, "Connection refused") for uri in (A, B)}
    publishers.ends[A].set_result("")
    publishers.ends[B].set_result("")
    await asyncio.sleep(LOST_GRACE_S / 2)
    assert publishers.attempts()[A] > 1
    topic.update([B])  # A has unregistered
    await asyncio.sleep(60)
    (line,) = lines
    assert line.startswith(f"cannot receive [/chatter] from the publisher at {B}: ")
    topic.stop()


@pytest.mark.usefixtures("advice")
@instantly
async def test_an_unreachable_node_is_reported_once_for_all_its_topics(publishers: Publishers) -> None:
    connectors, lines = following_topics(publishers, "/a", "/b", "/c")
    publishers.errors = {uri: Unreachable(uri, "Connection refused") for uri in (A, B)}
    for connector in connectors:
        connector.update([A, B])
    await asyncio.sleep(60)
    assert sorted(line.partition(" at ")[2][:11] for line in lines) == [A, B]

    publishers.errors[A] = Unreachable(A, "no response in time")  # another reason, but the same node
    await asyncio.sleep(60)
    assert len(lines) == 2

    publishers.errors.pop(A)
    await asyncio.sleep(60)
    publishers.errors[A] = Unreachable(A, "Connection refused")
    publishers.ends[A].set_result("")  # the link of the last topic
    await asyncio.sleep(60)
    assert len(lines) == 3, "it was back, and is lost again"

    for connector in connectors:
        connector.update([])
    await asyncio.sleep(1)
    connectors[0].update([A])
    await asyncio.sleep(60)
    assert len(lines) == 4, "it is registered again"
    for connector in connectors:
        connector.stop()
