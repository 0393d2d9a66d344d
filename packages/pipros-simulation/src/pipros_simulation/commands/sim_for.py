"""`pipros sim-for`: prints a launch file that runs another launch file on a simulated robot."""

from __future__ import annotations

import os
import sys
from argparse import ArgumentParser
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from pipros.basics.errors import PiprosError
from pipros_tools.cli.entry_point import command

if TYPE_CHECKING:
    from pipros_tools.launch.load_context import LoadContext


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Print the launch file. Return 0, or 1 if the given file cannot be loaded."""
    parser = ArgumentParser(
        prog="pipros sim-for",
        usage="pipros sim-for [PACKAGE] LAUNCHFILE [name:=value ...]",
        description="Reads the launch files of a robot's navigation, and prints a launch file that starts "
        "them with pipros_sim as the robot: with the topics, frames, size, map and place that they expect. "
        "What it could not find out is in a comment, and on standard error.",
    )
    parser.add_argument("words", nargs="+", metavar="LAUNCHFILE")
    words = parser.parse_args(argv).words
    arguments = dict(word.split(":=", 1) for word in words if ":=" in word)
    files = [word for word in words if ":=" not in word]
    if len(files) not in (1, 2):
        parser.error(f"expected a launch file, or a package and a launch file, got {len(files)} words")
    try:
        text, unknown = _wrapper(files, arguments)
    except (PiprosError, OSError) as error:
        print(f"pipros sim-for: {error}", file=sys.stderr)
        return 1
    print(text, end="")
    for each in unknown:
        print(f"pipros sim-for: not found out: {each}", file=sys.stderr)
    return 0


def _wrapper(words: list[str], arguments: dict[str, str]) -> tuple[str, list[str]]:
    from pipros_simulation.launch_sets.expected_robot import expected_robot
    from pipros_simulation.launch_sets.wrapper import wrapper_text
    from pipros_tools.launch.find_launch_files import resolve_files
    from pipros_tools.launch.load_context import LoadContext
    from pipros_tools.launch.xml import load
    from pipros_workspace.index import PackageIndex

    index = PackageIndex.from_environment()
    file = os.path.abspath(resolve_files(words, index)[0])
    context = LoadContext.of_process(index)
    context = context._replace(run_command=_only_xacro(context))
    expected = expected_robot(load([file], arguments, context=context))
    return wrapper_text(file, arguments, expected), expected.unknown


def _only_xacro(context: LoadContext) -> Callable[[str], str]:
    """Return a function that runs xacro and cat, but no other command of a launch file that is only read."""
    from pipros_simulation.launch_sets.expected_robot import ONLY_XACRO
    from pipros_tools.launch.load_context import CommandFailed, NotRun

    def run_command(line: str) -> str:
        program = line.split()[0] if line.split() else ""
        known = [context.find("xacro", name) for name in ("xacro", "xacro.py")]
        if program not in ("cat", "xacro", "xacro.py", *known):
            return NotRun(ONLY_XACRO)
        try:
            return context.run_command(line)
        except CommandFailed as error:
            return NotRun(error)

    return run_command
