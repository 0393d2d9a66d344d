"""The commands `get_filename_component()`, `find_program()`, `find_file()` and `find_path()`."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Callable

from pipros.basics.windows import with_slashes
from pipros.cmake.scope import Scope
from pipros.cmake.words import options_of


def get_filename_component(words: list[str], scope: Scope) -> None:
    """Execute `get_filename_component(variable path mode …)`.

    Raises:
        ValueError: there are too few arguments, or the mode is unknown.
    """
    if len(words) < 3:
        raise ValueError("called with incorrect number of arguments")
    output, path, mode = words[:3]
    options = options_of(words[3:], "BASE_DIR")
    path = with_slashes(path)
    name = path.rpartition("/")[2]
    folder = (re.sub("//+", "/", path).rstrip("/") or "/").rpartition("/")[0]
    stem, dot, extension = name.partition(".")
    longest_stem, last_dot, last_extension = name.rpartition(".")
    absolute = os.path.join(options.get("BASE_DIR", scope.in_source("")), path)
    parts = {
        "DIRECTORY": folder or ("/" if path.startswith("/") else ""),
        "PATH": folder or ("/" if path.startswith("/") else ""),
        "NAME": name,
        "EXT": dot + extension,
        "NAME_WE": stem,
        "LAST_EXT": last_dot + last_extension if last_dot else "",
        "NAME_WLE": longest_stem if last_dot else name,
        "ABSOLUTE": with_slashes(os.path.normpath(absolute)),
        "REALPATH": with_slashes(os.path.realpath(absolute)),
        "PROGRAM": with_slashes(shutil.which(path, path=scope.environment.get("PATH")) or ""),
    }
    if mode not in parts:
        raise ValueError(f"unknown component {mode}")
    scope.values[output] = parts[mode]


def find_program(words: list[str], scope: Scope) -> None:
    """Execute `find_program(variable names… [PATHS folders…])`."""
    _find(words, scope, lambda name, folders: shutil.which(name, path=os.pathsep.join(folders)),
          scope.environment.get("PATH", os.defpath).split(os.pathsep))  # fmt: skip


def find_file(words: list[str], scope: Scope) -> None:
    """Execute `find_file(variable names… [PATHS folders…])`."""
    _find(words, scope, _in_folders, ["/usr/include", "/usr/local/include"])


def find_path(words: list[str], scope: Scope) -> None:
    """Execute `find_path(variable names… [PATHS folders…])`."""

    def folder_with(name: str, folders: list[str]) -> str | None:
        return next((folder for folder in folders if os.path.exists(os.path.join(folder, name))), None)

    _find(words, scope, folder_with, ["/usr/include", "/usr/local/include"])


def _in_folders(name: str, folders: list[str]) -> str | None:
    paths = (os.path.join(folder, name) for folder in folders)
    return next((path for path in paths if os.path.isfile(path)), None)


def _find(
    words: list[str],
    scope: Scope,
    search: Callable[[str, list[str]], str | None],
    usual: list[str],
) -> None:
    if not words:
        raise ValueError("called with incorrect number of arguments")
    variable, *rest = words
    known = scope.values.get(variable, "")
    if known and not known.endswith("NOTFOUND"):
        return
    sections: dict[str, list[str]] = {"NAMES": [], "PATHS": [], "HINTS": [], "PATH_SUFFIXES": [], "DOC": []}
    current, is_required = "NAMES", False
    for word in rest:
        if word in sections:
            current = word
        elif word == "REQUIRED":
            is_required = True
        elif word == "NO_DEFAULT_PATH":
            usual = []
        elif not word.startswith(("NO_", "NAMES_PER_DIR", "ONLY_CMAKE_")):
            sections[current].append(word)
    bases = [*sections["HINTS"], *usual, *sections["PATHS"]]
    folders = [os.path.join(base, suffix) for suffix in (*sections["PATH_SUFFIXES"], "") for base in bases]
    found = next(filter(None, (search(name, folders) for name in sections["NAMES"])), None)
    if found is None and is_required:
        raise ValueError(
            f"Could not find {variable} using the following names: {', '.join(sections['NAMES'])}"
        )
    scope.cache[variable] = with_slashes(found or f"{variable}-NOTFOUND")
