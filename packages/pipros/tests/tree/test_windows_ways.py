"""Windows's ways stand in the modules that exist for systems, and files are replaced as Windows needs it."""

from __future__ import annotations

import re

from tests.support.environments import SRC, files_below

PACKAGE = SRC / "pipros"
SYSTEMS = {f"basics/{name}.py" for name in ("interrupts", "posix", "terminals", "windows", "windows_job")}
QUESTION = re.compile(r"\bsys\.platform\b|\bos\.name\b")
MOST_QUESTIONS = 45
"""Comparisons with the name of a system outside `SYSTEMS`. Lower this if there are fewer."""

RENAMING = re.compile(r"\bos\.(?:replace|rename)\(|\.(?:rename\([^\"']|replace\([\w.]+\))")
RENAMES = {
    "basics/cache_files.py": "in a folder's descriptor, which Windows lacks",
    "basics/log_file.py": "a node does not wait for a reader of its log",
    "basics/windows.py": "is the function to use",
    "launch/logs.py": "replaces a link",
    "navigation/velocities/cmd_vel_mux_node.py": "replaces inputs, not files",
    "net/local_socket.py": "Linux only",
}
"""Modules that rename files, and why they need not wait for programs that have the file open."""


def found(pattern: re.Pattern[str]) -> dict[str, int]:
    """Return how often a pattern occurs in each module."""
    counts = {}
    for file in files_below(PACKAGE, "*.py"):
        count = len(pattern.findall(file.read_text(encoding="utf-8")))
        if count and "share" not in file.relative_to(PACKAGE).parts:
            counts[file.relative_to(PACKAGE).as_posix()] = count
    return counts


def test_files_are_replaced_by_the_function_that_waits_for_other_programs() -> None:
    assert set(found(RENAMING)) == set(RENAMES)


def test_few_modules_ask_for_the_system() -> None:
    counts = {name: count for name, count in found(QUESTION).items() if name not in SYSTEMS}
    assert sum(counts.values()) <= MOST_QUESTIONS, counts
