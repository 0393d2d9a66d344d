"""Tells the output of nodes apart on a terminal: each line bears its node's name, in a colour of its own.

Each node gets a terminal of its own to write to (a pty), so that it still flushes every line and keeps its
colours; what it writes is copied line by line. Without a terminal nodes write to roslaunch's own output,
byte for byte, as in Noetic.
"""

from __future__ import annotations

import contextlib
import os
import select
import sys
import threading
from dataclasses import dataclass

_COLOURS = (36, 32, 35, 33, 34, 96, 92, 95)
_CHUNK_BYTES = 65536

# An unfinished line, such as a prompt or a progress bar, is shown when nothing more comes for this long.
_PATIENCE_S = 0.1


def are_wanted() -> bool:
    """True when both outputs of this process are terminals, and terminals can be made."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        return hasattr(os, "openpty") and os.isatty(sys.stdout.fileno()) and os.isatty(sys.stderr.fileno())
    return False


@dataclass(slots=True)
class _Line:
    """Where the copying of one node is within a line."""

    prefix: bytes
    is_begun: bool = False

    def format(self, text: bytes) -> bytes:
        """A piece of output with the prefix wherever a line begins."""
        pieces = []
        for line in text.splitlines(keepends=True):
            pieces.append(line if self.is_begun else self.prefix + line)
            self.is_begun = not line.endswith(b"\n")
        return b"".join(pieces)


class LabelledOutput:
    """A terminal for one process, whose lines are copied to ours.

    `write_end` is what the process gets as its output; close it with `started` once the process has it.
    """

    def __init__(self, name: str, number: int) -> None:
        """Opens the terminal.

        Raises:
            OSError: the system has no terminal left.
        """
        self._read_end, self.write_end = os.openpty()
        self._take_over_settings()
        colour = _COLOURS[number % len(_COLOURS)]
        self._line = _Line(f"\033[{colour}m[{name}]\033[0m ".encode())
        self._target = sys.stdout.fileno()
        self._copier = threading.Thread(target=self._copy, name=f"output of {name}", daemon=True)

    def started(self) -> None:
        """To be called when the process was started, or could not be: begins to copy."""
        os.close(self.write_end)
        self._copier.start()

    def finish(self, timeout_s: float = 0.5) -> None:
        """Waits until everything that the ended process wrote is shown."""
        self._copier.join(timeout_s)

    def _take_over_settings(self) -> None:
        """Gives the terminal the size of ours, and switches off what would change the bytes."""
        import fcntl
        import termios

        with contextlib.suppress(OSError, termios.error):
            size = fcntl.ioctl(sys.stdout.fileno(), termios.TIOCGWINSZ, b"\0" * 8)
            fcntl.ioctl(self.write_end, termios.TIOCSWINSZ, size)
        with contextlib.suppress(termios.error):
            settings = termios.tcgetattr(self.write_end)
            settings[1] &= ~termios.OPOST
            settings[3] &= ~termios.ECHO
            termios.tcsetattr(self.write_end, termios.TCSANOW, settings)

    def _copy(self) -> None:
        pending = b""
        try:
            while True:
                is_ready = select.select([self._read_end], [], [], _PATIENCE_S if pending else None)[0]
                if not is_ready:
                    pending = self._show(pending)
                    continue
                chunk = os.read(self._read_end, _CHUNK_BYTES)
                if not chunk:
                    break
                complete, newline, rest = (pending + chunk).rpartition(b"\n")
                self._show(complete + newline)
                pending = rest
        except OSError:
            pass  # the last process that had the terminal is gone
        self._show(pending)
        os.close(self._read_end)

    def _show(self, text: bytes) -> bytes:
        """Writes a piece of output; gives back that nothing is pending."""
        if text:
            with contextlib.suppress(OSError):
                os.write(self._target, self._line.format(text))
        return b""
