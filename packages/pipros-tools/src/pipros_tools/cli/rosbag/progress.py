"""Show the progress of long operations as one line on a terminal. Without a terminal, print nothing."""

from __future__ import annotations

import shutil
import sys
import time

from pipros_tools.bag.info_text import human_size

_PERIOD_S = 0.1


class Progress:
    """Display of how many of `total` bytes have been processed, updated at most ten times a second.

    Args:
        label: description of the work.
        is_quiet: whether to show nothing.
    """

    def __init__(self, label: str, total: int, *, is_quiet: bool = False) -> None:
        self._label = label
        self._total = max(total, 1)
        self._is_shown = not is_quiet and sys.stdout.isatty()
        self._started = time.monotonic()
        self._next = 0.0

    def __call__(self, done: int) -> None:
        now = time.monotonic()
        if self._is_shown and now >= self._next:
            self._next = now + _PERIOD_S
            self._show(done, now)

    def finish(self) -> None:
        """Show the final state and end the line."""
        if self._is_shown:
            self._show(self._total, time.monotonic())
            print()

    def _show(self, done: int, now: float) -> None:
        part = min(done / self._total, 1.0)
        left = (now - self._started) * (1 / part - 1) if part > 0 else 0.0
        seconds = int(now - self._started if part == 1 else left)
        figures = f"{100 * part:3.0f}%  {human_size(done):>9} / {human_size(self._total):>9} "
        figures += f"{seconds // 60:02d}:{seconds % 60:02d}{'' if part == 1 else ' ETA'}"
        width = max(10, shutil.get_terminal_size().columns - len(figures) - 4)
        print(f"\r {self._label[:width]:{width}} {figures:31}", end="", flush=True)
