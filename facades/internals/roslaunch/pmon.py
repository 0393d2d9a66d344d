"""A launch's processes and their monitor."""

from __future__ import annotations

import atexit
import itertools
import logging
import threading
import time
import traceback
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from types import FrameType
from typing import Any, Protocol

from pipros.basics.interrupts import accept_ctrl_c
from pipros.basics.lazy_names import star_names as _star_names
from pipros.basics.shared_names import share_names
from pipros.launch.adopted import AdoptedProcesses
from roslaunch.core import RLException, printerrlog, printlog, printlog_bold

__all__ = [
    "DeadProcess",
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

_star_names(
    __name__,
    "atexit queue:Empty threading:Lock logging os queue:Queue threading:RLock roslib signal sys "
    "threading:Thread time traceback",
)

logger = logging.getLogger("roslaunch.pmon")

_POLL_INTERVAL_S = 0.1
_SHUTDOWN_TIMEOUT_S = 20.0

_monitors: list[ProcessMonitor] = []


class _Shutdown:
    """Whether a signal has started the program's shutdown. If so, monitors can no longer be started."""

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
    """Base class of processes in a `ProcessMonitor`. Subclasses implement starting and stopping."""

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
        self.lock = threading.Lock()
        self.exit_code: int | None = None
        self.spawn_count = 0
        self.time_of_death: float | None = None

    def __str__(self) -> str:
        return f"Process<{self.name}>"

    __repr__ = __str__

    def get_info(self) -> dict[str, Any]:
        """Return information about the process, for the XML-RPC server."""
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

    def start(self) -> Any:
        """Prepare the start. Subclasses call this, then start the process."""
        self.time_of_death = None
        self.spawn_count += 1

    def is_alive(self) -> bool:
        """Record the time at which the process was first found not running, and return False.

        Subclasses return True if the process is running, and otherwise call this method.
        """
        if self.time_of_death is None:
            self.time_of_death = time.time()
        return False

    def should_respawn(self) -> bool | float:
        """Return the delay in seconds before the process should be restarted, or False for no restart."""
        if not self.respawn or (self.time_of_death is None and self.is_alive()):
            return False
        return (self.time_of_death or 0.0) + self.respawn_delay - time.time()

    def stop(self, errors: list[str] | None = None) -> None:
        """Stop the process. Problems are appended to `errors`."""

    def get_exit_description(self) -> str:
        """Return a description of how the process ended."""
        if self.exit_code is None:
            return "process has died"
        return f"process has died [exit code {self.exit_code}]" if self.exit_code else _CLEANLY


_CLEANLY = "process has finished cleanly"


class DeadProcess(Process):
    """Record of a process that has exited."""

    def __init__(self, p: Process) -> None:
        super().__init__(p.package, p.name, p.args, p.env, p.respawn, p.respawn_delay)
        self.exit_code = p.exit_code
        self.spawn_count = p.spawn_count
        self.info = p.get_info()

    def get_info(self) -> dict[str, Any]:
        return self.info

    def start(self) -> None:
        raise RuntimeError("cannot call start on a dead process!")

    def is_alive(self) -> bool:
        return False


class Watched(Protocol):
    """The nodes of a running launch; see `roslaunch.nodeprocess.RunProcesses`."""

    def watch_once(self, timeout_s: float | None = None) -> bool: ...

    def alive(self) -> Sequence[Process]: ...

    def ended(self) -> Sequence[Process]: ...

    def stop(self) -> None: ...


@dataclass(frozen=True, slots=True)
class _Adopted:
    """Adapter for a registered process, with the interface that a launch requires."""

    process: Process

    @property
    def name(self) -> str:
        return self.process.name

    @property
    def is_required(self) -> bool:
        return self.process.required

    @property
    def exit_code(self) -> int | None:
        return self.process.exit_code

    def has_ended(self) -> bool:
        return bool(self.process.spawn_count) and not self.process.is_alive()

    def restart_delay_s(self) -> float | None:
        delay_s = self.process.should_respawn()
        return None if delay_s is False else float(delay_s)

    def describe_end(self) -> str:
        return self.process.get_exit_description()

    def start(self) -> object:
        return self.process.start()

    def stop(self, errors: list[str]) -> None:
        self.process.stop(errors)


class _Printer:
    """Print functions, which scripts can redirect with `roslaunch.core.add_printlog_handler` or replace."""

    def say(self, text: str) -> None:
        printlog(text)

    def bold(self, text: str) -> None:
        printlog_bold(text)

    def error(self, text: str) -> None:
        printerrlog(text)


class ProcessMonitor(threading.Thread):
    """Thread that monitors processes.

    It reports exits, restarts processes, and ends all processes on `shutdown`. It monitors the nodes of one
    launch, started by `pipros.launch.run`, and processes registered by scripts.

    Attributes:
        listeners: notified of each process exit.
        done: whether all processes have ended and the thread has finished.
        dead_list: records of registered processes that have exited.
    """

    def __init__(self, name: str = "ProcessMonitor") -> None:
        super().__init__(name=name, daemon=True)
        self.plock = threading.RLock()
        self.is_shutdown = False
        self.done = False
        self.listeners: list[ProcessListener] = []
        self.dead_list: list[Process] = []
        self.core_procs: list[Process] = []
        self.reacquire_signals: set[int] = set()
        self._adopted = AdoptedProcesses[_Adopted](_Printer(), self.tell, traceback.print_exc)
        self._run: Watched | None = None
        self._registrations_complete = False
        self._had_processes = False
        self._changed = threading.Event()

    @property
    def procs(self) -> list[Process]:
        """The running processes."""
        if self.done:
            return []
        with self.plock:
            return [
                *(self._run.alive() if self._run else ()),
                *(adopted.process for adopted in self._adopted),
            ]

    def watch(self, run: Watched) -> None:
        """Also monitor the nodes of a launch, and end them on shutdown."""
        with self.plock:
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

    def register(self, p: Process) -> None:
        """Add a process that the caller has started or will start.

        Raises:
            RLException: a process with the same name is registered, or the monitor was shut down.
        """
        self._register(p, is_core=False)

    def register_core_proc(self, p: Process) -> None:
        """Register a process that is ended after all others. Raises the same errors as `register`."""
        self._register(p, is_core=True)
        self.core_procs.append(p)

    def _register(self, p: Process, *, is_core: bool) -> None:
        with self.plock:
            if self.has_process(p.name):
                raise RLException(f"cannot add process with duplicate name '{p.name}'")
            if self.is_shutdown:
                raise RLException(f"cannot add process [{p.name}] after process monitor has been shut down")
            self._adopted.add(_Adopted(p), stop_last=is_core)
        self._changed.set()

    def registrations_complete(self) -> None:
        """Allow the monitor to finish when no processes are left."""
        self._registrations_complete = True

    def unregister(self, p: Process) -> None:
        """Remove a registered process. Raises ValueError if it is not registered."""
        with self.plock:
            self._adopted.remove(_Adopted(p))

    def has_process(self, name: str) -> bool:
        """Return whether a process with the given name is monitored."""
        return self.get_process(name) is not None

    def get_process(self, name: str) -> Process | None:
        """Return the monitored process with the given name, or None."""
        return next((process for process in self.procs if process.name == name), None)

    def has_main_thread_jobs(self) -> int:
        """Return the size of `reacquire_signals`, which is empty: pipros has no jobs for the main thread."""
        return len(self.reacquire_signals)

    def do_main_thread_jobs(self) -> None:
        """Do nothing, for compatibility. pipros has no jobs for the main thread."""

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
        """Return the names of the running processes."""
        return [process.name for process in self.procs]

    def get_process_names_with_spawn_count(self) -> list[list[tuple[str, int]]]:
        """Return lists of (name, start count) for the running processes and for the exited processes."""
        ended = [*(self._run.ended() if self._run else ()), *self.dead_list]
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
        self._adopted.end()
        self.core_procs.clear()
        self.done = True

    def _poll(self) -> None:
        self._watch_run()
        gone = self._adopted.check()
        self.is_shutdown = self.is_shutdown or gone is None
        self.dead_list += [DeadProcess(adopted.process) for adopted in gone or ()]
        if not self.is_shutdown and self._all_have_died():
            printlog("all processes on machine have died, roslaunch will exit")
            self.is_shutdown = True

    def _watch_run(self) -> None:
        run, has_adopted = self._run, any(self._adopted)
        if run is None or has_adopted:
            self._changed.wait(_POLL_INTERVAL_S)
            self._changed.clear()
        if run is not None and not run.watch_once(_POLL_INTERVAL_S if has_adopted else None):
            self.is_shutdown = True

    def _all_have_died(self) -> bool:
        is_empty = not self.procs
        self._had_processes = self._had_processes or not is_empty or bool(self._run and self._run.ended())
        return self._registrations_complete and self._had_processes and is_empty


def start_process_monitor() -> ProcessMonitor | None:
    """Start a monitor that ends with `pmon_shutdown` or with the program. After `rl_signal`, return None."""
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
    """Stop a monitor and its processes. Return False if it had already finished or takes longer than 20 s."""
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
    """Enable Ctrl-C in background jobs of shell scripts as well.

    Some scripts replace this function in order to launch from other threads, which is not necessary here.
    """
    accept_ctrl_c()
