"""What roslaunch says on the terminal, in Noetic's forms, and the same lines in its log file.

Standard output and standard error are looked up when a line is printed, so that rostest can catch them.
Every line is flushed: what starts a robot is often read through a pipe.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import IO

_BOLD = "\033[1m"
_RED = "\033[31m"
_PLAIN = "\033[0m"


class Console:
    """Prints lines, in bold, in red, and the window's title. May be used from any thread.

    Colours are printed always, as Noetic does, whether or not a terminal is there.
    """

    def __init__(self, *, has_title: bool = True, is_verbose: bool = False) -> None:
        self._has_title = has_title
        self._is_verbose = is_verbose
        self._log: IO[str] | None = None
        self._relay: Callable[[str, bool], None] | None = None
        self._lock = threading.Lock()

    def open_log(self, file: Path) -> None:
        """Writes all that follows to this file, too.

        Raises:
            OSError: the file cannot be made.
        """
        self._log = file.open("a", encoding="utf-8", errors="replace")

    def relay_to(self, tell: Callable[[str, bool], None]) -> None:
        """From now on prints nothing, but gives each text, and whether it is an error, to somebody else."""
        self._relay = tell

    @property
    def has_log(self) -> bool:
        return self._log is not None

    def close(self) -> None:
        """Ends the log file. Harmless when repeated."""
        with self._lock:
            log, self._log = self._log, None
            if log is not None:
                log.close()

    def say(self, text: str) -> None:
        self._tell(sys.stdout, text, text)

    def bold(self, text: str) -> None:
        self._tell(sys.stdout, f"{_BOLD}{text}{_PLAIN}", text)

    def detail(self, text: str) -> None:
        """A line for `-v` and for the log file."""
        if self._is_verbose:
            self._print(sys.stdout, text)
        self.record(text)

    def error(self, text: str) -> None:
        """A line in red on standard error."""
        self._tell(sys.stderr, f"{_RED}{text}{_PLAIN}", text, is_error=True)

    def title(self, text: str) -> None:
        """The title of the terminal's window; nothing where a title was not wanted."""
        if self._has_title:
            self._print(sys.stdout, f"\033]2;{text}\007")

    def record(self, text: str, level: str = "INFO") -> None:
        """A line for the log file only."""
        with self._lock:
            if self._log is not None:
                now = time.time()
                stamp = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(now))
                self._log.write(f"[roslaunch][{level}] {stamp},{int(now * 1000) % 1000:03d}: {text}\n")
                self._log.flush()

    def _tell(self, stream: IO[str], shown: str, text: str, *, is_error: bool = False) -> None:
        if self._relay is not None:
            self._relay(text, is_error)
        else:
            self._print(stream, shown)
        self.record(text, "ERROR" if is_error else "INFO")

    def _print(self, stream: IO[str], text: str) -> None:
        with self._lock:
            try:
                stream.write(text + "\n")
                stream.flush()
            except (OSError, ValueError):
                # Whoever read our output is gone. The nodes still want to be ended in order.
                return
