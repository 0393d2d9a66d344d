"""Environments and command lines that run a workspace's programs with pipros's Python.

The first line of most nodes is `#!/usr/bin/env python3`, which runs the first `python3` in `PATH`. If a
pipros tool is called by its full path, without an activated virtual environment, this Python usually lacks
pipros. Therefore, the tools put the folder of their own interpreter first in `PATH`. `script_interpreter`
handles first lines that name a specific interpreter, such as `#!/usr/bin/python3`.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from pipros.basics.env import DISTRIBUTION
from pipros.basics.input_file import open_file
from pipros.basics.windows import ON_WINDOWS
from pipros.basics.words import split_words
from pipros.msg.importing.hook import is_beside_ros2
from pipros.packages import SHARES
from pipros.packages.installed_packages import folders as installed_folders
from pipros.packages.system_packages import child_package_path, is_compiled, manifest_folders
from pipros_workspace.client_library import beside_ros2
from pipros_workspace.script_interpreter import ScriptInterpreter, interpreter_of

_POSIX_SHELL = "/bin/sh"


def program_environment(variables: Mapping[str, str], executable: str = sys.executable) -> dict[str, str]:
    """Return the environment for a program in a package.

    `python3` and `python` run the given interpreter. `ROS_DISTRO`, `ROS_VERSION` and `ROS_PYTHON_VERSION`
    default to the values that Noetic's setup files set. On Windows, Python's output to a pipe has escapes for
    characters that the code page lacks.
    """
    environment = {**DISTRIBUTION, **variables}
    if ON_WINDOWS:
        environment.setdefault("PYTHONIOENCODING", ":backslashreplace")
    folder = os.path.dirname(os.path.abspath(executable))
    search_path = environment.get("PATH", os.defpath)
    found = shutil.which("python3", path=search_path) or shutil.which("python", path=search_path)
    if found is None or os.path.dirname(found) != folder:
        environment["PATH"] = folder + os.pathsep + search_path
    return environment


def environment_of(program: Path, variables: Mapping[str, str]) -> dict[str, str]:
    """Return `program_environment` for one program, adapted by `beside_ros2`.

    Compiled programs are linked with genuine roscpp, and need the plugin descriptions in Debian's packages.
    If such packages are installed, their folder and the folders of packages installed by pip are added to
    `ROS_PACKAGE_PATH`.
    """
    environment = program_environment(variables)
    chosen = _script_interpreter(program, environment) if is_beside_ros2() else None
    environment = beside_ros2(program, chosen.interpreter if chosen else None, environment)
    if is_compiled(program) and next(manifest_folders(), None):
        path = environment.get("ROS_PACKAGE_PATH", "")
        environment["ROS_PACKAGE_PATH"] = child_package_path(path, SHARES, list(installed_folders()))
    return environment


def command_of(
    program: Path,
    arguments: Sequence[str] = (),
    prefix: str = "",
    variables: Mapping[str, str] = os.environ,
) -> list[str]:
    """Return the command line that runs a program, with a prefix such as `gdb -ex run --args`.

    The prefix is split into words as in a shell; no shell is run. `variables` is the environment of the
    program.

    Raises:
        InvalidEnvironment: `PIPROS_INTERPRETER` has an unknown value.
        ValueError: the prefix has an unclosed quote.
    """
    starter: Sequence[str] = ()
    if ON_WINDOWS and _is_python_script(program):
        starter = (sys.executable,)
    elif not ON_WINDOWS and _is_bare_shell_script(program):
        starter = (_POSIX_SHELL,)
    else:
        starter = starter_of(program, variables)
    return [*split_words(prefix), *starter, str(program), *arguments]


def starter_of(program: Path, variables: Mapping[str, str]) -> tuple[str, ...]:
    """Return the words that start a Python script with pipros's interpreter.

    The result is empty if the operating system starts the program directly, or cannot start it.

    Raises:
        InvalidEnvironment: `PIPROS_INTERPRETER` has an unknown value.
    """
    chosen = _script_interpreter(program, variables)
    return () if chosen is None else chosen.words


def why_not_startable(program: Path, variables: Mapping[str, str] = os.environ) -> str | None:
    """Return a description of the problem with a script's first line, or None if there is none.

    The kernel's own error is unhelpful. `variables` is the environment of the program.

    Raises:
        InvalidEnvironment: `PIPROS_INTERPRETER` has an unknown value.
    """
    if ON_WINDOWS and _is_python_script(program):  # pipros's Python starts it; see `command_of`
        return None
    try:
        start = _start_of(program)
    except OSError as error:
        return f"{program} cannot be read: {error.strerror}"
    first_line = start.split(b"\n", 1)[0]
    chosen = _script_interpreter(program, variables)
    if chosen is not None:
        return None if chosen.interpreter else f"{program} {chosen.reason}"
    if start.startswith(b"#!"):
        if first_line.endswith(b"\r"):
            return (
                f"{program} has Windows line endings, so its first line does not name an interpreter; "
                "convert it with dos2unix"
            )
        interpreter = first_line[2:].strip().split(b" ", 1)[0].decode("utf-8", "replace")
        if interpreter and not os.path.exists(interpreter):
            return f"{program} needs the interpreter {interpreter}, which does not exist"
    elif program.suffix == ".py" and not ON_WINDOWS:
        return f"{program} does not name its interpreter; make '#!/usr/bin/env python3' its first line"
    return None


def has_windows_line_ends(program: Path) -> bool:
    """Return whether a script's `#!` line has a Windows line ending."""
    try:
        start = _start_of(program)
    except OSError:
        return False
    return start.startswith(b"#!") and start.split(b"\n", 1)[0].endswith(b"\r")


def is_left_to_env(program: Path, variables: Mapping[str, str] = os.environ) -> bool:
    """Return whether the operating system starts a script through `env`, which looks up Python in `PATH`."""
    chosen = _script_interpreter(program, variables)
    return chosen is not None and chosen.has_env


def _script_interpreter(program: Path, variables: Mapping[str, str]) -> ScriptInterpreter | None:
    if ON_WINDOWS or not program.is_file() or not os.access(program, os.X_OK):
        return None
    try:
        return interpreter_of(program, variables)
    except OSError:  # starting the program reports the error
        return None


def _start_of(program: Path) -> bytes:
    with open_file(program) as file:
        return file.read(256)


def _is_python_script(program: Path) -> bool:
    """Return whether the suffix or the first line of a file indicates a Python script."""
    if program.suffix.lower() == ".py":
        return True
    with contextlib.suppress(OSError):
        first_line = _start_of(program).split(b"\n", 1)[0]
        return first_line.startswith(b"#!") and b"python" in first_line
    return False


def _is_bare_shell_script(program: Path) -> bool:
    """Return True for a text file without `#!`. A shell runs such a script, but the kernel does not."""
    if program.suffix == ".py":
        return False
    try:
        with open_file(program) as file:
            start = file.read(128)
    except OSError:
        return False
    return bool(start) and not start.startswith(b"#!") and b"\0" not in start and start.isascii()
