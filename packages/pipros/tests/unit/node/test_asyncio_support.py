"""Message streams deliver messages from other threads, the newest ones if the queue is full."""

from __future__ import annotations

import asyncio
import threading

from pipros.node.asyncio_support import MessageStream


def fill(stream: MessageStream[int], count: int) -> None:
    """Add numbers from another thread, then end the stream."""
    thread = threading.Thread(target=lambda: ([stream(number) for number in range(count)], stream.close()))
    thread.start()
    thread.join()


def test_without_a_queue_size_all_messages_are_kept_in_order() -> None:
    async def take() -> list[int]:
        stream: MessageStream[int] = MessageStream(None)
        fill(stream, 100)
        return [number async for number in stream]

    assert asyncio.run(take()) == list(range(100))


def test_with_a_queue_size_the_newest_are_kept_and_the_others_counted() -> None:
    async def take() -> tuple[list[int], int]:
        stream: MessageStream[int] = MessageStream(2)
        fill(stream, 100)
        return [number async for number in stream], stream.dropped

    assert asyncio.run(take()) == ([98, 99], 98)


def test_a_message_after_the_end_of_the_loop_is_dropped() -> None:
    async def make() -> MessageStream[int]:
        stream: MessageStream[int] = MessageStream(None)
        fill(stream, 2)
        return stream

    async def take() -> list[int]:
        return [number async for number in stream]

    stream = asyncio.run(make())
    stream(2)
    stream.close()
    assert asyncio.run(take()) == [0, 1]
    assert stream.dropped == 0
