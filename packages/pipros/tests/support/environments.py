"""The environments in which tests start programs of pipros and of genuine ROS."""

from __future__ import annotations

import fnmatch
import os
import shutil
import sys
from pathlib import Path

from tests.support import lacks

# Where links are not allowed, this file is a copy in `build`.
REPOSITORY = next(
    folder
    for folder in Path(__file__).resolve().parents
    if (folder / "script" / "merge_packages.py").exists()
)
EXAMPLES = REPOSITORY / "examples" / "catkin_ws" / "src"
MERGED = REPOSITORY / "build"
"""Links to the folders of all packages, by script/merge_packages.py."""
SRC, TESTS, BENCHMARKS = MERGED / "src", MERGED / "tests", MERGED / "benchmarks"
FACADES = (MERGED / "facades", MERGED / "internals")
"""The folders with the packages that have Noetic's names."""
SOURCE_PATH = os.pathsep.join(map(str, (SRC, *FACADES)))
"""PYTHONPATH for an interpreter in which pipros is not installed."""
VENV_BIN = Path(sys.executable).parent

# fmt: off
_SHELL_TOOLS = (
    "bash", "sh", "env", "cat", "ls", "chmod", "mkdir", "cp", "mv", "rm", "sleep", "kill", "sed", "grep",
    "head", "tail", "tee", "stty", "uname", "touch", "ln", "id", "date", "tty", "dirname", "basename",
    "find", "ps", "timeout", "true", "false", "zsh", "fish",
)
# fmt: on


def files_below(folder: Path, pattern: str = "*") -> list[Path]:
    """Return the files below a folder of `build` whose names match, sorted."""
    return sorted(
        Path(base, name)
        for base, _, names in os.walk(folder, followlinks=True)
        if not base.endswith("__pycache__")
        for name in fnmatch.filter(names, pattern)
    )


def source_files() -> list[Path]:
    """Return all Python files of the library and the facades, including the shipped packages."""
    return [file for folder in (SRC, *FACADES) for file in files_below(folder, "*.py")]


def import_path(file: Path) -> Path:
    """Return the path of a source file relative to the folder that is on `sys.path`."""
    return file.relative_to(next(folder for folder in (SRC, *FACADES) if file.is_relative_to(folder)))


def make_tool_folder(folder: Path) -> Path:
    """Create a folder for PATH with shell tools only, in which no command of genuine ROS is found."""
    folder.mkdir(parents=True, exist_ok=True)
    for tool in _SHELL_TOOLS:
        if found := shutil.which(tool, path="/usr/bin:/bin"):
            (folder / tool).symlink_to(found)
    return folder


def pipros_environment(home: Path, master_uri: str, tools: Path) -> dict[str, str]:
    """Return the environment after `. .venv/bin/activate`, with the examples in ROS_PACKAGE_PATH."""
    return {
        **_common(home, master_uri),
        **lacks.carried(),
        "PATH": f"{VENV_BIN}{os.pathsep}{tools}",
        "VIRTUAL_ENV": str(VENV_BIN.parent),
        "ROS_PACKAGE_PATH": str(EXAMPLES),
    }


def genuine_environment(home: Path, master_uri: str) -> dict[str, str]:
    """Return the environment of a shell with Debian's ROS packages, without pipros and its interpreter."""
    return {
        **_common(home, master_uri),
        "PATH": "/usr/bin:/bin",
        "ROS_PACKAGE_PATH": os.pathsep.join(map(str, (EXAMPLES, "/usr/share"))),
        "ROS_IP": "127.0.0.1",
    }


CPP_ONLY = {"ROS_LANG_DISABLE": "geneus:genlisp:gennodejs:genpy"}
"""Makes genuine catkin generate only C++, which takes a third of the time; for tests of C++ messages."""


def _common(home: Path, master_uri: str) -> dict[str, str]:
    return {
        "HOME": str(home),
        "ROS_HOME": str(home / ".ros"),
        "ROS_MASTER_URI": master_uri,
        "LANG": "C.UTF-8",
        "TERM": "xterm",
        # Otherwise, Python would buffer output to a pipe until the program ends.
        "PYTHONUNBUFFERED": "1",
    }
