import asyncio
import errno
import inspect
import os
import socket
import threading
from typing import Any

import pytest

from pipros.net.lookup import Lookups
from pipros.net.loop import BackgroundLoop, in_daemon_thread
from tests.support.waiting import wait_until


class Silence:
    """A resolver that blocks until the test ends."""

    def __init__(self) -> None:
        self.began, self.end = threading.Event(), threading.Event()
        self.thread: threading.Thread | None = None

    def __call__(self, host: str, _port: None, **_wanted: int) -> list[Any]:
        self.thread = threading.current_thread()
        self.began.set()
        if host != "robot":
            self.end.wait(60)
        return [(socket.AF_INET, socket.SOCK_STREAM, 6, "", ("127.0.0.1", 0))]


@pytest.fixture
def silence() -> Any:
    silence = Silence()
    yield silence
    silence.end.set()


def test_a_connection_by_name_uses_the_lookup_threads(silence: Silence) -> None:
    loop = BackgroundLoop("test", Lookups(2, resolve=silence))
    loop.start()
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]

        async def connect() -> None:
            _, writer = await asyncio.open_connection("robot", port)
            writer.close()

        loop.run(connect(), 30)
    loop.stop()
    assert silence.thread.daemon
    assert silence.thread is not threading.main_thread()


def test_closing_the_loop_does_not_wait_for_lookups(silence: Silence) -> None:
    loop = BackgroundLoop("test", Lookups(2, resolve=silence))
    loop.start()

    async def look_up() -> None:
        await asyncio.get_running_loop().getaddrinfo("silent", 80)

    loop.spawn(look_up())
    assert silence.began.wait(30)
    loop.stop()
    assert silence.thread.daemon
    assert silence.thread.is_alive()


def test_blocking_calls_run_in_daemon_threads_and_return_their_result() -> None:
    loop = BackgroundLoop("test")
    loop.start()

    def fail() -> None:
        raise ValueError("no")

    async def outcomes() -> list[Any]:
        running = asyncio.get_running_loop()
        return [
            await running.run_in_executor(None, threading.current_thread),
            await asyncio.to_thread(threading.current_thread),
            await in_daemon_thread(threading.current_thread),
            *await asyncio.gather(
                running.run_in_executor(None, fail), in_daemon_thread(fail), return_exceptions=True
            ),
        ]

    *threads, first, second = loop.run(outcomes(), 30)
    loop.stop()
    assert [thread.daemon for thread in threads] == [True, True, True]
    assert [str(first), str(second)] == ["no", "no"]


def test_a_loop_that_cannot_be_created_raises_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*args: object) -> None:
        raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))

    monkeypatch.setattr(socket, "socketpair", refuse)
    with pytest.raises(OSError, match="Too many open files"):
        BackgroundLoop("mine").start()


def test_a_lack_of_descriptors_is_logged_once_and_without_a_traceback(caplog) -> None:
    loop = BackgroundLoop("test")
    loop.start()
    with socket.socket() as listener:
        for number in (errno.EMFILE, errno.ENFILE):
            error = OSError(number, os.strerror(number))
            context = {"message": "socket.accept() failed", "exception": error, "socket": listener}
            loop.asyncio.call_exception_handler(context)
        loop.asyncio.call_exception_handler({"message": "another error", "exception": OSError("other")})
    loop.stop()
    texts = [record.getMessage() for record in caplog.records]
    assert [text.partition(" (")[0] for text in texts] == [
        "refused new connections: Too many open files",
        "another error",
    ]
    assert caplog.records[0].exc_info is None


def test_a_blocked_loop_can_be_abandoned() -> None:
    loop = BackgroundLoop("test")
    loop.start()
    held, released = threading.Event(), threading.Event()

    def hold() -> None:
        held.set()
        released.wait(30)

    loop.call(hold)
    assert held.wait(30)
    loop.stop(0.01)
    assert not released.is_set()
    released.set()


def test_a_coroutine_that_cannot_begin_is_closed() -> None:
    loop = BackgroundLoop("test")
    loop.start()
    held, released = threading.Event(), threading.Event()
    begun: list[str] = []

    async def begin(name: str) -> None:
        begun.append(name)

    def hold() -> None:
        held.set()
        released.wait(30)

    loop.call(hold)
    assert held.wait(30)
    late, stopped = begin("late"), begin("stopped")
    with pytest.raises(TimeoutError):
        loop.run(late, 0.01)
    released.set()
    loop.stop()
    with pytest.raises(RuntimeError, match="closed"):
        loop.run(stopped)
    assert begun == []
    assert [inspect.getcoroutinestate(each) for each in (late, stopped)] == [inspect.CORO_CLOSED] * 2


def test_a_loop_stops_although_wait_for_drops_a_cancellation() -> None:
    """A node that shut down just when its watch of the master had connected ran for ever."""
    loop = BackgroundLoop("stopping")
    loop.start()
    turns = 0
    is_over = False

    async def watch(phase: int) -> None:
        nonlocal turns
        for _ in range(phase):
            await asyncio.sleep(0)
        while True:
            ready = asyncio.get_running_loop().create_future()
            if not is_over:
                asyncio.get_running_loop().call_soon(ready.set_result, None)
            await asyncio.wait_for(ready, 600)
            turns += 1

    async def begin() -> list[asyncio.Task[None]]:
        return [asyncio.create_task(watch(phase)) for phase in range(6)]

    def end() -> None:  # when some of the awaited futures are done, but the tasks do not know it yet
        nonlocal is_over
        is_over = True
        loop.asyncio.stop()

    watches = loop.run(begin(), 30)
    wait_until(lambda: turns > 100)
    loop.call(end)
    wait_until(lambda: "stopping" not in [thread.name for thread in threading.enumerate()])
    assert all(each.done() for each in watches)
    loop.stop()
