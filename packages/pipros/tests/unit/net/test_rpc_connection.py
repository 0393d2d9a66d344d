"""A connection of the RPC server with a transport in memory and a loop driven by the test."""

import asyncio
import heapq
import itertools
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from typing import Any

import pytest

from pipros.basics.limits import Limits
from pipros.net.connection_table import WHOLE_REQUEST_S, ConnectionTable
from pipros.net.held_bytes import HeldBytes
from pipros.net.loop_turns import TURN_S, LoopTurns
from pipros.net.refusals import Refusals
from pipros.net.rpc_connection import RpcConnection
from pipros.net.rpc_state import BUSY, FINAL, RpcEvent, RpcState, Step, after, next_step
from pipros.net.this_machine import ThisMachineCaller
from pipros.wire.http import build_request
from pipros.wire.xmlrpc import encode_call


class Handle:
    def __init__(self, call: Callable[[], object]) -> None:
        self.call = call
        self.is_cancelled = False

    def cancel(self) -> None:
        self.is_cancelled = True


class Loop:
    """The part of an event loop that a connection uses; the test advances the time."""

    def __init__(self) -> None:
        self.now = 0.0
        self._soon: list[Handle] = []
        self._later: list[tuple[float, int, Handle]] = []
        self._number = itertools.count()

    def time(self) -> float:
        return self.now

    def call_soon(self, function: Callable[..., object], *args: Any) -> Handle:
        handle = Handle(lambda: function(*args))
        self._soon.append(handle)
        return handle

    def call_later(self, delay_s: float, function: Callable[[], object]) -> Handle:
        handle = Handle(function)
        heapq.heappush(self._later, (self.now + delay_s, next(self._number), handle))
        return handle

    def turn(self) -> int:
        """Run the due callbacks; return their number."""
        while self._later and self._later[0][0] <= self.now:
            self._soon.append(heapq.heappop(self._later)[2])
        due, self._soon = [handle for handle in self._soon if not handle.is_cancelled], []
        for handle in due:
            handle.call()
        return len(due)

    def run(self) -> None:
        while self.turn():
            pass


class Transport(asyncio.Transport):
    def __init__(self) -> None:
        super().__init__({"peername": ("10.0.0.9", 4711), "sockname": ("10.0.0.1", 11311)})
        self.sent = b""
        self.events: list[str] = []
        self.is_paused = False
        self.on_write: Callable[[], object] = lambda: None

    def write(self, data: Any) -> None:
        self.sent += bytes(data)
        self.on_write()

    def write_eof(self) -> None:
        self.events.append("eof")

    def close(self) -> None:
        self.events.append("close")

    def abort(self) -> None:
        self.events.append("abort")

    def pause_reading(self) -> None:
        self.is_paused = True

    def resume_reading(self) -> None:
        self.is_paused = False

    @property
    def answers(self) -> int:
        return self.sent.count(b"HTTP/1.1 200")


class Server:
    """A server that answers every method at once, within a millisecond."""

    def __init__(self, loop: Loop) -> None:
        self.loop, self.turns = loop, LoopTurns(loop)  # type: ignore[arg-type]
        self.limits = Limits()
        self.refusals = Refusals()
        self.connections = ConnectionTable(limit=10, limit_per_peer=10, refusals=self.refusals)
        self.bodies = HeldBytes(limit_bytes=1 << 20, refusals=self.refusals)
        self.admits_peers = True
        self.on_lost: Callable[..., object] | None = None

    @property
    def large_values(self) -> Executor:
        raise AssertionError("these tests send no large values")

    def admits(self, caller: ThisMachineCaller) -> bool:
        assert caller.host == "10.0.0.9"
        return self.admits_peers

    def call(self, name: str, params: tuple[Any, ...], *, caller: ThisMachineCaller) -> Any:
        del params, caller
        self.loop.now += TURN_S
        return [1, name, 4711]


class Peer:
    """A connection with its loop, server and transport."""

    def __init__(self, server: Server | None = None) -> None:
        self.server, self.transport = server or Server(Loop()), Transport()
        self.loop = self.server.loop
        self.connection = RpcConnection(self.server, self.loop)

    def connect(self) -> None:
        self.connection.connection_made(self.transport)

    def send(self, data: bytes) -> None:
        self.connection.data_received(data)


CALL = build_request("master", "/", encode_call("getPid", ("/me",)))


