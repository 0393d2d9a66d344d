"""The environments in which tests start programs of pipros and of genuine ROS."""

import contextlib
import fnmatch
import os
import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path

from tests.support import lacks

REPOSITORY = Path(__file__).resolve().parents[4]
EXAMPLES = REPOSITORY / "examples" / "catkin_ws" / "src"
PACKAGES = tuple(
    folder for top in ("packages", "plugins") for folder in sorted((REPOSITORY / top).glob("pipros*"))
)
"""The folders of packages and plugins. Each has its part of `src`, `facades`, `tests` and `benchmarks`."""
FLOORS = ("pipros", "pipros_libraries", "pipros_workspace", "pipros_server", "pipros_tools")
"""The packages of the core, lowest first."""
SOURCES, FACADES = (
    tuple(package / part for package in PACKAGES if (package / part).is_dir()) for part in ("src", "facades")
)
"""The folders of all sources, and those with the packages that have Noetic's names."""
ROOTS = (*SOURCES, *FACADES)
SHIPPED = tuple(share for folder in SOURCES for share in folder.glob("pipros*/share"))
"""The folders with the ROS packages of pipros and of its plugins."""
SOURCE_PATH, TEST_PATH = (os.pathsep.join(map(str, folders)) for folders in (ROOTS, PACKAGES))
"""PYTHONPATH for an interpreter in which pipros is not installed, and for `tests.support`."""
VENV_BIN = Path(sys.executable).parent

# fmt: off
_SHELL_TOOLS = ("bash", "sh", "env", "cat", "ls", "chmod", "mkdir", "cp", "mv", "rm", "sleep", "kill", "sed",
    "grep", "head", "tail", "tee", "stty", "uname", "touch", "ln", "id", "date", "tty", "dirname", "basename",
    "find", "ps", "timeout", "true", "false", "zsh", "fish")
# fmt: on


def _in_packages(part: str, name: str) -> Path:
    """Return the file or folder of a name below a part of the package that has it.

    Raises:
        FileNotFoundError: no package or plugin has it.
    """
    for package in PACKAGES:
        if (found := package / part / name).exists():
            return found
    raise FileNotFoundError(f"no package has {part}/{name}")


source = partial(_in_packages, "src")
"""`source("pipros/share")` is a path in the sources of the package that has it."""
file_of_tests = partial(_in_packages, "tests")
benchmark = partial(_in_packages, "benchmarks")


def files_below(folder: Path, pattern: str = "*") -> list[Path]:
    """Return the files below a folder whose names match, sorted."""
    return sorted(
        Path(base, name)
        for base, _, names in os.walk(folder)
        if not base.endswith("__pycache__")
        for name in fnmatch.filter(names, pattern)
    )


def source_files() -> list[Path]:
    """Return all Python files of the library and the facades, including the shipped packages."""
    return [file for folder in ROOTS for file in files_below(folder, "*.py")]


def project_files(*patterns: str) -> list[Path]:
    """Return the project's files: those that git knows, or in an archive all but hidden files and caches.

    In `patterns`, `*` also stands for `/`, as in git.
    """
    command = ["git", "ls-files", "-z", *patterns]
    with contextlib.suppress(OSError, subprocess.CalledProcessError):
        listed = subprocess.run(command, cwd=REPOSITORY, check=True, capture_output=True, text=True).stdout
        return [REPOSITORY / name for name in listed.split("\0") if name]
    found = []
    for folder, names, files in os.walk(REPOSITORY):
        names[:] = [name for name in names if not name.startswith(".") and name != "__pycache__"]
        for file in (Path(folder, name) for name in files):
            name = file.relative_to(REPOSITORY).as_posix()
            if not patterns or any(fnmatch.fnmatch(name, pattern) for pattern in patterns):
                found.append(file)
    return found


def import_path(file: Path) -> Path:
    """Return the path of a source file relative to the folder that is on `sys.path`."""
    return file.relative_to(next(folder for folder in ROOTS if file.is_relative_to(folder)))


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
        **_common(home, master_uri), **lacks.carried(), "PATH": f"{VENV_BIN}{os.pathsep}{tools}",
        "VIRTUAL_ENV": str(VENV_BIN.parent), "ROS_PACKAGE_PATH": str(EXAMPLES),
    }  # fmt: skip


def genuine_environment(home: Path, master_uri: str) -> dict[str, str]:
    """Return the environment of a shell with Debian's ROS packages, without pipros and its interpreter."""
    return {
        **_common(home, master_uri), "PATH": "/usr/bin:/bin",
        "ROS_PACKAGE_PATH": os.pathsep.join(map(str, (EXAMPLES, "/usr/share"))), "ROS_IP": "127.0.0.1",
    }  # fmt: skip


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
