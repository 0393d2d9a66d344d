"""What `install()` copies, and the copying."""

from __future__ import annotations

import fnmatch
import os
import re
import shutil
import stat
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from pipros.errors import PiprosError
from pipros.workspace.cmake import regex

Say = Callable[[str], None]

_PERMISSIONS = {
    "OWNER_READ": 0o400, "OWNER_WRITE": 0o200, "OWNER_EXECUTE": 0o100,
    "GROUP_READ": 0o040, "GROUP_WRITE": 0o020, "GROUP_EXECUTE": 0o010,
    "WORLD_READ": 0o004, "WORLD_WRITE": 0o002, "WORLD_EXECUTE": 0o001,
    "SETUID": 0o4000, "SETGID": 0o2000,
}  # fmt: skip
_OF_FILES, _OF_PROGRAMS = 0o644, 0o755

_KINDS = {"PROGRAMS": "program", "FILES": "file", "DIRECTORY": "folder", "CODE": "code", "SCRIPT": "script"}
_ONE_VALUE = ("DESTINATION", "RENAME", "COMPONENT", "TYPE")
_PERMISSION_LISTS = ("PERMISSIONS", "FILE_PERMISSIONS", "DIRECTORY_PERMISSIONS")
_SWITCHES = ("OPTIONAL", "USE_SOURCE_PERMISSIONS", "FILES_MATCHING", "MESSAGE_NEVER", "EXCLUDE_FROM_ALL",
             "NO_SOURCE_PERMISSIONS", "FOLLOW_SYMLINK_CHAIN", "ALL_COMPONENTS")  # fmt: skip


class CannotInstall(PiprosError):
    """Something to be installed does not exist."""


@dataclass(frozen=True, slots=True)
class Pattern:
    """A `PATTERN` or `REGEX` of `install(DIRECTORY)`: which paths it means, and what becomes of them."""

    expression: re.Pattern[str]
    is_excluded: bool = False
    permissions: int | None = None


@dataclass(frozen=True, slots=True)
class Installation:
    """Something that `install()` does.

    Attributes:
        kind: `program`, `file`, `folder`; `code` and `script` are CMake's own language, in `source`.
        source: an absolute path; the code, for `code`. With a slash at its end, what is in a folder.
        target: the folder to put it in, below the install space.
        is_python: a script of `catkin_install_python`, which the devel space relays to.
        rename: what a file is called there.
        permissions: of files; None for the usual ones.
        only_matching: whether files that no pattern means stay away.
    """

    kind: str
    source: str
    target: str = ""
    is_python: bool = False
    rename: str = ""
    is_optional: bool = False
    permissions: int | None = None
    keeps_permissions: bool = False
    patterns: tuple[Pattern, ...] = ()
    only_matching: bool = False


def read_installations(
    words: Sequence[str], in_source: Callable[[str], str], *, is_python: bool = False
) -> list[Installation]:
    """What `install(words)` does; nothing for compiled targets.

    Args:
        in_source: makes paths absolute.
        is_python: whether it is `catkin_install_python`.

    Raises:
        ValueError: the words make no sense.
    """
    kind = _KINDS.get(words[0] if words else "")
    if kind is None:
        return []
    if kind in ("code", "script"):
        return [Installation(kind, word if kind == "code" else in_source(word)) for word in words[1:2]]
    sources: list[str] = []
    common = Installation(kind, "", is_python=is_python)
    patterns: list[Pattern] = []
    rest = list(words[1:])
    while rest:
        word = rest.pop(0)
        if word in _ONE_VALUE and rest:
            value = rest.pop(0)
            common = replace(common, target=value if word == "DESTINATION" else common.target,
                             rename=value if word == "RENAME" else common.rename)  # fmt: skip
        elif word in ("PATTERN", "REGEX") and rest:
            patterns.append(_pattern(word, rest.pop(0)))
        elif word == "EXCLUDE" and patterns:
            patterns[-1] = replace(patterns[-1], is_excluded=True)
        elif word in _PERMISSION_LISTS:
            permissions = 0
            while rest and rest[0] in _PERMISSIONS:
                permissions |= _PERMISSIONS[rest.pop(0)]
            if patterns:
                patterns[-1] = replace(patterns[-1], permissions=permissions)
            elif word != "DIRECTORY_PERMISSIONS":
                common = replace(common, permissions=permissions)
        elif word == "CONFIGURATIONS":
            while rest and rest[0] not in (*_ONE_VALUE, *_SWITCHES, *_PERMISSION_LISTS):
                rest.pop(0)
        elif word in _SWITCHES:
            common = replace(
                common,
                is_optional=common.is_optional or word == "OPTIONAL",
                only_matching=common.only_matching or word == "FILES_MATCHING",
                keeps_permissions=common.keeps_permissions or word == "USE_SOURCE_PERMISSIONS",
            )
        else:
            sources.append(in_source(word) + ("/" if word.endswith("/") else ""))
    if not common.target:
        raise ValueError(f"given no DESTINATION for {words[0]}")
    return [replace(common, source=source, patterns=tuple(patterns)) for source in sources]


