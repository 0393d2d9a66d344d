"""The processes of a launch and their monitor."""

from __future__ import annotations

import atexit
import itertools
import logging
import threading
import time
import traceback
from collections.abc import Sequence
from contextlib import suppress
from types import FrameType
from typing import Any, Protocol

from pipros.basics.interrupts import accept_ctrl_c
from pipros.basics.shared_names import share_names
from roslaunch.core import RLException, printerrlog, printlog, printlog_bold

__all__ = [
    "FatalProcessLaunch",
    "Process",
    "ProcessListener",
    "ProcessMonitor",
    "RLException",
    "logger",
    "pmon_shutdown",
    "printerrlog",
    "printlog",
    "printlog_bold",
    "rl_signal",
    "shutdown_process_monitor",
    "start_process_monitor",
]

logger = logging.getLogger("roslaunch.pmon")

_POLL_INTERVAL_S = 0.1
_SHUTDOWN_TIMEOUT_S = 20.0

_monitors: list[ProcessMonitor] = []


class _Shutdown:
    """State of the program's shutdown by a signal. Once it has begun, no monitors can be started."""

    has_begun = False


_shutdown = _Shutdown()
share_names(__name__, _shutdown, {"_shutting_down": "has_begun"})
_numbers = itertools.count(1)


class FatalProcessLaunch(RLException):
    """A process cannot be started, and retrying would not help."""


class ProcessListener:
    """Base class of listeners that are notified when processes exit."""

    def process_died(self, process_name: str, exit_code: int | None) -> None:
        """Handle the exit of a process. Called after the exit was printed, but not during a shutdown."""


class Process:
    """Base class of the processes in a `ProcessMonitor`."""

    def __init__(
        self,
        package: str,
        name: str,
        args: Sequence[str],
        env: Any,
        respawn: bool = False,
        respawn_delay: float = 0.0,
        required: bool = False,
    ) -> None:
        self.package = package
        self.name = name
        self.args = args
        self.env = env
        self.respawn = respawn
        self.respawn_delay = respawn_delay
        self.required = required

    @property
    def exit_code(self) -> int | None:
        return None

    @property
    def spawn_count(self) -> int:
        return 0

    def __str__(self) -> str:
        return f"Process<{self.name}>"

    __repr__ = __str__

    def get_info(self) -> dict[str, Any]:
        """Return information about the process."""
        info = {
            "spawn_count": self.spawn_count,
            "args": self.args,
            "env": self.env,
            "package": self.package,
            "name": self.name,
            "alive": self.is_alive(),
            "respawn": self.respawn,
            "respawn_delay": self.respawn_delay,
            "required": self.required,
        }
        return info if self.exit_code is None else {**info, "exit_code": self.exit_code}

    def is_alive(self) -> bool:
        """Return False. Subclasses return whether the process is running."""
        return False

    def stop(self, errors: list[str] | None = None) -> None:
        """Do nothing. Subclasses override this method to stop the process."""


class Watched(Protocol):
    """The nodes of a running launch.

    A protocol because its implementation, `roslaunch.nodeprocess.RunProcesses`, imports this module.
    """

    def watch_once(self, timeout_s: float | None = None) -> bool: ...

    def alive(self) -> Sequence[Process]: ...

    def ended(self) -> Sequence[Process]: ...

    def stop(self) -> None: ...


