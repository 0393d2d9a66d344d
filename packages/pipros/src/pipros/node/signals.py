"""Shut a node down on Ctrl-C and the other signals that end programs, whatever the main thread is doing."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from types import FrameType
from typing import Any, Protocol
from weakref import WeakSet

from pipros.basics import one_thread
from pipros.basics.errors import PiprosError
from pipros.basics.interruptible_wait import OnceEvent
from pipros.basics.interrupts import ENDING_SIGNALS, interrupt_main_thread
from pipros.basics.posix import call_in_children_before, require_sockets
from pipros.node.node import Node

_FROM_HANDLER = 0x80
"""A bit that the handler sets in the byte that it writes, in addition to the signal number."""

_BOTH_REPORT_WITHIN_S = 1.0
"""If the handler and the interpreter both report a signal, they do so within this time."""

_SENT_TWICE_WITHIN_S = 0.2
"""A signal repeated within this time counts once, because the program `timeout` sends each signal to
its child twice.
"""

HANG_UP: int | None = getattr(signal, "SIGHUP", None)
"""The signal for a closed terminal, which Windows lacks."""

FATAL = tuple(
    found
    for name in ("SIGHUP", "SIGQUIT", "SIGUSR1", "SIGUSR2", "SIGALRM", "SIGXCPU")
    if isinstance(found := getattr(signal, name, None), int)
)
"""Signals that kill a program without a handler, so that a robot that it drives would drive on."""

SUSPEND: int | None = getattr(signal, "SIGTSTP", None)
"""The signal for Ctrl-Z, which Windows lacks."""

_HANG_UP_S = 0.3
"""How long the main thread may take to end the process by SIGHUP."""

_INSIST_AFTER_S = 0.1
"""How long the main thread may continue after the node has ended, and the interval at which it is then
interrupted.
"""


_PREVIOUS_WAITS_S = 0.4
"""How long a handler from before the node waits for the node's end: as in genuine rospy, it comes after the
hooks. It does not wait longer, because the main thread may hold a lock that the shutdown needs.
"""


_before_suspension: WeakSet[Any] = WeakSet()


class Suspendable(Protocol):
    """A part of a program that must not go on in others while the program is suspended."""

    def suspended(self) -> AbstractContextManager[object]:
        """Come to rest before the block, in which the program is suspended."""


def rest_while_suspended(part: Suspendable) -> None:
    """Let a part come to rest before Ctrl-Z suspends the process, as long as it is referenced."""
    _before_suspension.add(part)


class NotInMainThread(PiprosError, RuntimeError):
    """Signals can only be handled in the main thread."""


class Signals:
    """Handles SIGINT, SIGTERM and SIGHUP, unless SIGHUP is ignored; one per process.

    It also handles Ctrl-Z and, in programs of pipros, the other signals in `FATAL`; a program of a user may
    leave these to `faulthandler`, for example.

    Theory of operation. Python calls handlers only when the main thread runs Python code, so a signal that
    arrives just before the main thread starts to wait would be lost. However, the interpreter immediately
    writes each signal's number to a descriptor, which the node's event loop reads. Other code may replace
    that descriptor for a while (asyncio, matplotlib), or call our handler from its own. Therefore, the
    handler writes to the same descriptor, and a signal that is reported both ways counts once. If our handler
    has been replaced, the new handler alone decides what a signal does.

    The handler raises nothing while the node runs: an exception between any two bytecode instructions of the
    main thread could leave a lock held that the shutdown needs. Once the node has ended, the handler raises
    KeyboardInterrupt, so that another Ctrl-C ends a main thread that is still running.

    A forked child does not run the node, so it gets the process's previous handlers.
    """

    def __init__(
        self, end: Callable[[str], object], *, insist: bool = False, dies_of_hang_up: bool = False
    ) -> None:
        """Store the settings. On the first signal, `end` is called with the reason, in a separate thread.

        If `insist` is true, the main thread is interrupted unless it calls `uninstall` soon afterwards. This
        also applies to a shutdown begun by another thread, for example by `rosnode kill`.

        If `dies_of_hang_up` is true, SIGHUP ends the process once the node has ended, as without a handler.
        """
        self._end = end
        self._insist = insist
        self._dies_of_hang_up = dies_of_hang_up
        self._previous_handlers: dict[int, Any] = {}
        self._previous_descriptor = -1
        self._ending: threading.Thread | None = None
        self._ending_since = 0.0
        self._has_ended = self._is_hung_up = False
        self._is_unreported = False  # whether a signal waits for a turn; false where Python has threads
        self._is_uninstalled = OnceEvent()
        self._by_interpreter: set[int] = set()  # signals that the handler has not reported yet
        self._by_handler: dict[
            int, float
        ] = {}  # signals that the interpreter has not reported yet, with their times
        self._sockets: tuple[socket.socket, socket.socket]
        self._node: Node

    @property
    def have_come(self) -> bool:
        """Whether a signal (or, if `insist` is true, another thread) has begun the shutdown."""
        return self._ending is not None

    def install(self) -> None:
        """Install the handlers. Signals are kept until `listen` is called.

        Raises:
            NotInMainThread: called from another thread.
            NeedsSockets: Python runs in a browser.
        """
        require_sockets()
        if threading.current_thread() is not threading.main_thread():
            raise NotInMainThread("signals can only be handled in the main thread")
        reader, writer = socket.socketpair()
        reader.setblocking(False)
        writer.setblocking(False)
        self._sockets = reader, writer
        for number in ENDING_SIGNALS:
            self._previous_handlers[number] = signal.signal(number, self._handle)
        for each in (SUSPEND, *((HANG_UP,) if self._dies_of_hang_up else FATAL)):
            if each is not None and signal.getsignal(each) is signal.SIG_DFL:  # nohup ignores SIGHUP
                self._previous_handlers[each] = signal.signal(each, self._handle)
        self._previous_descriptor = signal.set_wakeup_fd(writer.fileno(), warn_on_full_buffer=False)
        # A signal to a child that still has the descriptor would be reported here, and end this node.
        call_in_children_before(self._uninstall_in_child, tuple(self._previous_handlers))

    def listen(self, node: Node) -> None:
        """Make signals shut down the node, including those received since `install`.

        The node's event loop reads the signals.
        """
        self._node = node
        node.add_reader(self._sockets[0], self._read)
        if self._insist:
            node.on_shutdown(self._insist_on_end)

    def listen_anew(self, node: Node) -> None:
        """Make subsequent signals shut down `node`, which replaces a node that has ended.

        Signals that have arrived since the previous node ended are lost.
        """
        if self._ending is not None and self._ending is not threading.current_thread():
            self._ending.join()
        with contextlib.suppress(BlockingIOError):
            while True:
                self._sockets[0].recv(64)
        self._ending, self._has_ended = None, False
        self._by_interpreter.clear()
        self._by_handler.clear()
        self.listen(node)

    def uninstall(self) -> None:
        """Restore the previous handlers. Call it in the main thread, once the node has ended."""
        try:
            self._is_uninstalled.set()
            if self._ending is not None and self._ending is not threading.current_thread():
                self._ending.join()
        finally:
            self._restore()
        for sock in self._sockets:
            sock.close()

    def _handle(self, number: int, frame: FrameType | None) -> None:
        """Report a signal. Called by Python in the main thread, or by a handler that replaced this one."""
        if self._has_ended:
            if self._is_hung_up and HANG_UP is not None:
                signal.signal(HANG_UP, signal.SIG_DFL)
                signal.raise_signal(HANG_UP)
            if number not in self._by_interpreter:
                raise KeyboardInterrupt
            self._by_interpreter.remove(number)  # the signal that ended the node
            return
        if self._is_unreported:
            raise KeyboardInterrupt  # without threads: the program has not waited since the last signal
        self._is_unreported = not one_thread.has_threads()
        one_thread.later(self._report, number)
        previous = self._previous_handlers[number]
        if callable(previous) and previous is not signal.default_int_handler:
            deadline_s = time.monotonic() + _PREVIOUS_WAITS_S
            while one_thread.has_threads() and not self._has_ended and time.monotonic() < deadline_s:
                time.sleep(0.001)
            with contextlib.suppress(KeyboardInterrupt):
                previous(number, frame)

    def _report(self, number: int) -> None:
        """Write a signal for `_read`."""
        self._is_unreported = False
        with contextlib.suppress(OSError):  # the buffer is full of signals, so another signal has no effect
            self._sockets[1].send(bytes((number | _FROM_HANDLER,)))

    def _read(self) -> None:
        """Handle the signals reported so far. Runs in the event loop."""
        for report in self._sockets[0].recv(64):
            number = report & ~_FROM_HANDLER
            if number not in self._previous_handlers:
                continue
            if report & _FROM_HANDLER:
                if number in self._by_interpreter:
                    self._by_interpreter.remove(number)
                    continue
                self._by_handler[number] = time.monotonic()
            else:
                if signal.getsignal(number) != self._handle:
                    continue
                if time.monotonic() - self._by_handler.pop(number, float("-inf")) < _BOTH_REPORT_WITHIN_S:
                    continue
                self._by_interpreter.add(number)
            if number == SUSPEND:
                one_thread.start_thread(_suspend, name="Ctrl-Z")
            else:
                self._end_by(number)

    def _end_by(self, number: int) -> None:
        """Shut the node down in a separate thread.

        A second signal ends the process, unless it follows immediately.

        The main thread may be in the middle of a publish, for example, and hold a lock that the shutdown
        needs, so the shutdown does not run in the main thread.
        """
        if self._ending is None:
            self._start_end(f"signal-{number}")
        elif time.monotonic() - self._ending_since > _SENT_TWICE_WITHIN_S:
            os._exit(128 + number)

    def _insist_on_end(self) -> None:
        """Interrupt the main thread if neither it nor a signal began the shutdown.

        Called as a shutdown hook.
        """
        if self._ending is None and threading.current_thread() is not threading.main_thread():
            self._start_end("the node ends")

    def _start_end(self, reason: str) -> None:
        self._ending_since = time.monotonic()
        if not one_thread.has_threads():
            self._ending = threading.current_thread()
            self._node.end_soon(self._run_end, reason)
            return
        self._ending = threading.Thread(
            target=self._run_end, args=(reason,), name="end of the node", daemon=True
        )
        self._ending.start()

    def _run_end(self, reason: str) -> None:
        if self._ending is None:  # without threads: another node has taken the place of this one
            return
        self._end(reason)
        self._is_hung_up = self._dies_of_hang_up and reason == f"signal-{HANG_UP}"
        self._has_ended = True
        if sys.platform != "win32" and self._is_hung_up and HANG_UP is not None:
            signal.pthread_kill(threading.main_thread().ident or 0, HANG_UP)
            self._is_uninstalled.wait(_HANG_UP_S)  # the main thread is busy in an extension module
            os._exit(128 + HANG_UP)
        while self._insist and not self._is_uninstalled.wait(_INSIST_AFTER_S):
            interrupt_main_thread()

    def _restore(self) -> None:
        signal.set_wakeup_fd(self._previous_descriptor)
        for number, previous in self._previous_handlers.items():
            if signal.getsignal(number) == self._handle:
                signal.signal(number, signal.SIG_DFL if previous is None else previous)

    def _uninstall_in_child(self) -> None:
        if not self._is_uninstalled.is_set():
            self._restore()


def _suspend() -> None:
    """Suspend the process as Ctrl-Z does, once all that must rest has come to rest."""
    with contextlib.ExitStack() as resting:
        for part in list(_before_suspension):
            resting.enter_context(part.suspended())
        os.kill(os.getpid(), signal.Signals["SIGSTOP"])  # Windows, where nothing sends SUSPEND, lacks it


@contextlib.contextmanager
def ended_by_signals(node: Node, *, insist: bool = True) -> Iterator[None]:
    """Run a node for the duration of the block. SIGINT, SIGTERM and those in `FATAL` shut it down.

    A signal raises nothing in the block unless the block continues after the shutdown. The shutdown ends all
    of the node's waits. If a signal ended the block, any exception that the block raises becomes
    KeyboardInterrupt. Outside the main thread, signal handlers are left unchanged.

    Args:
        insist: whether to interrupt a block that continues after the shutdown. If false, only a second signal
            interrupts the block, so that the block can, for example, finish writing a file.
    """
    if threading.current_thread() is not threading.main_thread():
        with node:
            yield
        return
    signals = Signals(node.shutdown, insist=insist)
    signals.install()
    try:
        with node:
            signals.listen(node)
            yield
    except Exception:
        if signals.have_come:
            raise KeyboardInterrupt from None
        raise
    finally:
        signals.uninstall()
