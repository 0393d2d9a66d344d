"""What one client of a bridge can make the server keep and do, counted in bytes and in steps."""

import datetime
import json
import re
import threading
from collections import Counter
from functools import partial
from typing import Any

import bson
import pytest

from pipros.basics.errors import LimitExceeded
from pipros.basics.limits import Limits
from pipros_bridges.call_turns import CallTurns
from pipros_bridges.rosbridge.effects import Disconnect, Publish, Reply
from pipros_bridges.rosbridge.protocol import ClientProtocol
from pipros_bridges.rosbridge.settings import RosbridgeSettings
from pipros_bridges.shares import ServerShares, TopicShares
from tests.support.constants import Constants
from tests.support.waiting import wait_until


class Peer:
    """A client of rosbridge, without sockets."""

    def __init__(self, settings: RosbridgeSettings | None = None, limits: Limits | None = None) -> None:
        self.protocol = ClientProtocol(settings or RosbridgeSettings(), str, limits)

    def sends(self, data: str | bytes) -> list[Any]:
        return list(self.protocol.receive(data))


@pytest.mark.parametrize("operation", [
    {"op": "subscribe", "topic": "/a%d"}, {"op": "subscribe", "topic": "/a", "id": "%d"},
    {"op": "advertise", "topic": "/a%d", "type": "std_msgs/String"},
    {"op": "advertise", "topic": "/a", "type": "std_msgs/String", "id": "%d"},
    {"op": "publish", "topic": "/a%d", "msg": {}},
    {"op": "advertise_service", "service": "/a%d", "type": "std_srvs/Empty"},
])  # fmt: skip
def test_a_client_that_makes_the_server_keep_too_much_is_told_once_and_then_disconnected(
    operation: dict[str, Any], constants: Constants
) -> None:
    constants(BRIDGE_KEPT_BYTES=20000)
    limits = Limits()
    shares = ServerShares(limits).client()
    protocol = ClientProtocol(RosbridgeSettings(), str, limits, shares=shares)
    errors: list[str] = []
    for number in range(1000):
        for effect in protocol.receive(json.dumps(operation).replace("%d", f"{number:0500}")):
            if isinstance(effect, Disconnect):
                assert "the limit is 20000 bytes" in effect.reason
                assert len(errors) == 1
                assert "the limit is 20000 bytes" in errors[0]
                assert shares.kept.peak <= 20_000
                return
            if isinstance(effect, Reply):
                errors.append(effect.operation["msg"])
    raise AssertionError("the client was never disconnected")


def test_what_a_client_no_longer_uses_is_no_longer_counted() -> None:
    limits = Limits()
    shares = ServerShares(limits).client()
    protocol = ClientProtocol(RosbridgeSettings(), str, limits, shares=shares)
    for number in range(50):
        for op, values in (
            ("subscribe", {"topic": "/a", "id": number}),
            ("subscribe", {"topic": "/a", "id": number, "queue_length": 3}),
            ("advertise", {"topic": f"/b{number}", "type": "std_msgs/String", "id": 1}),
            ("publish", {"topic": f"/c{number}"}),
            ("advertise_service", {"service": f"/d{number}", "type": "std_srvs/Empty"}),
        ):
            assert list(protocol.receive(json.dumps({"op": op, **values})))
    assert shares.kept.used > 50 * 1000
    for number in range(50):
        for op, values in (
            ("unsubscribe", {"topic": "/a", "id": number}),
            ("unadvertise", {"topic": f"/b{number}", "id": 1}),
            ("unadvertise", {"topic": f"/c{number}"}),
            ("unadvertise_service", {"service": f"/d{number}"}),
        ):
            assert list(protocol.receive(json.dumps({"op": op, **values})))
    assert shares.memory.used == 0


def test_a_bson_document_with_too_many_values_is_refused_before_it_is_parsed(constants: Constants) -> None:
    constants(BRIDGE_PARSED_BYTES=1000000)
    peer = Peer(RosbridgeSettings(is_bson=True))
    for values in ([[]] * 5_000, [{"a": {}}] * 3_000, [None] * 20_000, {str(n): 0 for n in range(20_000)}):
        [reply] = peer.sends(bson.encode({"op": "publish", "topic": "/a", "msg": {"data": values}}))
        assert "the limit is 1000000 bytes" in reply.operation["msg"]
    [reply] = peer.sends(bson.encode({"op": "publish", "topic": "/a", "x": re.compile("a"), "y": "z" * 5000}))
    assert "unsupported type" in reply.operation["msg"]
    values = {
        "data": b"x" * 400_000, "text": "\0" * 10,
        "time": datetime.datetime(2020, 1, 1, tzinfo=datetime.timezone.utc), "n": [1, 2.0, True],
    }  # fmt: skip
    document = bson.encode({"op": "publish", "topic": "/a", "msg": values})
    assert [type(effect) for effect in peer.sends(document)] == [Publish]


