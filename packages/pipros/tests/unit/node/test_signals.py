import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from pipros.node.signals import NotInMainThread, Signals
from tests.support.waiting import wait_until

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGUSR1"), reason="signals of POSIX")


class Reader:
    """The part of a node's event loop that signals need; it reads when the test calls `turn`."""

    def __init__(self) -> None:
        self._read: Callable[[], object]
        self._sock: socket.socket

    def add_reader(self, sock: socket.socket, on_readable: Callable[[], object]) -> None:
        self._sock, self._read = sock, on_readable

    def on_shutdown(self, hook: Callable[[], object]) -> None:
        self.shutdown_hook = hook

    def turn(self) -> None:
        """Call the reader if bytes have arrived."""
        try:
            self._sock.recv(1, socket.MSG_PEEK)
        except BlockingIOError:
            return
        self._read()


class Ends:
    """Record the shutdowns of a node with their reasons."""

    def __init__(self) -> None:
        self.reasons: list[str] = []
        self.came = threading.Event()

    def __call__(self, reason: str) -> None:
        self.reasons.append(reason)
        self.came.set()

    def wait(self) -> list[str]:
        assert self.came.wait(30)
        return self.reasons


@pytest.fixture(autouse=True)
def handlers() -> Iterator[list[Any]]:
    """The handlers before the test, which must be restored after it."""
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.getsignal(number) for number in numbers]
    yield before
    assert [signal.getsignal(number) for number in numbers] == before
    assert signal.set_wakeup_fd(-1) == -1


def listening(**options: Any) -> tuple[Signals, Ends, Reader]:
    ends, reader = Ends(), Reader()
    signals = Signals(ends, **options)
    signals.install()
    signals.listen(reader)  # type: ignore[arg-type]
    return signals, ends, reader


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_node_once_and_raises_nothing(number: signal.Signals) -> None:
    signals, ends, reader = listening()
    assert not signals.have_come
    signal.raise_signal(number)
    reader.turn()
    assert ends.wait() == [f"signal-{int(number)}"]
    assert signals.have_come
    signals.uninstall()


def test_a_signal_before_the_node_listens_is_kept() -> None:
    ends, reader = Ends(), Reader()
    signals = Signals(ends)
    signals.install()
    signal.raise_signal(signal.SIGINT)
    signals.listen(reader)  # type: ignore[arg-type]
    assert ends.reasons == []
    reader.turn()
    assert ends.wait() == ["signal-2"]
    signals.uninstall()


@pytest.mark.parametrize(("within_s", "codes"), [(60.0, []), (0.0, [128 + signal.SIGINT])])
def test_a_second_signal_ends_the_process_unless_it_follows_at_once(
    monkeypatch: pytest.MonkeyPatch, within_s: float, codes: list[int]
) -> None:
    """`timeout` sends its signal twice."""
    exits: list[int] = []
    monkeypatch.setattr("pipros.node.signals._SENT_TWICE_WITHIN_S", within_s)
    monkeypatch.setattr("os._exit", exits.append)
    ends, reader, may_end = Ends(), Reader(), threading.Event()
    signals = Signals(lambda reason: (ends(reason), may_end.wait(30)))
    signals.install()
    signals.listen(reader)  # type: ignore[arg-type]
    for _ in range(2):
        signal.raise_signal(signal.SIGINT)
        reader.turn()
    may_end.set()
    signals.uninstall()
    assert ends.wait() == ["signal-2"]
    assert exits[:1] == codes


def test_after_the_end_a_signal_raises_keyboard_interrupt() -> None:
    signals, ends, reader = listening()
    signal.raise_signal(signal.SIGTERM)
    reader.turn()
    ends.wait()
    with pytest.raises(KeyboardInterrupt):
        wait_until(lambda: signal.raise_signal(signal.SIGINT), 30, "the end to be over")
    signals.uninstall()


def stay() -> None:
    """Pause in steps without a lock: KeyboardInterrupt can leave a waiting Condition unlocked."""
    for _ in range(600):
        time.sleep(0.05)


def test_a_running_main_thread_is_interrupted_if_requested() -> None:
    signals, _, reader = listening(insist=True)
    signal.raise_signal(signal.SIGINT)

    def go_on() -> None:
        try:
            reader.turn()
            stay()
        finally:
            signals.uninstall()

    with pytest.raises(KeyboardInterrupt):
        go_on()


def test_a_running_main_thread_is_interrupted_after_a_shutdown_by_another_thread() -> None:
    signals, _, reader = listening(insist=True)
    reader.shutdown_hook()
    assert not signals.have_come

    def go_on() -> None:
        threading.Thread(target=reader.shutdown_hook).start()
        try:
            stay()
        finally:
            signals.uninstall()

    with pytest.raises(KeyboardInterrupt):
        go_on()


def test_a_signal_handler_that_replaces_the_nodes_is_called() -> None:
    signals, _, reader = listening()
    came: list[int] = []
    ours = signal.signal(signal.SIGINT, lambda number, _: came.append(number))
    signal.raise_signal(signal.SIGINT)
    reader.turn()
    assert (came, signals.have_come) == ([signal.SIGINT], False)
    signal.signal(signal.SIGINT, ours)
    signals.uninstall()


def test_another_thread_cannot_install_signals() -> None:
    raised: list[BaseException] = []

    def take() -> None:
        try:
            Signals(lambda _: None).install()
        except NotInMainThread as error:
            raised.append(error)

    thread = threading.Thread(target=take)
    thread.start()
    thread.join(30)
    assert "main thread" in str(raised[0])