@pytest.fixture
def peer() -> Iterator[Peer]:
    peer = Peer()
    peer.connect()
    yield peer
    peer.connection.connection_lost(None)
    assert len(peer.server.connections) == 0


def test_a_quick_call_is_answered_in_the_read_callback(peer: Peer) -> None:
    peer.send(CALL)
    assert peer.transport.answers == 1
    assert b"4711" in peer.transport.sent
    assert peer.loop.turn() == 0


def test_pipelined_calls_of_all_connections_take_a_millisecond_of_a_turn(peer: Peer) -> None:
    peers = [peer, Peer(peer.server), Peer(peer.server)]
    for each in peers[1:]:
        each.connect()
    for each in peers:
        each.send(CALL * 3)
    answered = [sum(each.transport.answers for each in peers)]
    peers[1].connection.abort()
    peers[1].connection.connection_lost(None)
    while peer.loop.turn():
        answered.append(sum(each.transport.answers for each in peers))
    assert answered == [3, 4, 5, 6, 7]
    peers[2].connection.connection_lost(None)


def test_calls_that_follow_each_other_stay_one_callback_of_the_loop() -> None:
    loop, called = Loop(), []
    turns = LoopTurns(loop)  # type: ignore[arg-type]

    def call() -> None:
        called.append(loop.now)
        loop.now += TURN_S / 8
        if len(called) < 100:
            turns.put("peer", call)

    turns.put("peer", call)
    ran = list(iter(loop.turn, 0))
    assert (set(ran), len(called)) == ({1}, 100)
    assert len(ran) > 10


def test_a_call_in_pieces_is_answered_when_it_is_whole(peer: Peer) -> None:
    for byte in CALL[:-1]:
        peer.send(bytes([byte]))
        assert peer.transport.sent == b""
    peer.send(CALL[-1:])
    assert peer.transport.answers == 1


def test_reading_pauses_while_the_peer_does_not_read(peer: Peer) -> None:
    peer.transport.on_write = peer.connection.pause_writing
    peer.send(CALL * 2)
    peer.loop.run()
    peer.send(CALL)
    assert (peer.transport.answers, peer.transport.is_paused) == (1, True)
    peer.transport.on_write = lambda: None
    peer.connection.resume_writing()
    peer.loop.run()
    assert (peer.transport.answers, peer.transport.is_paused) == (3, False)


def test_a_peer_that_does_not_read_is_closed_at_the_deadline(peer: Peer) -> None:
    peer.transport.on_write = peer.connection.pause_writing
    peer.send(CALL)
    limit_s = WHOLE_REQUEST_S
    peer.server.connections.close_overdue(limit_s - 1, 1e9)
    assert peer.transport.events == []
    peer.server.connections.close_overdue(limit_s + 1, 1e9)
    assert peer.transport.events == ["abort"]


def test_single_bytes_do_not_extend_the_deadline_of_a_request(peer: Peer) -> None:
    limit_s = WHOLE_REQUEST_S
    peer.send(CALL[:10])
    peer.loop.now = limit_s - 1
    peer.send(CALL[10:11])
    peer.server.connections.close_overdue(limit_s + 1, 1e9)
    assert peer.transport.events == ["abort"]


def test_a_half_closed_peer_gets_all_its_responses(peer: Peer) -> None:
    peer.send(CALL * 3)
    assert peer.connection.eof_received()
    assert peer.transport.events == []
    peer.loop.run()
    assert (peer.transport.answers, peer.transport.events) == (3, ["close"])


def test_a_peer_that_ends_without_a_call_is_closed(peer: Peer) -> None:
    peer.connection.eof_received()
    assert peer.transport.events == ["close"]


def test_a_refused_peer_may_finish_its_request_and_read_the_reason(peer: Peer) -> None:
    peer.send(b"GARBAGE\r\n\r\n")
    assert peer.transport.sent.startswith(b"HTTP/1.1 4")
    assert peer.transport.events == ["eof"]
    peer.send(CALL)
    peer.loop.run()
    assert peer.transport.answers == 0
    peer.connection.eof_received()
    assert (peer.transport.events, peer.server.refusals.total) == (["eof", "close"], 1)


def test_a_refused_peer_is_closed_at_the_deadline(peer: Peer) -> None:
    peer.send(b"GARBAGE\r\n\r\n")
    peer.loop.now = 60
    peer.loop.run()
    assert peer.transport.events == ["eof", "abort"]


