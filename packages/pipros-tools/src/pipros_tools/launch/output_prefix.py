"""Prefix every output line of a node with the node's name, in a colour that depends on the node.

Each node writes to its own pty, so that it still flushes every line and keeps its colours; the lines are
copied to the launcher's terminal. If the launcher's output is not a terminal, nodes write to it directly, as
in Noetic.
"""

from __future__ import annotations

import contextlib
import os
import re
import select
import sys
import threading
from dataclasses import dataclass

from pipros.basics.terminals import HAS_PTYS, is_raw, open_pty

_COLOURS = (36, 32, 35, 33, 34, 96, 92, 95)
_CHUNK_BYTES = 65536
_RECENT_BYTES = 65536

# Loggers reset a line's colour after the end of the line.
_COLOURS_ALONE = re.compile(rb"(?:\033\[[\d;]*m){1,999}")

_BARE_LINE_END = re.compile(rb"(?<!\r)\n")

# An incomplete line, such as a prompt or a progress bar, is printed after this time.
_INCOMPLETE_LINE_S = 0.1


def is_available() -> bool:
    """Return whether standard output and standard error are terminals and ptys can be opened."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        return HAS_PTYS and os.isatty(sys.stdout.fileno()) and os.isatty(sys.stderr.fileno())
    return False


@dataclass(slots=True, eq=False, repr=False)
class LinePrefix:
    """Adds a prefix to each line of output. The output may arrive in pieces of any length."""

    prefix: bytes
    is_in_line: bool = False

    def format(self, text: bytes) -> bytes:
        """Return `text` with the prefix at the start of each line. Colour codes alone do not start a line."""
        pieces = []
        for line in text.splitlines(keepends=True):
            if not self.is_in_line and _COLOURS_ALONE.fullmatch(line):
                pieces.append(line)
                continue
            pieces.append(line if self.is_in_line else self.prefix + line)
            self.is_in_line = not line.endswith(b"\n")
        return b"".join(pieces)


class PrefixedOutput:
    """A pty for one process. Its output lines are copied to the launcher's terminal.

    Use `write_end` as the process's output, and call `started` once the process has been spawned.
    """

    def __init__(self, name: str, number: int) -> None:
        """Open the pty; `number` selects the colour.

        Raises:
            OSError: the system has no free pty.
        """
        self._read_end, self.write_end = open_pty(sys.stdout.fileno())
        colour = _COLOURS[number % len(_COLOURS)]
        self._prefix = LinePrefix(f"\033[{colour}m[{name}]\033[0m ".encode())
        self._target = sys.stdout.fileno()
        self._recent = b""
        self._copier = threading.Thread(target=self._copy, name=f"output of {name}", daemon=True)

    def started(self) -> None:
        """Start copying. Must be called after the process has been started or has failed to start."""
        os.close(self.write_end)
        self._copier.start()

    @property
    def recent(self) -> bytes:
        """The last 64 KiB of the output, without prefixes. May be read from any thread."""
        return self._recent

    def finish(self, timeout_s: float = 0.5) -> None:
        """Wait up to `timeout_s` until all output of the exited process has been printed."""
        self._copier.join(timeout_s)

    def _copy(self) -> None:
        pending = b""
        try:
            while True:
                is_ready = select.select([self._read_end], [], [], _INCOMPLETE_LINE_S if pending else None)[0]
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
            pass  # the last process with this terminal has exited
        self._show(pending)
        os.close(self._read_end)

    def _show(self, text: bytes) -> bytes:
        """Write a piece of output. Return an empty string, because nothing is left pending."""
        if text:
            self._recent = (self._recent + text)[-_RECENT_BYTES:]
            shown = self._prefix.format(text)
            # Nodes that read single keys leave raw mode to print, but may have entered it again before their
            # output is copied.
            if is_raw(self._target):
                shown = _BARE_LINE_END.sub(b"\r\n", shown)
            with contextlib.suppress(OSError):
                os.write(self._target, shown)
        return b""
