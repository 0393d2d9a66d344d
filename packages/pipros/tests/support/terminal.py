"""A terminal with an interactive shell: typed lines, a prompt, Ctrl-C and colours."""

import codecs
import contextlib
import os
import re
import signal
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

from tests.support.started import STARTED

if sys.platform != "win32":
    import fcntl
    import termios

T = TypeVar("T")

# The prompt contains the exit code of the last command, so one match detects the end and the exit code.
_PROMPT = re.compile(r"\[(\d+)\]> $")
_PROMPT_SETTINGS = {"bash": "[$?]> ", "zsh": "[%?]> "}
_ROWS, _COLUMNS = 50, 200
_ESCAPES = re.compile(r"\x1b(\[[0-9;?]*[ -/]*[@-~]|\][^\a]*\a|[=>])")
_TAKE_TERMINAL_AND_BECOME_SHELL = """
import fcntl, os, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
os.execvp(sys.argv[1], sys.argv[1:])
"""
BASH = ("bash", "--norc", "--noprofile", "--noediting", "-i")
"""Bash without line editing, so that the echo of a line equals the line."""
EDITING_SHELLS = {
    "bash": ("bash", "--norc", "--noprofile", "-i"),
    "zsh": ("zsh", "-f", "-i"),
    "fish": ("fish", "--no-config", "-i", "-C", 'function fish_prompt; echo "[$status]> "; end'),
}
"""Shells in which TAB completes; for `press`."""


class Terminal:
    """An interactive shell on a pseudo-terminal, into which lines are typed one at a time."""

    def __init__(self, environment: Mapping[str, str], cwd: Path, shell: Sequence[str] = BASH) -> None:
        self._keyboard, tty = os.openpty()
        fcntl.ioctl(tty, termios.TIOCSWINSZ, struct.pack("HHHH", _ROWS, _COLUMNS, 0, 0))
        settings = {"PS1": _PROMPT_SETTINGS.get(shell[0], ""), "BASH_SILENCE_DEPRECATION_WARNING": "1"}
        self._shell = subprocess.Popen(
            [sys.executable, "-S", "-c", _TAKE_TERMINAL_AND_BECOME_SHELL, *shell],
            env={**environment, **settings}, cwd=cwd, stdin=tty, stdout=tty, stderr=tty,
            start_new_session=True,
        )  # fmt: skip
        os.close(tty)
        self._screen = ""
        self._changed = threading.Condition()
        self._typed_at = 0
        self._is_closed = False
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        STARTED.add(self)
        self.wait_for_prompt()

    def _read(self) -> None:
        # If its last program has ended, reading from a pseudo-terminal raises OSError instead of returning
        # b"".
        decode = codecs.getincrementaldecoder("utf-8")("replace").decode
        with contextlib.suppress(OSError):
            while chunk := os.read(self._keyboard, 65536):
                with self._changed:
                    self._screen += decode(chunk).replace("\r", "")
                    self._changed.notify_all()

    @property
    def is_running(self) -> bool:
        return self._shell.poll() is None

    @property
    def transcript(self) -> list[str]:
        """The screen so far, without escape sequences."""
        return _ESCAPES.sub("", self._screen).splitlines()

    @property
    def output(self) -> str:
        """The output since the last typed line, including escape sequences."""
        return self._screen[self._typed_at :]

    @property
    def text(self) -> str:
        """The output since the last typed line, without escape sequences."""
        return _ESCAPES.sub("", self.output)

    def press(self, keys: str) -> None:
        """Press keys after the prompt has appeared. `\t` is TAB, and `\n` Enter."""
        self.wait_for_prompt()
        self._typed_at = len(self._screen)
        os.write(self._keyboard, keys.encode())

    def press_in_program(self, keys: str) -> None:
        """Press keys in the running program, without Enter."""
        self._typed_at = len(self._screen)
        os.write(self._keyboard, keys.encode())

    def answer(self, line: str) -> None:
        """Type a line and Enter in the running program."""
        self._typed_at = len(self._screen)
        os.write(self._keyboard, line.encode() + b"\n")

    def type(self, line: str) -> None:
        """Type a line and Enter after the prompt has appeared, and wait for the echo."""
        self.wait_for_prompt()
        self._typed_at = len(self._screen)
        os.write(self._keyboard, line.encode() + b"\n")
        self._wait(lambda: self.output.startswith(line + "\n"), 30.0, f"the echo of {line!r}")
        self._typed_at += len(line) + 1

    def run(self, line: str, timeout_s: float = 60.0) -> tuple[int, str]:
        """Type a command and wait for its end; return the exit code and the output."""
        self.type(line)
        code = self.wait_for_prompt(timeout_s)
        return code, _PROMPT.sub("", self.output)

    def wait_for(self, pattern: str, timeout_s: float = 60.0) -> re.Match[str]:
        """Wait until the regular expression is found in the output of the last command. Return the match."""
        looked_for = re.compile(pattern)
        return self._wait(lambda: looked_for.search(self.output), timeout_s, f"/{pattern}/")

    def wait_for_prompt(self, timeout_s: float = 60.0) -> int:
        """Wait until the command has ended, and return its exit code."""
        found = self._wait(lambda: _PROMPT.search(self.text), timeout_s, "the prompt")
        return int(found[1])

    def press_ctrl_c(self) -> None:
        """Type Ctrl-C; the terminal sends SIGINT to the command in the foreground."""
        os.write(self._keyboard, b"\x03")

    def hang_up(self) -> None:
        """Let the shell pass SIGHUP on to its programs, as if the window or the connection was closed."""
        os.kill(self._shell.pid, signal.SIGHUP)

    def close(self) -> None:
        """End the command in the foreground with Ctrl-C, and close the terminal. May be called repeatedly."""
        if self._is_closed:
            return
        self._is_closed = True
        with contextlib.suppress(AssertionError, OSError):
            if not _PROMPT.search(self.output):
                self.press_ctrl_c()
            self.type("exit")
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._shell.wait(1.0)
        if self._shell.poll() is None:
            os.kill(self._shell.pid, signal.SIGHUP)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._shell.wait(1.0)
        if self._shell.poll() is None:
            self._shell.kill()
            self._shell.wait()
        self._reader.join(10.0)  # before another file gets the same descriptor
        os.close(self._keyboard)

    def _wait(self, condition: Callable[[], T | None], timeout_s: float, what: str) -> T:
        deadline = time.monotonic() + timeout_s
        with self._changed:
            while not (found := condition()):
                if time.monotonic() >= deadline:
                    raise AssertionError(f"no {what} in {timeout_s} s; on the screen:\n{self.output}")
                if not self._reader.is_alive():
                    raise AssertionError(f"the shell ended without {what}; on the screen:\n{self.output}")
                self._changed.wait(0.1)
        return found
