"""The queue of one client: order, limits, losses."""

from __future__ import annotations

from pipros.basics.budget import Budget
from pipros_bridges.outbox import (
    FRAME_BYTES,
    UNCOUNTED_BYTES,
    ClientOutbox,
    ClientTraffic,
    WebSocketFrame,
    text_frame,
)

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