class ProcessMonitor(threading.Thread):
    """Thread that monitors the nodes of a launch; `pipros_tools.launch.run` starts and restarts the nodes.

    It reports exits, and ends all processes on `shutdown`.

    Attributes:
        listeners: notified of each process exit.
        done: whether all processes have ended and the thread has finished.
    """

    def __init__(self, name: str = "ProcessMonitor") -> None:
        super().__init__(name=name, daemon=True)
        self.is_shutdown = False
        self.done = False
        self.listeners: list[ProcessListener] = []
        self._run: Watched | None = None
        self._registrations_complete = False
        self._changed = threading.Event()

    @property
    def procs(self) -> list[Process]:
        """The processes that are running or may be restarted, automatically or by a user."""
        return list(self._run.alive()) if self._run is not None and not self.done else []

    def watch(self, run: Watched) -> None:
        """Monitor the nodes of a launch, and end them on shutdown."""
        self._run = run
        self._changed.set()

    def add_process_listener(self, l: ProcessListener) -> None:  # noqa: E741  # Noetic's name
        """Add a listener that is notified of each process exit."""
        self.listeners.append(l)

    def tell(self, process_name: str, exit_code: int | None) -> None:
        """Notify the listeners of a process exit."""
        for listener in list(self.listeners):
            try:
                listener.process_died(process_name, exit_code)
            except Exception:
                traceback.print_exc()

    def registrations_complete(self) -> None:
        """Allow the monitor to finish when no processes are left."""
        self._registrations_complete = True

    def has_process(self, name: str) -> bool:
        """Return whether a process with the given name is monitored."""
        return self.get_process(name) is not None

    def get_process(self, name: str) -> Process | None:
        """Return the monitored process with the given name, or None."""
        return next((process for process in self.procs if process.name == name), None)

    def kill_process(self, name: str) -> bool:
        """Stop the process with the given name. Return False if it does not exist.

        The process restarts if `respawn` is set.

        Raises:
            RLException: the name is not a string.
        """
        if not isinstance(name, str):
            raise RLException(f"kill_process takes in a process name but was given: {name}")
        printlog(f"[{name}] kill requested")
        process = self.get_process(name)
        if process is not None:
            process.stop([])
        return process is not None

    def shutdown(self) -> None:
        """Make the thread stop all processes and then end. Does not block; `join` waits for the end."""
        self.is_shutdown = True
        self._changed.set()

    def get_active_names(self) -> list[str]:
        """Return the names of the processes in `procs`."""
        return [process.name for process in self.procs]

    def get_process_names_with_spawn_count(self) -> list[list[tuple[str, int]]]:
        """Return lists of (name, start count) for the processes in `procs` and for the exited processes."""
        ended = self._run.ended() if self._run else ()
        return [[(process.name, process.spawn_count) for process in part] for part in (self.procs, ended)]

    def mainthread_spin_once(self) -> bool:
        """Return False if the monitor has finished."""
        return not self.done

    def mainthread_spin(self) -> None:
        """Block until the monitor has finished."""
        while not self.done:
            time.sleep(_POLL_INTERVAL_S)

    def run(self) -> None:
        """Monitor the processes. This is the thread's main function."""
        try:
            while not self.is_shutdown:
                self._poll()
        except Exception:
            traceback.print_exc()
        self.is_shutdown = True
        if self._run is not None:
            self._run.stop()
        self.done = True

    def _poll(self) -> None:
        if self._run is None:
            self._changed.wait(_POLL_INTERVAL_S)
            return
        if not self._run.watch_once():
            self.is_shutdown = True
        elif self._registrations_complete and self._run.ended() and not self.procs:
            printlog("all processes on machine have died, roslaunch will exit")
            self.is_shutdown = True


def start_process_monitor() -> ProcessMonitor | None:
    """Start a monitor and return it. `pmon_shutdown` ends the monitor. After `rl_signal`, return None."""
    if _shutdown.has_begun:
        return None
    monitor = ProcessMonitor(f"ProcessMonitor-{next(_numbers)}")
    _init_signal_handlers()
    if not _monitors:
        atexit.register(pmon_shutdown)
    _monitors.append(monitor)
    monitor.start()
    return monitor


def shutdown_process_monitor(process_monitor: ProcessMonitor | None) -> bool:
    """Stop a monitor and its processes. Return False if it was already stopped or takes longer than 20 s."""
    if process_monitor is None or process_monitor.is_shutdown:
        return False
    process_monitor.shutdown()
    process_monitor.join(_SHUTDOWN_TIMEOUT_S)
    return not process_monitor.is_alive()


def pmon_shutdown() -> None:
    """Stop all monitors started by `start_process_monitor`, and their processes."""
    for monitor in _monitors[:]:
        shutdown_process_monitor(monitor)
        with suppress(ValueError):
            _monitors.remove(monitor)


def rl_signal(sig: int, stackframe: FrameType | None) -> None:
    """Handle a signal by ending all monitors."""
    _ = sig, stackframe
    if not _shutdown.has_begun:
        _shutdown.has_begun = True
        pmon_shutdown()


def _init_signal_handlers() -> None:
    """Enable Ctrl-C, which shells disable in background jobs of scripts.

    Some scripts replace this function so that they can launch from other threads. pipros does not need this.
    """
    accept_ctrl_c()
