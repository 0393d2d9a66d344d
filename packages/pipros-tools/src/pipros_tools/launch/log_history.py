"""Read the end of the run's `rosout.log`, for the log entries written before a program subscribed."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pipros.basics.input_file import read_end
from pipros_tools.launch.run_id import is_run_id

FILE_BYTES = 1_000_000
"""Number of bytes that are read from the end of the file."""

Entry = list[Any]
"""Level, node, text, time, file, line, function."""

_LEVELS = {"DEBUG": 1, "INFO": 2, "WARN": 4, "ERROR": 8, "FATAL": 16}
_LINE = re.compile(
    r"(?P<stamp>\d{1,10}\.\d{1,9})\s+(?P<level>[A-Z]+) (?P<node>/\S*) "
    r"\[(?P<file>[^\]]*):(?P<line>\d{1,9})\((?P<function>[^()]*)\) ?\] \[topics: [^\]]*\] (?P<text>.*)"
)


def log_history(log_folder: Path, run_id: object, longest_text: int, longest_name: int) -> list[Entry]:
    """Return the newest entries in a run's log file, oldest first.

    The list is empty if the file does not exist, for example because the master runs on another machine.

    Args:
        run_id: the value of the parameter `/run_id`, which any node may set.
        longest_text: maximum number of characters of a string; longer strings are truncated.
        longest_name: the same for the names of nodes, files and functions.
    """
    if not is_run_id(run_id):
        return []
    try:
        text = read_end(log_folder / str(run_id) / "rosout.log", FILE_BYTES)
    except OSError:
        return []
    return [
        [entry[0], entry[1][:longest_name], entry[2][:longest_text], entry[3], *entry[4:]]
        for entry in entries_in(text, longest_name)
    ]


def entries_in(text: str, longest_name: int) -> Iterator[Entry]:
    """Yield the entries in `rosout.log`. Lines that begin with a tab continue the previous entry.

    >>> list(entries_in("1.500000000 WARN /arm [arm.py:7(move)] [topics: /a, /b] slow\\n\\tvery", 300))
    [[4, '/arm', 'slow\\nvery', 1.5, 'arm.py', 7, 'move']]
    """
    entry: Entry | None = None
    lines: list[str] = []
    for line in text.split("\n"):
        if entry is not None and line.startswith("\t"):
            lines.append(line[1:])
            continue
        if entry is not None:
            yield [*entry[:2], "\n".join(lines), *entry[3:]]
        found = _LINE.fullmatch(line)
        entry = None
        if found and found["level"] in _LEVELS:
            lines = [found["text"]]
            entry = [
                _LEVELS[found["level"]],
                found["node"],
                found["text"],
                round(float(found["stamp"]), 4),
                found["file"][:longest_name],
                int(found["line"]),
                found["function"][:longest_name],
            ]
    if entry is not None:
        yield [*entry[:2], "\n".join(lines), *entry[3:]]
