from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

import pytest

from pipros.node.attempts import Attempts


class Peers:
    """Attempts that last until the gate is opened."""

    def __init__(self) -> None:
        self.begun: list[str] = []
        self.gate = asyncio.Event()

    def attempt(self, name: str) -> Callable[[], Awaitable[str]]:
        async def connect() -> str:
            self.begun.append(name)
            await self.gate.wait()
            return name

        return connect


def attempts(limit: int) -> Attempts:
    """Return attempts of which none is slow, not even while this machine is busy."""
    return Attempts(limit, slow_s=1000.0)


async def turns(count: int = 5) -> None:
    for _ in range(count):
        await asyncio.sleep(0)


def test_concurrent_attempts_are_bounded_and_the_others_wait() -> None:
    async def run() -> None:
        bound, peers = attempts(2), Peers()
        tasks = [
            asyncio.create_task(bound.make(peers.attempt(str(number)), is_first=True)) for number in range(5)
        ]
        await turns()
        assert peers.begun == ["0", "1"]
        peers.gate.set()
        assert await asyncio.gather(*tasks) == list("01234")
        assert (peers.begun, bound.under_way) == (list("01234"), 0)

    asyncio.run(run())


def test_untried_peers_precede_failed_ones() -> None:
    async def run() -> None:
        bound, peers = attempts(1), Peers()
        tasks = [
            asyncio.create_task(bound.make(peers.attempt(name), is_first=name != "failed"))
            for name in ("busy", "failed", "new")
        ]
        await turns()
        peers.gate.set()
        await asyncio.gather(*tasks)
        assert peers.begun == ["busy", "new", "failed"]

    asyncio.run(run())


def test_slow_attempts_make_room_up_to_a_bound() -> None:
    async def run() -> None:
        bound, peers = Attempts(1, slow_s=0.01, slow_factor=3), Peers()
        tasks = [
            asyncio.create_task(bound.make(peers.attempt(str(number)), is_first=True)) for number in range(9)
        ]
        for _ in range(1000):
            if bound.under_way == 4 and len(peers.begun) == 4:
                break
            await asyncio.sleep(0.01)
        await asyncio.sleep(0.05)
        assert (bound.under_way, len(peers.begun)) == (4, 4)
        peers.gate.set()
        await asyncio.gather(*tasks)
        assert bound.under_way == 0

    asyncio.run(run())


def test_a_cancelled_attempt_lets_the_next_one_start() -> None:
    async def run() -> None:
        bound, peers = attempts(1), Peers()
        busy, waiting, last = (
            asyncio.create_task(bound.make(peers.attempt(name), is_first=True)) for name in ("a", "b", "c")
        )
        await turns()
        busy.cancel()
        await turns(1)  # the second may start, but has not run yet
        waiting.cancel()
        await turns()
        assert peers.begun[-1] == "c"
        peers.gate.set()
        assert await last == "c"
        assert bound.under_way == 0

    asyncio.run(run())


def test_a_failed_attempt_raises_and_lets_the_next_one_start() -> None:
    async def fail() -> None:
        raise ConnectionRefusedError

    async def run() -> None:
        bound = attempts(1)
        for _ in range(3):
            with pytest.raises(ConnectionRefusedError):
                await bound.make(fail, is_first=True)
        assert bound.under_way == 0

    asyncio.run(run())