@pytest.mark.parametrize("service", [[[]], {}, 5, None, True])
def test_a_reader_that_calls_an_invalid_service_gets_an_error(service: Any) -> None:
    peer = Peer(RosbridgeSettings(has_control=False))
    [reply] = peer.sends(json.dumps({"op": "call_service", "service": service}))
    assert reply.operation["result"] is False


def test_incomplete_texts_and_fragments_are_counted_with_their_overhead() -> None:
    shares = ServerShares(Limits()).client()
    protocol = ClientProtocol(RosbridgeSettings(), str, shares=shares)
    assert list(protocol.receive_stream('{"a": "')) == []
    for _ in range(1000):
        assert list(protocol.receive_stream("x")) == []
    assert shares.input.used >= 1000 * "x".__sizeof__()
    assert (len(list(protocol.receive_stream('"}'))), shares.input.used) == (1, 0)
    for number in range(100):
        fragment = {"op": "fragment", "id": number, "data": "x", "num": 0, "total": 2}
        assert list(protocol.receive(json.dumps(fragment))) == []
    assert shares.input.used >= 20_000
    for number in range(100):
        list(
            protocol.receive(json.dumps({"op": "fragment", "id": number, "data": "x", "num": 1, "total": 2}))
        )
    assert shares.memory.used == 0


def test_twenty_hostile_clients_leave_room_for_another_and_return_everything() -> None:
    limits = Limits()
    server = ServerShares(limits)
    hostile = [server.client() for _ in range(20)]
    for client in hostile:
        for budget in (client.input, client.kept, client.parsed, client.queue, client.calls):
            while budget.take(16 * 1024):
                pass
        assert client.memory.used <= 64 * 1024 * 1024
    assert (
        server.memory.used + sum(min(each.memory.used, 256 * 1024) for each in hostile) <= 256 * 1024 * 1024
    )
    modest = server.client()
    assert modest.queue.take(256 * 1024)
    for client in [*hostile, modest]:
        client.close()
    assert server.memory.used == 0


def test_a_topic_counts_for_the_client_that_needs_it_and_for_its_heir() -> None:
    topics = TopicShares(100)
    for number in range(100):
        if number < 58:  # half of all, and eight of its own
            topics.enter(f"/{number}", "greedy")
        else:
            with pytest.raises(LimitExceeded, match="this client has 58"):
                topics.enter(f"/{number}", "greedy")
    for number in range(33):
        topics.enter(f"/x{number}", "second")
    for client in range(30):
        for number in range(8):
            topics.enter(f"/{client}/{number}", client)
    topics.enter("/0", "heir")
    assert not topics.leave("/0", "greedy")
    topics.enter("/again", "heir")
    assert topics.leave("/0", "heir")
    assert "/0" not in topics
    for number in range(1, 58):
        assert topics.leave(f"/{number}", "greedy")
    assert topics.leave("/again", "heir")
    assert topics.counts().keys() == {
        *(f"/x{number}" for number in range(33)),
        *(f"/{client}/{number}" for client in range(30) for number in range(8)),
    }


def test_calls_of_one_client_leave_threads_for_the_others() -> None:
    turns = CallTurns("test", 16)
    release = threading.Event()
    running: Counter[str] = Counter()

    def call(name: str) -> None:
        running[name] += 1
        release.wait(60)

    hostile = [turns.user() for _ in range(6)]
    for number, client in enumerate(hostile):
        for _ in range(50):
            client.run(partial(call, str(number)))
    others = [turns.user() for _ in range(3)]
    for client in others:
        client.run(partial(call, "other"))
    wait_until(lambda: running["other"] == 3, 30)
    wait_until(lambda: running["0"] == 5, 30)
    assert max(running.values()) <= 5
    for client in hostile:
        client.close()
    release.set()
    again = turns.user()
    for _ in range(5):
        again.run(partial(call, "again"))
    wait_until(lambda: running["again"] == 5, 30)
    assert running.total() < 40
    turns.close()