def test_a_refusal_that_fills_the_transport_is_drained_too(peer: Peer) -> None:
    peer.transport.on_write = peer.connection.pause_writing
    peer.send(b"GARBAGE\r\n\r\n")
    peer.connection.resume_writing()
    peer.loop.run()
    assert peer.transport.events == ["eof"]


def test_http_1_0_is_closed_after_its_answer(peer: Peer) -> None:
    peer.send(CALL.replace(b"HTTP/1.1", b"HTTP/1.0") + CALL)
    peer.loop.run()
    assert (peer.transport.answers, peer.transport.events) == (1, ["close"])


def test_a_peer_that_is_not_admitted_is_closed_at_once() -> None:
    peer = Peer()
    peer.server.admits_peers = False
    peer.connect()
    assert (peer.transport.events, len(peer.server.connections)) == (["abort"], 0)


def test_nothing_is_written_to_a_connection_that_was_lost_in_between(peer: Peer) -> None:
    peer.send(CALL * 2)
    peer.connection.connection_lost(None)
    peer.loop.run()
    assert peer.transport.answers == 1


# State transitions of a connection of the RPC server.


def run(*events: RpcEvent) -> RpcState:
    state = RpcState.READING
    for event in events:
        state = after(state, event)
    return state


@pytest.mark.parametrize("state", RpcState)
def test_every_connection_can_be_aborted(state: RpcState) -> None:
    assert after(state, RpcEvent.ABORTED) is RpcState.CLOSED


@pytest.mark.parametrize("event", RpcEvent)
def test_a_closed_connection_stays_closed(event: RpcEvent) -> None:
    assert after(RpcState.CLOSED, event) is RpcState.CLOSED


def test_a_final_state_has_no_transitions() -> None:
    for state, event in itertools.product(FINAL, RpcEvent):
        assert after(state, event) in FINAL


@pytest.mark.parametrize(("begin", "end", "state"), [
    (RpcEvent.TURN_QUEUED, RpcEvent.TURN_BEGAN, RpcState.QUEUED),
    (RpcEvent.TASK_BEGAN, RpcEvent.TASK_DONE, RpcState.ANSWERING),
    (RpcEvent.WRITING_PAUSED, RpcEvent.WRITING_RESUMED, RpcState.STALLED),
])  # fmt: skip
def test_each_busy_state_is_left_only_by_its_own_end(begin: RpcEvent, end: RpcEvent, state: RpcState) -> None:
    assert state in BUSY
    assert run(begin) is state
    assert run(begin, end) is RpcState.READING
    for other in {RpcEvent.TURN_BEGAN, RpcEvent.TASK_DONE, RpcEvent.WRITING_RESUMED} - {end}:
        assert run(begin, other) is state


def test_a_refusal_that_fills_the_transport_is_drained_and_a_response_sent_before_a_close() -> None:
    refused = (RpcEvent.WRITING_PAUSED, RpcEvent.REQUEST_REFUSED)
    assert run(*refused) is run(*refused, RpcEvent.WRITING_RESUMED) is RpcState.DRAINING
    assert run(RpcEvent.REQUEST_REFUSED, RpcEvent.CLOSED_GRACEFULLY) is RpcState.CLOSING
    assert run(RpcEvent.TASK_BEGAN, RpcEvent.CLOSED_GRACEFULLY) is RpcState.ANSWERING
    assert run(RpcEvent.TURN_QUEUED, RpcEvent.CLOSED_GRACEFULLY) is RpcState.QUEUED


EITHER = (False, True)


STEPS = [
    ((True,), EITHER, EITHER, EITHER, Step.QUEUE_TURN),  # a large answer is sent completely first
    ((False,), (True,), EITHER, EITHER, Step.CLOSE),  # no bytes follow the last response
    ((False,), (False,), (True,), EITHER, Step.QUEUE_TURN),  # also calls of a peer that has closed its half
    ((False,), (False,), (False,), (True,), Step.CLOSE),
    ((False,), (False,), (False,), (False,), Step.READ),
]


@pytest.mark.parametrize(("unsent", "last", "inputs", "ended", "step"), STEPS)
def test_answers_are_sent_before_calls_are_read_or_the_connection_is_closed(
    unsent: tuple[bool], last: tuple[bool], inputs: tuple[bool], ended: tuple[bool], step: Step
) -> None:
    for each in itertools.product(unsent, last, inputs, ended):
        names = ("has_unsent", "is_last_answer", "has_input", "has_peer_ended")
        assert next_step(**dict(zip(names, each, strict=True))) is step
