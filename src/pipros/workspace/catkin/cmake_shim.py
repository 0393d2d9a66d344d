"""The program behind `${CMAKE_COMMAND}`."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Mapping
from pathlib import Path

from pipros.workspace.setup_files import write_if_changed

_SCRIPT = """\
#!{python}
# Made by catkin_make of pipros, since there is no CMake on this machine.
import sys

from pipros.cmake.cmake_command import main

sys.exit(main())
"""


def cmake_program(build: Path, variables: Mapping[str, str]) -> str:
    """Return the path of CMake, or the path of a substitute script in the build space."""
    found = shutil.which("cmake", path=variables.get("PATH"))
    if found is not None:
        return found
    script = build / "pipros" / "cmake"
    if write_if_changed(script, _SCRIPT.format(python=sys.executable)):
        script.chmod(0o755)
    return str(script)
