"""The delivery of notifications: in order, superseded, unaffected by slow nodes."""

import asyncio
from typing import Any

import pytest

from pipros.basics.errors import PiprosError, Unreachable
from pipros.basics.limits import Limits
from pipros.master import notifier
from pipros.master.notifier import KEEP_CONNECTION_S, QUEUED_AT_A_TIME, SLOW_S, TURNS_AT_A_TIME, Notifier
from pipros.master.registry import MASTER_ID, Notice
from pipros.wire.xmlrpc import decode_call
from tests.support.constants import Constants
from tests.support.instant_loop import instantly, run_instantly

A, B = "http://a:1/", "http://b:2/"


def update(
    topic: str = "/t", publishers: list[str] | None = None, *, node: str = "/n", api: str = A
) -> Notice:
    return Notice(node, api, "publisherUpdate", (MASTER_ID, topic, publishers or []))


class FakeNode:
    """The client for one API. It responds after `delay_s`, or fails with `error`."""

    def __init__(self, network: "Network", api: str) -> None:
        self._network = network
        self.api = api
        self.is_closed = False

    async def post(self, document: bytes, *, timeout_s: float) -> object:
        network = self._network
        network.under_way += 1
        network.most_under_way = max(network.most_under_way, network.under_way)
        try:
            delay_s = network.delays_s.get(self.api, 0.0)
            await asyncio.sleep(min(delay_s, timeout_s))
            if delay_s > timeout_s:
                raise Unreachable(self.api, "no response in time")
            if error := network.errors.get(self.api):
                raise error
            method, params = decode_call(document)
            network.heard.append((asyncio.get_running_loop().time(), self.api, method, params[1:]))
            return [1, "", 0]
        finally:
            network.under_way -= 1

    def close(self) -> None:
        self.is_closed = True


class Network:
    """Fake nodes, and the calls they received: time, API, method and arguments."""

    def __init__(self) -> None:
        self.nodes: list[FakeNode] = []
        self.delays_s: dict[str, float] = {}
        self.errors: dict[str, PiprosError] = {}
        self.heard: list[tuple[float, str, str, Any]] = []
        self.under_way = 0
        self.most_under_way = 0

    def connect(self, api: str) -> FakeNode:
        if not api.startswith("http://"):
            raise ValueError(f"{api} is not a URI")
        self.nodes.append(FakeNode(self, api))
        return self.nodes[-1]

    def topics(self, api: str = A) -> list[str]:
        return [params[0] for _, heard_at, _, params in self.heard if heard_at == api]


class FakeRecipients:
    """Nodes that are all current, unless listed in `moved`, and a record of the reports."""

    def __init__(self) -> None:
        self.moved: set[str] = set()
        self.may_end: set[str] = set()
        self.reports: list[tuple[str, Notice]] = []

    async def may_deliver(self, notice: Notice) -> bool:
        return notice.api in self.may_end if notice.method == "shutdown" else notice.api not in self.moved

    def on_delivered(self, notice: Notice) -> None:
        self.reports.append(("delivered", notice))

    def on_failed(self, notice: Notice, error: PiprosError) -> None:
        self.reports.append((f"failed: {error.__class__.__name__}", notice))

    def on_finished(self, notice: Notice) -> None:
        self.reports.append(("finished", notice))


class Case:
    def __init__(self, limits: Limits | None = None) -> None:
        self.network = Network()
        self.recipients = FakeRecipients()
        self.notifier = Notifier(self.recipients, limits or Limits(), connect=self.network.connect)

    async def until_all_finished(self) -> None:
        while self.notifier.waiting_count:
            await asyncio.sleep(0.001)

    def deliver(self, *notices: Notice) -> None:
        async def main() -> None:
            self.notifier.notify(notices)
            await self.until_all_finished()

        run_instantly(main())


@pytest.fixture
def case() -> Case:
    return Case()


def test_a_node_gets_its_notifications_in_order(case: Case) -> None:
    case.deliver(*(update(f"/t{number}") for number in range(5)))
    assert case.network.topics() == [f"/t{number}" for number in range(5)]
    assert case.notifier.delivered == 5
    assert [report for report, _ in case.recipients.reports] == ["delivered", "finished"] * 5


@instantly
async def test_a_newer_notice_about_the_same_topic_supersedes_a_waiting_one(case: Case) -> None:
    first, second, other, third = update("/t", ["1"]), update("/t", ["2"]), update("/u"), update("/t", ["3"])

    case.network.delays_s[A] = 1.0
    case.notifier.notify([first])
    await asyncio.sleep(0.5)
    case.notifier.notify([second, other, third])
    await case.until_all_finished()
    assert [params for _, _, _, params in case.network.heard] == [
        tuple(notice.params[1:]) for notice in (first, other, third)
    ]
    assert case.notifier.superseded == 1
    assert second not in [notice for _, notice in case.recipients.reports]


