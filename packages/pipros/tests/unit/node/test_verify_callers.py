"""Checks with the master caused by untrusted callers: the first at once, the next ones rarely."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest

from pipros.net.loop import BackgroundLoop
from pipros.node.slave import CallerVerification
from tests.support.waiting import wait_until


@pytest.fixture
def loop() -> Iterator[BackgroundLoop]:
    loop = BackgroundLoop("test")
    loop.start()
    yield loop
    loop.stop()


async def turn() -> None:
    """Do nothing, after all earlier calls."""


def test_the_first_check_runs_at_once_and_not_in_the_event_loop(loop: BackgroundLoop) -> None:
    asked: list[threading.Thread] = []
    verification = CallerVerification(interval_s=1000.0)
    loop.call(verification.ask, "a", lambda: asked.append(threading.current_thread()))
    [thread] = wait_until(lambda: asked)
    assert thread.daemon
    assert not thread.name.startswith("test")


def test_a_flood_of_calls_makes_two_checks(loop: BackgroundLoop) -> None:
    asked: list[str] = []
    began, answered = threading.Event(), threading.Event()

    def ask() -> None:
        asked.append("a")
        began.set()
        answered.wait(30)

    verification = CallerVerification(interval_s=0.01)
    loop.call(verification.ask, "a", ask)
    assert began.wait(30)
    for _ in range(1000):
        loop.call(verification.ask, "a", ask)
    loop.call(verification.ask, "b", lambda: asked.append("b"))
    loop.run(turn())  # all calls have been made
    answered.set()
    wait_until(lambda: asked[-1] == "b")
    assert asked == ["a", "a", "b"]  # a later call may have contained a change


def test_calls_within_the_interval_wait(loop: BackgroundLoop) -> None:
    asked: list[str] = []
    verification = CallerVerification(interval_s=1000.0)
    for about in "abc":
        loop.call(verification.ask, about, lambda about=about: asked.append(about))
    wait_until(lambda: asked)
    loop.run(turn())
    assert asked == ["a"]


def test_a_failing_check_does_not_prevent_the_others(
    loop: BackgroundLoop, monkeypatch: pytest.MonkeyPatch
) -> None:
    failures: list[object] = []
    monkeypatch.setattr(threading, "excepthook", failures.append)
    asked: list[str] = []

    def fail() -> None:
        raise RuntimeError("no")

    verification = CallerVerification(interval_s=0.01)
    loop.call(verification.ask, "a", fail)
    loop.call(verification.ask, "b", lambda: asked.append("b"))
    wait_until(lambda: asked)
    assert len(failures) == 1
