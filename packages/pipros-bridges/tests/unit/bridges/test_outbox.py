"""The queue of one client: order, limits, losses."""

from __future__ import annotations

import asyncio
import threading
from itertools import pairwise
from typing import Any
from unittest.mock import AsyncMock, MagicMock

import pytest
from websockets.server import ServerProtocol

from pipros.basics.budget import Budget
from pipros.basics.limits import Limits
from pipros.net.workers import Workers
from pipros_bridges.call_turns import QuestionTurns
from pipros_bridges.client import BridgeClient
from pipros_bridges.connection import BridgeConnection, Wakeups
from pipros_bridges.limits import BridgeLimits
from pipros_bridges.outbox import (
    FRAME_BYTES,
    UNCOUNTED_BYTES,
    ClientOutbox,
    ClientTraffic,
    WebSocketFrame,
    text_frame,
)
from pipros_bridges.pace import BURST_S, ReadPace
from tests.support.waiting import wait_until

MIB = 1 << 20


class Client:
    """An outbox that counts how often it wakes the event loop."""

    def __init__(self, limit_bytes: int = 100) -> None:
        self.wakes = 0
        self.outbox = ClientOutbox(limit_bytes, self.wake, frame_bytes=0)
        for key in "ab":
            self.outbox.open(key)

    def wake(self) -> None:
        self.wakes += 1

    def put(self, key: str, data: bytes) -> None:
        self.outbox.put(key, WebSocketFrame((data,)))

    def taken(self) -> list[bytes]:
        """Pop everything."""
        found = []
        while (frames := self.outbox.pop()) is not None:
            found.append(b"|".join(b"".join(frame.parts) for frame in frames))
        return found


def test_messages_and_answers_keep_their_order() -> None:
    client = Client()
    client.put("a", b"1")
    client.outbox.answer(text_frame("2"))
    client.put("b", b"3")
    client.outbox.answer(text_frame("4"))
    client.put("a", b"5")

    assert (client.taken(), client.wakes) == ([b"1", b"2", b"3", b"4", b"5"], 1)


def test_the_loop_is_woken_again_after_the_outbox_was_empty() -> None:
    client = Client()
    client.put("a", b"1")
    client.taken()
    client.put("a", b"2")

    assert client.wakes == 2


def test_a_queue_length_drops_the_oldest_messages_of_its_subscription_only() -> None:
    client = Client()
    client.outbox.open("a", queue_length=2)
    for number in range(4):
        client.put("a", b"a%d" % number)
        client.put("b", b"b%d" % number)

    assert client.taken() == [b"b0", b"b1", b"a2", b"b2", b"a3", b"b3"]
    assert client.outbox.traffic() == {"a": ClientTraffic(2, 4, 2), "b": ClientTraffic(4, 8, 0)}


def test_more_bytes_than_the_limit_drop_the_oldest_messages_of_all() -> None:
    client = Client(limit_bytes=10)
    client.put("a", b"aaaa")
    client.put("b", b"bbbb")
    client.put("a", b"AAAA")

    assert (client.outbox.waiting_bytes, client.taken()) == (8, [b"bbbb", b"AAAA"])
    assert client.outbox.total == ClientTraffic(2, 8, 1)


def test_a_message_larger_than_the_limit_waits_alone() -> None:
    client = Client(limit_bytes=10)
    client.put("a", b"1")
    client.put("b", b"x" * 50)
    assert client.taken() == [b"x" * 50]


def test_answers_are_not_dropped_for_messages() -> None:
    client = Client(limit_bytes=10)
    client.outbox.answer(WebSocketFrame((b"answer",)))
    client.put("a", b"1")
    client.put("a", b"123456789")
    client.put("a", b"2")

    assert client.taken() == [b"answer", b"2"]


def test_a_client_whose_answers_do_not_fit_is_overrun() -> None:
    client = Client(limit_bytes=10)
    client.put("a", b"1")
    client.outbox.answer(WebSocketFrame((b"12345678",)))
    client.outbox.answer(WebSocketFrame((b"too much",)))

    assert client.outbox.is_overrun
    assert (client.wakes, client.taken()) == (2, [])


def test_frames_of_one_message_are_dropped_together() -> None:
    client = Client()
    client.outbox.open("a", queue_length=1)
    client.outbox.put("a", WebSocketFrame((b"1",)), WebSocketFrame((b"2", b"3")))
    client.outbox.put("a", WebSocketFrame((b"4",)), WebSocketFrame((b"5", b"6")))

    assert client.taken() == [b"4|56"]


def test_messages_of_ended_subscriptions_are_not_sent() -> None:
    client = Client()
    client.put("a", b"1")
    client.put("b", b"2")
    client.outbox.forget("a")
    client.put("a", b"3")

    assert (client.outbox.waiting_bytes, client.taken(), client.outbox.total.lost) == (1, [b"2"], 0)