@instantly
async def test_a_slow_node_does_not_delay_others(case: Case) -> None:
    slow = [f"http://slow:{number}/" for number in range(TURNS_AT_A_TIME)]

    case.network.delays_s.update(dict.fromkeys(slow, 5.0))
    case.notifier.notify(update(api=api) for api in slow)
    case.notifier.notify([update(api=B)])
    await asyncio.sleep(2 * SLOW_S)
    assert case.network.topics(B) == ["/t"]
    assert case.notifier.slow_apis == dict.fromkeys(slow, 1)
    await case.until_all_finished()
    assert (case.notifier.slow_apis, case.notifier.delivered) == ({}, TURNS_AT_A_TIME + 1)


def test_the_number_of_notifications_in_transit_is_bounded(case: Case) -> None:
    apis = [f"http://n:{number}/" for number in range(5 * TURNS_AT_A_TIME)]
    case.network.delays_s.update(dict.fromkeys(apis, SLOW_S / 2))
    case.deliver(*(update(api=api) for api in apis))
    assert case.network.most_under_way == TURNS_AT_A_TIME


@instantly
async def test_a_slow_node_is_reported_and_gets_the_next_notification(case: Case) -> None:
    case = Case(Limits(notice_s=3.0))

    case.network.delays_s[A] = 10.0
    case.notifier.notify([update("/t"), update("/u")])
    await asyncio.sleep(3.5)
    case.network.delays_s[A] = 0.0
    await case.until_all_finished()
    assert [report for report, _ in case.recipients.reports[:2]] == ["failed: Unreachable", "finished"]
    assert case.recipients.reports[0][1] == update("/t")


@instantly
async def test_the_oldest_notice_is_dropped_when_too_many_wait_for_a_node(
    caplog: pytest.LogCaptureFixture, constants: Constants
) -> None:
    constants(NOTICES=2)
    case = Case(Limits())

    case.network.delays_s[A] = 1.0
    case.notifier.notify([update("/under_way")])
    await asyncio.sleep(0.5)
    case.notifier.notify(update(f"/t{number}") for number in range(4))
    await case.until_all_finished()
    assert (case.network.topics(), case.notifier.dropped) == (["/under_way", "/t2", "/t3"], 2)
    assert [notice.params[1] for report, notice in case.recipients.reports if report == "finished"] == [
        "/t0", "/t1", "/under_way", "/t2", "/t3",
    ]  # fmt: skip
    assert caplog.text.count("does not answer: more than 2 notices are queued for it") == 1


def test_a_node_that_has_moved_is_no_longer_called_at_its_old_address(case: Case) -> None:
    case.recipients.moved.add(A)

    case.deliver(update())
    assert case.network.heard == []
    assert case.recipients.reports == [("finished", update())]


@pytest.mark.parametrize("may_end", [True, False])
def test_a_process_is_shut_down_only_if_it_is_still_that_node(case: Case, may_end: bool) -> None:
    shutdown = Notice("/n", A, "shutdown", (MASTER_ID, "replaced"))
    case.recipients.moved.add(A)  # a successor has the name
    if may_end:
        case.recipients.may_end.add(A)

    case.deliver(shutdown)
    assert [method for _, _, method, _ in case.network.heard] == (["shutdown"] if may_end else [])


def test_an_invalid_api_uri_fails_at_once(case: Case) -> None:
    notice = update(api="nonsense")
    case.deliver(notice)
    assert case.recipients.reports == [("failed: Unreachable", notice), ("finished", notice)]


@instantly
async def test_many_notices_are_queued_in_pieces_so_that_calls_are_answered_meanwhile(case: Case) -> None:
    taken: list[int] = []

    def notices() -> Any:
        for number in range(2 * QUEUED_AT_A_TIME + 1):
            taken.append(number)
            yield update(f"/t{number}", api=f"http://n:{number}/")

    case.notifier.notify(notices())
    assert len(taken) == QUEUED_AT_A_TIME
    await case.until_all_finished()
    assert case.notifier.delivered == len(taken) == 2 * QUEUED_AT_A_TIME + 1


def test_a_notification_for_many_nodes_is_encoded_once(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    encoded: list[str] = []
    encode = notifier.encode_call
    monkeypatch.setattr(
        notifier,
        "encode_call",
        lambda method, *rest, **how: encoded.append(method) or encode(method, *rest, **how),
    )
    params = (MASTER_ID, "/t", [f"http://p:{number}/" for number in range(9)])

    case.deliver(*(Notice(f"/n{n}", f"http://n:{n}/", "publisherUpdate", params) for n in range(9)))
    assert (encoded, len(case.network.heard)) == (["publisherUpdate"], 9)


@instantly
async def test_an_idle_client_connection_is_closed(case: Case) -> None:
    case.notifier.notify([update("/t")])
    await asyncio.sleep(KEEP_CONNECTION_S - 1)
    case.notifier.notify([update("/u")])
    await asyncio.sleep(KEEP_CONNECTION_S - 1)
    [node] = case.network.nodes
    assert not node.is_closed
    await asyncio.sleep(2)
    assert node.is_closed
    assert case.network.topics() == ["/t", "/u"]


@instantly
async def test_a_closed_notifier_delivers_nothing_more(case: Case) -> None:
    case.network.delays_s[A] = 1.0
    case.notifier.notify([update("/t"), update("/u")])
    await asyncio.sleep(0.5)
    case.notifier.close()
    await asyncio.sleep(10)
    assert case.network.heard == []
    assert all(node.is_closed for node in case.network.nodes)
