"""Attempts, calls and checks of a node: limited, and ended with it."""

import asyncio
import threading
import weakref
from collections.abc import Awaitable, Callable, Iterator

import pytest

from pipros.net.loop import BackgroundLoop
from pipros.node.attempts import Attempts
from pipros.node.open_calls import OpenCalls
from pipros.node.slave import CallerVerification
from tests.support.waiting import wait_until


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


# Groups of calls that can be interrupted.


class Call:
    interrupted = 0

    def interrupt(self) -> None:
        self.interrupted += 1

    interrupt_present = interrupt


def test_a_finalizer_may_remove_a_call_while_calls_are_listed() -> None:
    """A link's finalizer once waited for a lock that its own thread held, so a node never ended."""
    calls, other = OpenCalls(), Call()
    held: list[Call] = []

    class Dying(Call):
        @property  # type: ignore[misc]
        def __class__(self) -> type:
            held.clear()  # then, whoever asked for the class has the last reference
            return Call

    held += [Dying(), Dying()]
    for call in (*held, other):
        calls.add(call)
    weakref.finalize(held[0], calls.remove, other)
    del call
    thread = threading.Thread(target=calls.interrupt, args=(1e-3,), daemon=True)
    thread.start()
    thread.join(30)
    assert not thread.is_alive()
    assert not other.interrupted


def test_all_calls_of_a_group_and_its_parts_are_interrupted_and_later_ones_too() -> None:
    calls = OpenCalls()
    part = OpenCalls(part_of=calls)
    first, removed, of_part, late = Call(), Call(), Call(), Call()
    for call in (first, removed):
        calls.add(call)
    part.add(of_part)
    calls.remove(removed)
    calls.interrupt()
    part.add(late)
    assert [call.interrupted for call in (first, removed, of_part, late)] == [1, 0, 1, 1]


# Checks with the master caused by untrusted callers: the first at once, the next ones rarely.


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


def test_a_failing_check_does_not_prevent_the_others(loop: BackgroundLoop, monkeypatch) -> None:
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
