"""`pipros-complete`: completes the word at the cursor of a ROS command line in a shell.

The shell passes the position of the word, then all words. Candidates are printed one per line. A multi-line
candidate is printed alone, after the character 0x1f. If called with `--find PACKAGE NAME`, the command prints
the files with that name in a package, for roscat, rosed and roscp. With `--absent COMMAND`, it prints advice
on a command that the shell did not find; with `--similar PACKAGE`, a question that suggests similar names.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

from pipros_tools.cli.complete.candidates import candidates
from pipros_tools.cli.complete.running import MANY_LINES
from pipros_tools.cli.entry_point import command

NO_SUCH_COMMAND = 127
"""The exit code of a shell that does not find a command."""


@command
def main(argv: Sequence[str] | None = None) -> int:
    arguments = list(sys.argv[1:] if argv is None else argv)
    if arguments[:1] == ["--find"] and len(arguments) == 3:
        return _print_files(*arguments[1:])
    if arguments[:1] == ["--absent"] and len(arguments) == 2:
        return _print_advice(arguments[1])
    if arguments[:1] == ["--similar"] and len(arguments) == 2:
        return _print_similar(arguments[1])
    if len(arguments) < 2 or not arguments[0].isdecimal():
        print("usage: pipros-complete POSITION WORD...", file=sys.stderr)
        return 2
    position, words = int(arguments[0]), arguments[1:]
    words += [""] * (position + 1 - len(words))
    started = words[position]
    for candidate in candidates(words[: position + 1]):
        if candidate.startswith(started) and _is_one_candidate(candidate):
            print(candidate)
    return 0


def _is_one_candidate(candidate: str) -> bool:
    """Return False for a candidate with unprintable characters, unless it starts with `MANY_LINES`.

    The shell would read a file name with a line break as several words.
    """
    return candidate.startswith(MANY_LINES) or candidate.isprintable()


def _print_advice(name: str) -> int:
    from pipros.packages.well_known import why_no_command

    advice = why_no_command(name)
    print(f"{name}: {advice or 'command not found'}", file=sys.stderr)
    return NO_SUCH_COMMAND


def _print_similar(package: str) -> int:
    from pipros.basics.similar_names import similar_names
    from pipros.packages.well_known import why_not_here
    from pipros_workspace.index import PackageIndex

    names = (each.name for each in PackageIndex.from_environment())
    if advice := why_not_here(package) or similar_names(package, names):
        print(advice)
    return 0


def _print_files(package_name: str, name: str) -> int:
    from pipros_workspace.index import PackageIndex

    package = PackageIndex.from_environment().get(package_name)
    if package is None:
        print(f"[rospack] Error: package '{package_name}' not found", file=sys.stderr)
        return 1
    if (package.path / name).is_file():
        print(package.path / name)
        return 0
    for folder, folders, files in os.walk(package.path):
        folders[:] = sorted(sub for sub in folders if not sub.startswith("."))
        if name in files:
            print(os.path.join(folder, name))
    return 0
