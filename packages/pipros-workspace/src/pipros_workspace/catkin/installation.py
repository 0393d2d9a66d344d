"""Parse and execute `install()` and `catkin_install_python()`."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pipros.basics.input_file import read_file
from pipros.basics.replaced_file import write_whole
from pipros_workspace.cmake.cmake_command import script_interpreter
from pipros_workspace.cmake.copying import PROGRAM_MODE, Copy, copy, read_copies
from pipros_workspace.cmake.scope import Scope

if TYPE_CHECKING:
    from pipros.basics.printable import Say


@dataclass(frozen=True, slots=True)
class Installation:
    """A file or folder that a package installs, or CMake code to run at installation.

    Attributes:
        copy: the copy to make below the install space; None for code or a script.
        is_python: whether this is a `catkin_install_python()` script, which is also written to the devel
            space.
        code: the text of `install(CODE)`.
        script: the file of `install(SCRIPT)`.
        place: the file and line of the command.
    """

    copy: Copy | None = None
    is_python: bool = False
    code: str = ""
    script: str = ""
    place: str = ""

    @property
    def source(self) -> str:
        """The file or folder to read; empty for `install(CODE)`."""
        return self.script if self.copy is None else self.copy.source


def read_installations(
    words: list[str], scope: Scope, *, is_python: bool = False, place: str = ""
) -> list[Installation]:
    """Return the installations that `install(words)` specifies. The list is empty for kinds such as TARGETS.

    Args:
        is_python: whether the command is `catkin_install_python(words)`.
        place: the file and line of the command.

    Raises:
        ValueError: the arguments are invalid.
    """
    kind, rest = words[0] if words else "", words[1:]
    if kind == "CODE":
        return [Installation(code=text, place=place) for text in rest[:1]]
    if kind == "SCRIPT":
        return [Installation(script=scope.in_source(file), place=place) for file in rest[:1]]
    if kind == "PROGRAMS":
        copies = read_copies(rest, scope.in_source, mode=PROGRAM_MODE)
    elif kind in ("FILES", "DIRECTORY"):
        copies = read_copies(rest, scope.in_source, is_folder=kind == "DIRECTORY")
    else:
        return []
    return [Installation(copy, is_python, place=place) for copy in copies]


def install(item: Installation, prefix: Path, settings: Mapping[str, str], say: Say) -> None:
    """Copy a file or folder to the install space, or run the code or script of an `install()` command.

    Args:
        prefix: the install space.
        settings: the CMake cache entries for the code or script.

    Raises:
        CannotCopy: a file that is not optional does not exist.
        CMakeError: the code or script fails.
        OSError: the file or folder cannot be copied.
    """
    if item.copy is not None:
        copied = copy(item.copy, prefix, say)
        if item.is_python and copied.is_file():
            _name_python_3(copied)
    elif item.script:
        script_interpreter(settings).run_file(item.script)
    else:
        script_interpreter(settings).run_text(item.code, "install(CODE)")


def _name_python_3(script: Path) -> None:
    """Change the shebang `#!/usr/bin/env python` to python3, as Noetic's catkin does."""
    content = read_file(script)
    first_line, newline, rest = content.partition(b"\n")
    if env := re.fullmatch(rb"#![ \t]*(/[^\r\n]+/env)[ \t]+python[ \t]*(\r?)", first_line):
        times = script.stat()
        write_whole(script, b"#!%b python3%b" % env.groups() + newline + rest)
        os.utime(script, ns=(times.st_atime_ns, times.st_mtime_ns))