def test_a_closed_outbox_accepts_nothing() -> None:
    client = Client()
    client.put("a", b"1")
    client.outbox.close()
    client.put("a", b"2")
    client.outbox.answer(WebSocketFrame((b"3",)))

    assert (client.taken(), client.outbox.waiting_bytes) == ([], 0)


def test_only_responses_count_as_answers() -> None:
    client = Client()
    client.put("a", b"1")
    assert not client.outbox.has_answers

    client.outbox.answer(text_frame("2"))
    assert client.outbox.has_answers
    client.taken()
    assert not client.outbox.has_answers


def budgeted(budget: Budget, limit_bytes: int = 10 * MIB) -> ClientOutbox:
    outbox = ClientOutbox(limit_bytes, lambda: None, budget, frame_bytes=0)
    outbox.open("a")
    return outbox


def test_a_long_queue_uses_the_budget_until_it_is_sent() -> None:
    budget = Budget(MIB)
    outbox = budgeted(budget)
    outbox.put("a", WebSocketFrame((bytes(UNCOUNTED_BYTES),)))
    assert budget.used == 0  # small queues are not counted

    outbox.put("a", WebSocketFrame((bytes(100_000),)))
    assert 100_000 <= budget.used <= MIB

    outbox.pop()
    outbox.pop()
    assert budget.used == 0


def test_a_queue_that_becomes_much_shorter_returns_most_of_its_room() -> None:
    budget = Budget(10 * MIB)
    outbox = budgeted(budget)
    for size in (MIB, MIB, 100_000):
        outbox.put("a", WebSocketFrame((bytes(size),)))
    assert budget.used >= 2 * MIB

    outbox.pop()
    outbox.pop()
    assert 100_000 - UNCOUNTED_BYTES <= budget.used < 2 * MIB


def test_the_last_bytes_of_a_budget_are_used() -> None:
    budget = Budget(50_000)
    outbox = budgeted(budget)
    for size in (UNCOUNTED_BYTES, 50_000):
        outbox.put("a", WebSocketFrame((bytes(size),)))

    assert (budget.used, outbox.total.lost) == (50_000, 0)


def test_without_budget_the_oldest_messages_are_dropped_before_the_limit() -> None:
    budget = Budget(50_000)
    outbox = budgeted(budget)
    for size in (UNCOUNTED_BYTES, 50_001):
        outbox.put("a", WebSocketFrame((bytes(size),)))

    assert (outbox.total.lost, outbox.waiting_bytes) == (1, 50_001)


def test_clients_share_a_budget_and_a_closed_one_returns_its_part() -> None:
    budget = Budget(MIB)
    first, second = budgeted(budget), budgeted(budget)
    first.answer(WebSocketFrame((bytes(MIB),)))
    second.answer(WebSocketFrame((b"small",)))
    second.answer(WebSocketFrame((bytes(MIB),)))
    assert second.is_overrun

    first.close()
    assert budget.used == 0


def test_small_frames_count_with_their_overhead() -> None:
    outbox = ClientOutbox(10 * (FRAME_BYTES + 2), lambda: None)
    outbox.open("a")
    for number in range(100):
        outbox.put("a", WebSocketFrame((b"%02d" % number,)))
    assert (outbox.total.lost, outbox.waiting_bytes) == (90, 10 * (FRAME_BYTES + 2))
    assert outbox.pop() is not None
    assert (outbox.total.bytes, outbox.waiting_bytes) == (2, 9 * (FRAME_BYTES + 2))
    fragments = [WebSocketFrame((b"x",))] * 6
    outbox.answer(*fragments)
    assert not outbox.is_overrun
    outbox.answer(*fragments)
    assert outbox.is_overrun


# Rate limits for the messages of one client.


LIMITS = Limits(tables=(BridgeLimits(bridge_client_rate=10, bridge_client_rate_bytes=1000),))


class Clock:
    now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def test_a_client_within_both_limits_is_not_delayed() -> None:
    clock = Clock()
    pace = ReadPace(LIMITS, clock)
    for _ in range(100):
        assert pace.delay_s(50) == 0
        clock.now_s += 0.11


@pytest.mark.parametrize(("size", "rate"), [(1, 10), (500, 2)])
def test_a_client_that_waits_as_required_keeps_the_limit(size: int, rate: int) -> None:
    clock = Clock()
    pace = ReadPace(LIMITS, clock)
    sent = 0
    while clock.now_s < 110:
        clock.now_s += pace.delay_s(size)
        sent += 1
    assert sent == pytest.approx(rate * (10 + BURST_S), abs=2)


def test_a_silent_client_saves_one_burst_only() -> None:
    clock = Clock()
    pace = ReadPace(LIMITS, clock)
    clock.now_s += 3600
    assert [pace.delay_s(500) for _ in range(3)] == pytest.approx([0, 0, 0.5])


