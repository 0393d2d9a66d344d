"""Processes that other code starts, and that a launch watches, restarts and stops."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Generic, Protocol, TypeVar

from pipros.launch.model import LaunchError


class Adopted(Protocol):
    """A process that other code has started or will start."""

    @property
    def name(self) -> str: ...

    @property
    def is_required(self) -> bool:
        """Whether the launch stops when the process exits."""
        ...

    @property
    def exit_code(self) -> int | None: ...

    def has_ended(self) -> bool:
        """Return True if the process has been started and has exited."""
        ...

    def restart_delay_s(self) -> float | None:
        """Return the time left until the exited process is restarted, or None if it will not be."""
        ...

    def describe_end(self) -> str: ...

    def start(self) -> object: ...

    def stop(self, errors: list[str]) -> None:
        """Stop the process. Problems are appended to `errors`."""
        ...


class Printer(Protocol):
    """Prints reports; implemented by `pipros.launch.console.Console`."""

    def say(self, text: str) -> None: ...
    def bold(self, text: str) -> None: ...
    def error(self, text: str) -> None: ...


_Process = TypeVar("_Process", bound=Adopted)


class AdoptedProcesses(Generic[_Process]):
    """A launch's adopted processes.

    One thread calls `check` and `end`; any thread may call the other methods.
    """

    def __init__(
        self, printer: Printer, on_end: Callable[[str, int | None], None], on_error: Callable[[], None]
    ) -> None:
        """Store the arguments. No process is watched before `add`.

        Args:
            on_end: called with the name and exit code of each process after its exit has been reported.
            on_error: called by `end`, inside its `except` block, if a process's `stop` raises an exception.
        """
        self._printer = printer
        self._on_end = on_end
        self._on_error = on_error
        self._processes: list[_Process] = []
        self._last: list[_Process] = []
        self._lock = threading.Lock()

    def __iter__(self) -> Iterator[_Process]:
        with self._lock:
            return iter(list(self._processes))

    def add(self, process: _Process, *, stop_last: bool = False) -> None:
        """Watch a process. Processes with `stop_last` are stopped after all others."""
        with self._lock:
            self._processes.append(process)
            if stop_last:
                self._last.append(process)

    def remove(self, process: _Process) -> None:
        """Stop watching a process. Raises ValueError if it is not watched."""
        with self._lock:
            self._processes.remove(process)

    def check(self) -> list[_Process] | None:
        """Report processes that have exited, and restart processes whose restart is due.

        Return the processes that are not restarted and therefore no longer watched, or None if a required
        process has exited. The exit of a process with a restart delay is reported after the delay.
        """
        gone = []
        for process in self:
            if not process.has_ended():
                continue
            delay_s = process.restart_delay_s()
            if delay_s is not None and delay_s > 0:
                continue
            self._report(process)
            if process.is_required:
                return None
            if delay_s is None:
                with suppress(ValueError):  # another thread has removed it
                    self.remove(process)
                gone.append(process)
            else:
                self._printer.say(f"[{process.name}] restarting process")
            with suppress(LaunchError):
                process.stop([])
                if delay_s is not None:
                    process.start()
        return gone

    def end(self) -> None:
        """Stop all processes, last added first; those with `stop_last` are stopped after all others."""
        errors: list[str] = []
        last = list(self._last)
        first = [process for process in self if process not in last]
        for process in [*reversed(first), *reversed(last)]:
            self._printer.say(f"[{process.name}] killing on exit")
            try:
                process.stop(errors)
            except Exception:  # the object comes from a script, so its methods can raise any exception
                self._on_error()
        with self._lock:
            self._processes.clear()
            self._last.clear()
        if errors:
            self._printer.error("Shutdown errors:\n" + "\n".join(f" * {error}" for error in errors))

    def _report(self, process: Adopted) -> None:
        text = process.describe_end()
        if process.is_required:
            rule = "=" * 80
            self._printer.error(
                f"{rule}REQUIRED process [{process.name}] has died!\n{text}\nInitiating shutdown!\n{rule}"
            )
        elif process.exit_code:
            self._printer.error(f"[{process.name}] {text}")
        else:
            self._printer.bold(f"[{process.name}] {text}")
        self._on_end(process.name, process.exit_code)
