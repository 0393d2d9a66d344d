"""Measure how long it takes to search each folder, for `rospack profile`."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from pipros.packages.crawl import crawl


def crawl_times(roots: Sequence[Path], length: int, *, only_empty: bool = False) -> list[str]:
    """Return the output of `rospack profile`: the slowest folders. A star marks folders without packages.

    Args:
        length: the maximum number of folders; negative for all.
        only_empty: whether to return only the paths of folders without packages.
    """
    started = time.perf_counter()
    costs: list[tuple[float, bool, str]] = []
    for root in roots:
        start = time.perf_counter()
        is_empty = not crawl(str(root)).packages
        costs.append((time.perf_counter() - start, is_empty, f"{root}/"))
        for folder in sorted(root.iterdir()) if root.is_dir() else ():
            if folder.is_dir() and not folder.name.startswith("."):
                start = time.perf_counter()
                is_empty = not crawl(str(folder)).packages
                costs.append((time.perf_counter() - start, is_empty, str(folder)))
    total = time.perf_counter() - started
    if only_empty:
        return [path for _, is_empty, path in costs if is_empty]
    costs.sort(reverse=True)
    chosen = costs if length < 0 else costs[:length]
    return [
        f"Full tree crawl took {total:.6f} seconds.",
        "Directories marked with (*) contain no manifest.  You may",
        "want to delete these directories.",
        "To get just of list of directories without manifests,",
        "re-run the profile with --zombie-only",
        "-" * 61,
        *(f"{cost:.6f} {'*' if is_empty else ' '} {path}" for cost, is_empty, path in chosen),
    ]
