"""Scripts of ROS 1 and ROS 2: the client library that a script imports, and the environment that it needs.

ROS 2's wheels set `LD_LIBRARY_PATH`, and execute Python again, whenever it starts in their environment.
Another environment's Python must not inherit the variable, because its libraries have the same names.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path

from pipros.basics.input_file import open_file
from pipros.msg.importing.hook import is_beside_ros2

_SCRIPT_BYTES = 256 * 1024
_ELF = b"\x7fELF"  # compiled programs
_RELAYED = re.compile(r"""(?m)^(?:python_)?script = (['"])(.+)\1\r?$""")
"""How pipros's catkin_make, and genuine catkin, name the script that a script in a devel space runs."""
_GUARD = "_ROS_WHEELS_BOOTSTRAP_COMPLETE"  # set by the wheels, so that Python executes itself only once


def is_ros1_script(program: Path) -> bool:
    """Return whether a Python script imports rospy and not rclpy."""
    text = _text_of(program)
    return _imports("rospy", text) and not _imports("rclpy", text)


def is_ros2_script(program: Path) -> bool:
    """Return whether a Python script imports rclpy and not rospy."""
    text = _text_of(program)
    return _imports("rclpy", text) and not _imports("rospy", text)


def relayed_script(program: Path) -> Path:
    """Return the script in the source space that a script in a devel space runs, or else `program`."""
    relayed = _RELAYED.search(_start(program))
    return Path(relayed[2].replace("\\\\", "\\")) if relayed else program


def _text_of(program: Path) -> str:
    return _start(relayed_script(program))


def _start(program: Path) -> str:
    try:
        with open_file(program) as file:
            start = file.read(4)
            return "" if start == _ELF else (start + file.read(_SCRIPT_BYTES)).decode("utf-8", "replace")
    except OSError:
        return ""


def _imports(module: str, text: str) -> bool:
    return _import_of(module).search(text) is not None


@cache
def _import_of(module: str) -> re.Pattern[str]:
    name = rf"{module}(?![\w])"
    return re.compile(rf"(?m)^[ \t]*(?:from[ \t]+{name}|import[ \t]+(?:[\w.][\w. \t]*,[ \t]*){{0,99}}{name})")


def beside_ros2(program: Path, interpreter: str | None, variables: Mapping[str, str]) -> dict[str, str]:
    """Return the environment of a program that a process in an environment with ROS 2 starts.

    Args:
        interpreter: the program's Python interpreter; None for other programs.
        variables: the environment of this process.
    """
    if not is_beside_ros2():
        return dict(variables)
    if interpreter is None or not is_here(interpreter):
        return without_libraries(variables)
    choice = {"PIPROS_MESSAGES": "ros1"} if is_ros1_script(program) else {}
    return {**choice, **variables}


def without_libraries(variables: Mapping[str, str]) -> dict[str, str]:
    """Return environment variables without those that ROS 2's wheels have set for this environment."""
    if _GUARD not in variables:
        return dict(variables)
    kept = {name: value for name, value in variables.items() if name not in (_GUARD, "LD_LIBRARY_PATH")}
    entries = variables.get("LD_LIBRARY_PATH", "").split(os.pathsep)
    others = [each for each in entries if each and not Path(each).is_relative_to(sys.prefix)]
    return {**kept, "LD_LIBRARY_PATH": os.pathsep.join(others)} if others else kept


def is_here(interpreter: str) -> bool:
    """Return whether an interpreter belongs to the environment of this process."""
    return os.path.dirname(os.path.abspath(interpreter)) == os.path.dirname(os.path.abspath(sys.executable))
