"""A browser whose views compute much leaves the event loop to others, and its coroutines run as any other."""

from __future__ import annotations

import asyncio
import contextlib
import time

import pytest

from pipros.server.loop_share import BURST_S, SHARE, LoopShare

STEP_S = 0.02


def test_many_busy_views_of_a_browser_take_few_steps_while_another_takes_one() -> None:
    async def scenario() -> list[int]:
        share, steps = LoopShare(), 0

        async def view() -> None:
            nonlocal steps
            while True:
                time.sleep(STEP_S)
                steps += 1
                await asyncio.sleep(0)

        views = [asyncio.create_task(share.run(view)) for _ in range(30)]
        counts = []
        for _ in range(10):
            before = steps
            await asyncio.sleep(0.001)
            counts.append(steps - before)
        for each in views:
            each.cancel()
        await asyncio.gather(*views, return_exceptions=True)
        return counts

    assert max(asyncio.run(scenario())) <= 2 * BURST_S / STEP_S / SHARE


def test_a_cancelled_coroutine_does_not_rest_and_its_exceptions_pass() -> None:
    async def scenario() -> list[str]:
        share, ends = LoopShare(), list[str]()

        async def view() -> None:
            for _ in range(20):
                time.sleep(STEP_S)
            try:
                await asyncio.sleep(3600)
            except asyncio.CancelledError:
                ends.append("cancelled")
                raise

        async def failing() -> None:
            await asyncio.sleep(0)
            raise ConnectionError

        with pytest.raises(ConnectionError):
            await share.run(failing)
        task = asyncio.create_task(share.run(view))
        await asyncio.sleep(0.001)
        task.cancel()  # its rest would be as long as its work
        with contextlib.suppress(asyncio.CancelledError):
            await task
        return ends

    assert asyncio.run(scenario()) == ["cancelled"]
