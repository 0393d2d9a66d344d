"""Starts programs of a workspace with the Python that pipros is installed in.

A node's first line is `#!/usr/bin/env python3`: whichever `python3` comes first in `PATH`. When a tool
of pipros is called by its full path, without its virtual environment being activated, that would be
a Python that knows nothing of pipros. So the tools put their own interpreter's folder first.
"""

from __future__ import annotations

import os
import shlex
import shutil
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

_ON_WINDOWS = os.name == "nt"
_POSIX_SHELL = "/bin/sh"


def with_own_python_first(variables: Mapping[str, str], executable: str = sys.executable) -> dict[str, str]:
    """A copy of the environment in which `python3` and `python` mean the interpreter given."""
    environment = dict(variables)
    own = os.path.dirname(os.path.abspath(executable))
    search_path = environment.get("PATH", os.defpath)
    found = shutil.which("python3", path=search_path) or shutil.which("python", path=search_path)
    if found is None or os.path.dirname(found) != own:
        environment["PATH"] = own + os.pathsep + search_path
    return environment


def command_of(program: Path, arguments: Sequence[str] = (), prefix: str = "") -> list[str]:
    """The command line that runs a program, behind a prefix such as `gdb -ex run --args`.

    The prefix is split into words as a shell does; no shell ever sees it.

    Raises:
        ValueError: for a prefix with an open quote.
    """
    starter: list[str] = []
    if _ON_WINDOWS and program.suffix.lower() == ".py":
        starter = [sys.executable]
    elif not _ON_WINDOWS and _is_bare_shell_script(program):
        starter = [_POSIX_SHELL]
    return [*shlex.split(prefix), *starter, str(program), *arguments]


def why_not_startable(program: Path) -> str | None:
    """What is wrong with a script's first line, in words that say what to write; None when nothing is."""
    try:
        start = _start_of(program)
    except OSError as error:
        return f"{program} cannot be read: {error.strerror}"
    first_line = start.split(b"\n", 1)[0]
    if start.startswith(b"#!"):
        if first_line.endswith(b"\r"):
            return (
                f"{program} has Windows line ends, which its first line cannot have; convert it with dos2unix"
            )
        interpreter = first_line[2:].strip().split(b" ", 1)[0].decode("utf-8", "replace")
        if interpreter and not os.path.exists(interpreter):
            return f"{program} asks for the interpreter {interpreter}, which does not exist"
    elif program.suffix == ".py" and not _ON_WINDOWS:
        return f"{program} has no first line that names its interpreter; put '#!/usr/bin/env python3' there"
    return None


def has_windows_line_ends(program: Path) -> bool:
    """Whether the line that names a script's interpreter ends as lines do on Windows."""
    try:
        start = _start_of(program)
    except OSError:
        return False
    return start.startswith(b"#!") and start.split(b"\n", 1)[0].endswith(b"\r")


def _start_of(program: Path) -> bytes:
    with program.open("rb") as file:
        return file.read(256)


def _is_bare_shell_script(program: Path) -> bool:
    """True for text without `#!`, which the kernel refuses and every shell runs as a script of its own."""
    if program.suffix == ".py":
        return False
    try:
        with program.open("rb") as file:
            start = file.read(128)
    except OSError:
        return False
    return bool(start) and not start.startswith(b"#!") and b"\0" not in start and start.isascii()