# Connections of bridge clients, with a transport that only records.


class Transport(asyncio.Transport):
    def __init__(self) -> None:
        super().__init__()
        self.written: list[bytes] = []

    def write(self, data: Any) -> None:
        self.written.append(bytes(data))

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None:
        pass

    def is_closing(self) -> bool:
        return False


class Listener:
    """Stands for `pipros_server.listener.Listener`, and for the accepted that it returns."""

    def accepted_socket(self, transport: object) -> Listener:
        return self

    def set_transport(self, transport: object) -> None:
        pass

    def setsockopt(self, level: int, option: int, value: int) -> None:
        pass


def test_nothing_is_written_while_the_transport_resumes_writing() -> None:
    # If such a write fails, asyncio closes the transport twice, and logs an error for the second time.
    async def resume() -> None:
        listener: Any = Listener()
        server = MagicMock(handler=AsyncMock())
        connection = BridgeConnection(listener, 1_000, ServerProtocol(), server, ping_interval=None)
        transport = Transport()
        connection.connection_made(transport)
        has_resumed = asyncio.Event()
        connection.on_writable = has_resumed.set
        connection.pause_writing()
        connection.resume_writing()
        assert not has_resumed.is_set()
        await asyncio.wait_for(has_resumed.wait(), 60)

    asyncio.run(resume())


class Writable:
    """A connection that accepts every frame, and counts them."""

    remote_address = "127.0.0.1", 1
    request = None
    is_writable = True
    paused = False

    def __init__(self) -> None:
        self.written = 0

    def write(self, frame: WebSocketFrame) -> None:
        self.written += 1


def test_other_clients_have_their_turn_between_many_small_frames() -> None:
    async def send() -> list[int]:
        connection: Any = Writable()
        shares: Any = MagicMock(queue=None)
        wakeups = Wakeups(asyncio.get_running_loop())
        client = BridgeClient(connection, 1, "rosbridge", Limits(), wakeups, shares)
        client.send(*[WebSocketFrame((b"x",))] * 10_000)  # the fragments of a response
        counts = [0]
        while connection.written < 10_000:
            await asyncio.sleep(0)
            counts.append(connection.written)
        return counts

    counts = asyncio.run(send())
    assert max(later - before for before, later in pairwise(counts)) <= 200


# Questions of clients are answered in turns, by a few threads.


def test_a_client_with_one_question_waits_for_one_question_of_each_other_client() -> None:
    turns = QuestionTurns("questions", 1)
    may_begin = threading.Event()
    asked: list[str] = []
    turns.run("greedy", lambda: may_begin.wait(20))
    for number in range(100):
        turns.run("greedy", lambda number=number: asked.append(f"greedy {number}"))
    turns.run("modest", lambda: asked.append("modest"))
    may_begin.set()
    wait_until(lambda: len(asked) == 101)
    assert asked.index("modest") <= 1
    assert [each for each in asked if each != "modest"] == [f"greedy {number}" for number in range(100)]
    turns.close()


def test_the_questions_share_a_few_threads() -> None:
    turns = QuestionTurns("questions", 2)
    together = threading.Barrier(3)
    threads: set[int] = set()

    def meet() -> None:
        threads.add(threading.get_ident())
        together.wait(20)

    for user in range(4):
        turns.run(user, meet)
    together.wait(20)
    together.wait(20)
    assert len(threads) == 2
    turns.close()


def test_questions_of_a_client_that_has_left_are_dropped_and_errors_end_no_thread() -> None:
    turns = QuestionTurns("questions", 1)
    may_begin, is_done = threading.Event(), threading.Event()
    asked: list[str] = []
    turns.run("other", lambda: may_begin.wait(20))
    turns.run("gone", lambda: asked.append("gone"))
    turns.run("other", lambda: 1 / 0)
    turns.run("other", is_done.set)
    turns.forget("gone")
    may_begin.set()
    assert is_done.wait(20)
    assert not asked
    turns.close()


def test_a_question_for_which_no_thread_can_start_is_refused_or_left_to_a_running_thread(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(*_: object) -> None:
        raise RuntimeError("can't start new thread")

    turns = QuestionTurns("questions", 2)
    asked: list[str] = []
    with monkeypatch.context() as changes:
        changes.setattr(Workers, "run", fail)
        with pytest.raises(RuntimeError, match="start new thread"):
            turns.run("refused", lambda: asked.append("refused"))
    may_begin = threading.Event()
    turns.run("first", lambda: may_begin.wait(20))
    monkeypatch.setattr(Workers, "run", fail)
    turns.run("second", lambda: asked.append("second"))
    may_begin.set()
    wait_until(lambda: asked == ["second"])
    turns.close()
