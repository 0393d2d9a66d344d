"""`check_urdf`: checks a robot description and prints its link tree."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.basics.input_file import read_text
from pipros.basics.printable import printable_lines
from pipros_libraries.robot_model.urdf import Robot, UrdfError, read_robot
from pipros_libraries.robot_model.urdf_text import tree_lines
from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import CommandError, run

FAILED = 255
"""The exit code of urdfdom's programs for any error."""


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Print the link tree, and return the exit code."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    return run(lambda: _check(arguments), error_code=FAILED)


def _check(arguments: list[str]) -> int:
    if not arguments or arguments[0] in ("-h", "--help"):
        print("Usage: check_urdf FILE", file=sys.stderr)
        return FAILED
    print(printable_lines("\n".join(tree_lines(read_robot_file(arguments[0])))))
    return 0


def read_robot_file(path: str) -> Robot:
    """Read a robot description from a file.

    Raises:
        CommandError: the file cannot be read, is not a valid robot description, or does not name the robot.
    """
    try:
        robot = read_robot(read_text(path))
    except OSError as error:
        raise CommandError(f"cannot read {path}: {error.strerror}") from None
    except (UnicodeDecodeError, UrdfError) as error:
        raise CommandError(f"{path}: {error}") from None
    if not robot.name:
        raise CommandError(f"{path}: <robot> must have a name attribute")
    return robot
