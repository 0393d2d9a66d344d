"""Prints roslaunch's output on the terminal, in Noetic's format, and copies it to the log file.

Standard output and standard error are looked up for each line, so that rostest can capture them.
Every line is flushed, because the output is often read through a pipe.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import IO

from pipros.basics.log_file import LogFile
from pipros.basics.printable import write_line

_BOLD = "\033[1m"
_RED = "\033[31m"
_PLAIN = "\033[0m"


class Console:
    """Prints plain, bold and red lines, and sets the window title. Thread-safe.

    Colours are always printed, even if the output is not a terminal, as in Noetic.
    """

    def __init__(self, *, has_title: bool = True, is_verbose: bool = False) -> None:
        self._has_title = has_title
        self._is_verbose = is_verbose
        self._log: LogFile | None = None
        self._relay: Callable[[str, bool], None] | None = None
        self._lock = threading.Lock()

    def open_log(self, file: Path) -> None:
        """Copy all further output to this file, as far as it can be written."""
        self._log = LogFile(file)

    def relay_to(self, relay: Callable[[str, bool], None]) -> None:
        """Pass the lines of `say`, `bold` and `error` to `relay(text, is_error)` instead of printing them."""
        self._relay = relay

    def close(self) -> None:
        """Close the log file. May be called repeatedly."""
        with self._lock:
            log, self._log = self._log, None
            if log is not None:
                log.close()

    def say(self, text: str) -> None:
        self._emit(sys.stdout, text, text)

    def bold(self, text: str) -> None:
        self._emit(sys.stdout, f"{_BOLD}{text}{_PLAIN}", text)

    def detail(self, text: str) -> None:
        """Write a line to the log file, and print it if `-v` is given."""
        if self._is_verbose:
            self._print(sys.stdout, text)
        self.record(text)

    def error(self, text: str) -> None:
        """Print a line in red to standard error."""
        self._emit(sys.stderr, f"{_RED}{text}{_PLAIN}", text, is_error=True)

    def title(self, text: str) -> None:
        """Set the title of the terminal window, unless titles are disabled."""
        if self._has_title:
            self._print(sys.stdout, f"\033]2;{text}\007")

    def record(self, text: str, level: str = "INFO") -> bool:
        """Write a line only to the log file. Return False if there is a log file that cannot be written."""
        with self._lock:
            if self._log is None:
                return True
            now = time.time()
            stamp = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(now))
            return self._log.write(f"[roslaunch][{level}] {stamp},{int(now * 1000) % 1000:03d}: {text}\n")

    def _emit(self, stream: IO[str] | None, shown: str, text: str, *, is_error: bool = False) -> None:
        if self._relay is not None:
            self._relay(text, is_error)
        else:
            self._print(stream, shown)
        self.record(text, "ERROR" if is_error else "INFO")

    def _print(self, stream: IO[str] | None, text: str) -> None:
        if stream is None:  # the process has no console
            return
        with self._lock:
            try:
                write_line(stream, text)
            except (OSError, ValueError):
                # The reader of the output has exited. The nodes must still be stopped in order.
                return