def _pattern(kind: str, text: str) -> Pattern:
    if kind == "REGEX":
        return Pattern(regex.compiled(text))
    return Pattern(re.compile(f"(?:.*/)?{fnmatch.translate(text)}"))


def install_one(one: Installation, install: Path, say: Say) -> None:
    """Copies something into the install space.

    Raises:
        CannotInstall: it does not exist.
        OSError: it cannot be copied.
    """
    target = install / one.target
    source = Path(one.source)
    if not source.exists() and not source.is_symlink():
        if one.is_optional or one.kind == "folder":
            return
        raise CannotInstall(f'file INSTALL cannot find "{source}": No such file or directory.')
    if one.kind == "folder":
        # As for cp: with a slash at its end, what is in the folder; without, the folder itself.
        _copy_folder(one, source, target if one.source.endswith("/") else target / source.name, say)
    else:
        mode = one.permissions or (_OF_PROGRAMS if one.kind == "program" else _OF_FILES)
        installed = target / (one.rename or source.name)
        copy(source, installed, say, mode=mode)
        if one.is_python:
            _name_the_interpreter(installed)


def _name_the_interpreter(script: Path) -> None:
    """Python of no version in a script's first line becomes Python 3, as Noetic has it."""
    content = script.read_bytes()
    first_line, newline, rest = content.partition(b"\n")
    if first_line.rstrip() == b"#!/usr/bin/env python":
        times = script.stat()
        script.write_bytes(b"#!/usr/bin/env python3" + newline + rest)
        os.utime(script, ns=(times.st_atime_ns, times.st_mtime_ns))


def copy(source: Path, target: Path, say: Say, *, mode: int = _OF_FILES) -> None:
    """Copies a file unless it is there already.

    Raises:
        OSError: it cannot be copied.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    if target.exists() and target.stat().st_mtime_ns == source.stat().st_mtime_ns:
        say(f"-- Up-to-date: {target}")
        return
    say(f"-- Installing: {target}")
    if source.is_symlink():
        target.unlink(missing_ok=True)
        shutil.copy2(source, target, follow_symlinks=False)
        return
    shutil.copy2(source, target)
    target.chmod(mode)


def install_folder(source: Path, target: Path, say: Say) -> None:
    """Copies a folder of Python modules.

    Raises:
        OSError: it cannot be copied.
    """
    _copy_folder(Installation("folder", str(source), keeps_permissions=True), source, target, say)


def _copy_folder(one: Installation, source: Path, target: Path, say: Say) -> None:
    target.mkdir(parents=True, exist_ok=True)
    for folder, folders, files in os.walk(source):
        folders[:] = [
            name
            for name in folders
            if name != "__pycache__" and not _is_excluded(one, os.path.join(folder, name))
        ]
        below = target / os.path.relpath(folder, source)
        below.mkdir(exist_ok=True)
        for name in files:
            path = os.path.join(folder, name)
            matching = [pattern for pattern in one.patterns if pattern.expression.search(path)]
            if _is_excluded(one, path) or (one.only_matching and not matching):
                continue
            mode = one.permissions or _OF_FILES
            if one.keeps_permissions:
                mode = stat.S_IMODE(os.stat(path).st_mode)
            for pattern in matching:
                mode = pattern.permissions or mode
            copy(Path(path), Path(os.path.normpath(below / name)), say, mode=mode)


def _is_excluded(one: Installation, path: str) -> bool:
    return any(pattern.is_excluded and pattern.expression.search(path) for pattern in one.patterns)
