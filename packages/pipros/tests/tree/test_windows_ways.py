"""Windows's ways stand in the modules that exist for systems, and nothing else assumes POSIX."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from tests.support.environments import PACKAGES, REPOSITORY, SOURCES, files_below, import_path

SYSTEMS = {
    f"pipros/basics/{name}.py" for name in ("interrupts", "posix", "terminals", "windows", "windows_job")
}
QUESTION = re.compile(r"\bsys\.platform\b|\bos\.name\b")
MOST_QUESTIONS = 50
"""Comparisons with the name of a system outside `SYSTEMS`. Lower this if there are fewer."""

RENAMING = re.compile(r"\bos\.(?:replace|rename)\(|\.(?:rename\([^\"']|replace\([\w.]+\))")
RENAMES = {
    "pipros/basics/cache_files.py": "in a folder's descriptor, which Windows lacks",
    "pipros/basics/log_file.py": "a node does not wait for a reader of its log",
    "pipros/basics/windows.py": "is the function to use",
    "pipros_tools/launch/logs.py": "replaces a link",
    "pipros_robot/navigation/velocities/cmd_vel_mux_node.py": "replaces inputs, not files",
    "pipros/net/local_socket.py": "Linux only",
    "pipros/packages/zipped.py": "a new folder, which nobody has open",
}
"""Modules that rename files, and why they need not wait for programs that have the file open."""

POSIX_ONLY = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty"}
"""Modules of Python that Windows lacks."""


def found(pattern: re.Pattern[str]) -> dict[str, int]:
    """Return how often a pattern occurs in each module."""
    counts = {}
    for file in (each for folder in SOURCES for each in files_below(folder, "*.py")):
        count = len(pattern.findall(file.read_text(encoding="utf-8")))
        if count and "share" not in import_path(file).parts:
            counts[import_path(file).as_posix()] = count
    return counts


def test_files_are_replaced_by_the_function_that_waits_for_other_programs() -> None:
    assert set(found(RENAMING)) == set(RENAMES)


def test_few_modules_ask_for_the_system() -> None:
    counts = {name: count for name, count in found(QUESTION).items() if name not in SYSTEMS}
    assert sum(counts.values()) <= MOST_QUESTIONS, counts


def imported_at_start(file: Path) -> Iterator[str]:
    """Yield the names that a file imports without a condition, as modules."""
    for statement in ast.parse(file.read_text(encoding="utf-8")).body:
        if isinstance(statement, ast.Import):
            yield from (alias.name for alias in statement.names)
        elif isinstance(statement, ast.ImportFrom) and statement.module:
            yield statement.module
            yield from (f"{statement.module}.{alias.name}" for alias in statement.names)


def test_conftest_imports_nothing_that_windows_lacks() -> None:
    files = [
        REPOSITORY / "conftest.py",
        *(file for package in PACKAGES for file in files_below(package / "tests", "conftest.py")),
    ]
    lacking = set()
    for file in files:  # grows
        for name in imported_at_start(file):
            path = Path(*name.split(".")).with_suffix(".py")
            if name in POSIX_ONLY:
                lacking.add(f"{file.relative_to(REPOSITORY)}: {name}")
            files += {package / path for package in PACKAGES if (package / path).is_file()}.difference(files)
    assert len(files) > 15
    assert not lacking
