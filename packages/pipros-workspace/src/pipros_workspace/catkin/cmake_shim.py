"""Provide the value of `${CMAKE_COMMAND}`: the path of CMake or, if it is not installed, of a substitute."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Mapping
from pathlib import Path

from pipros_workspace.setup_files import write_if_changed

_SCRIPT = """\
#!{python}
# Created by pipros's catkin_make, because CMake is not installed.
import sys

from pipros_workspace.cmake.cmake_command import main

sys.exit(main())
"""


def cmake_program(build: Path, variables: Mapping[str, str]) -> str:
    """Return the path of CMake. If it is not installed, write a substitute to the build space, and return the
    substitute's path.
    """
    found = shutil.which("cmake", path=variables.get("PATH"))
    if found is not None:
        return found
    script = build / "pipros" / "cmake"
    if write_if_changed(script, _SCRIPT.format(python=sys.executable)):
        script.chmod(0o755)
    return str(script)
