"""The observed system, with observers that fail or are rarely asked."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from pipros.net.loop import BackgroundLoop
from pipros_page import watched_system
from pipros_page.watched_system import WatchedSystem
from pipros_tools.graph.observer import GraphObservation


class ClumsyObserver:
    """Fails twice, and then succeeds."""

    def __init__(self, *_: object, **__: object) -> None:
        self.looks = 0

    def poll(self) -> GraphObservation:
        self.looks += 1
        if self.looks <= 2:
            raise IndexError("list index out of range")
        return GraphObservation(error=f"look {self.looks}")

    def close(self) -> None:
        pass


def test_polling_continues_after_an_error(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(watched_system, "SystemObserver", ClumsyObserver)
    nothing: Any = SimpleNamespace(master=None)

    async def errors() -> list[str]:
        system = WatchedSystem(nothing, nothing, interval_s=0.01)
        system.start()
        found = []
        async for observation in system.observations():
            found.append(observation.error)
            if len(found) == 3:
                break
        system.close()
        return found

    loop = BackgroundLoop("test")
    loop.start()
    try:
        failure = "cannot observe the system: IndexError: list index out of range"
        assert loop.run(errors(), 60) == [failure, failure, "look 3"]
    finally:
        loop.stop()
    assert [record.getMessage() for record in caplog.records] == [failure]


def test_a_view_that_opens_between_two_looks_shows_the_last_one_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(
        watched_system, "SystemObserver", lambda *_, **__: SimpleNamespace(poll=GraphObservation)
    )
    nothing: Any = SimpleNamespace(master=None)

    async def observations() -> list[GraphObservation]:
        system = WatchedSystem(nothing, nothing, interval_s=600)
        system.start()
        found = [await anext(system.observations()) for _ in range(2)]
        system.close()
        return found

    loop = BackgroundLoop("test")
    loop.start()
    try:
        first, second = loop.run(observations(), 60)
    finally:
        loop.stop()
    assert second is first
