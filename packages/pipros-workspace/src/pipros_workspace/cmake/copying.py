"""Copy files as `file(COPY)` and `install()` do, with patterns and permissions."""

from __future__ import annotations

import fnmatch
import os
import re
import shutil
import stat
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import open_file
from pipros.basics.replaced_file import replaced_file
from pipros.basics.windows import remove_file, with_slashes
from pipros_workspace.cmake import regex

if TYPE_CHECKING:
    from pipros.basics.printable import Say


FILE_MODE, PROGRAM_MODE = 0o644, 0o755

_PERMISSIONS = {
    "OWNER_READ": 0o400, "OWNER_WRITE": 0o200, "OWNER_EXECUTE": 0o100,
    "GROUP_READ": 0o040, "GROUP_WRITE": 0o020, "GROUP_EXECUTE": 0o010,
    "WORLD_READ": 0o004, "WORLD_WRITE": 0o002, "WORLD_EXECUTE": 0o001,
    "SETUID": 0o4000, "SETGID": 0o2000,
}  # fmt: skip
_ONE_VALUE = ("DESTINATION", "RENAME", "COMPONENT", "TYPE")
_PATTERNS = ("PATTERN", "REGEX")
_PERMISSION_LISTS = ("PERMISSIONS", "FILE_PERMISSIONS", "DIRECTORY_PERMISSIONS")
_SWITCHES = ("OPTIONAL", "USE_SOURCE_PERMISSIONS", "FILES_MATCHING", "MESSAGE_NEVER", "EXCLUDE_FROM_ALL",
             "NO_SOURCE_PERMISSIONS", "FOLLOW_SYMLINK_CHAIN", "ALL_COMPONENTS")  # fmt: skip
_KEYWORDS = frozenset((*_ONE_VALUE, *_PATTERNS, *_PERMISSION_LISTS, *_SWITCHES, "EXCLUDE", "CONFIGURATIONS"))


class CannotCopy(PiprosError):
    """A file to copy does not exist."""


@dataclass(frozen=True, slots=True)
class CopyPattern:
    """A `PATTERN` or `REGEX`, and how matching paths are treated."""

    expression: regex.Pattern
    is_excluded: bool = False
    mode: int | None = None


@dataclass(frozen=True, slots=True)
class Copy:
    """A file or folder to copy.

    Attributes:
        source: an absolute path. A trailing slash denotes the contents of a folder.
        target: the destination folder, absolute or relative to the `base` of `copy`.
        rename: the new name of the file; empty to keep the source's name.
        is_optional: whether the source may be missing. A folder may always be missing.
        mode: the permissions of files; ignored if `keeps_permissions` is true.
        keeps_permissions: whether to keep the permissions of the source.
        only_matching: whether to skip files that match none of the patterns.
    """

    source: str
    target: str
    is_folder: bool = False
    rename: str = ""
    is_optional: bool = False
    mode: int = FILE_MODE
    keeps_permissions: bool = False
    patterns: tuple[CopyPattern, ...] = ()
    only_matching: bool = False


def read_copies(
    words: Sequence[str], in_source: Callable[[str], str], *, is_folder: bool = False, mode: int = FILE_MODE
) -> list[Copy]:
    """Parse the copies specified by words such as `a.txt b.txt DESTINATION share OPTIONAL`.

    Args:
        in_source: function that makes a source path absolute.
        is_folder: whether the sources are folders.
        mode: the default permissions of files.

    Raises:
        ValueError: `DESTINATION` or a keyword's value is missing, or a regular expression is invalid.
    """
    sources: list[str] = []
    patterns: list[CopyPattern] = []
    values: dict[str, str] = {}
    switches: set[str] = set()
    for keyword, following in _by_keyword(words):
        taken = _words_of(keyword, following)
        # Words that do not belong to the preceding keyword are sources.
        sources += following[len(taken) :]
        if keyword in _PATTERNS:
            patterns.append(_pattern(keyword, taken[0]))
        elif keyword in _ONE_VALUE:
            values[keyword] = taken[0]
        elif keyword == "EXCLUDE":
            if not patterns:
                raise ValueError('does not allow "EXCLUDE" before a PATTERN or REGEX is given')
            patterns[-1] = replace(patterns[-1], is_excluded=True)
        elif keyword in _PERMISSION_LISTS and patterns:
            patterns[-1] = replace(patterns[-1], mode=_mode(taken))
        elif keyword in _PERMISSION_LISTS and keyword != "DIRECTORY_PERMISSIONS":
            mode = _mode(taken) or mode
            switches.add("PERMISSIONS")
        else:
            switches.add(keyword)
    if not values.get("DESTINATION"):
        raise ValueError("given no DESTINATION")
    common = Copy(
        "",
        values["DESTINATION"],
        is_folder,
        rename=values.get("RENAME", ""),
        is_optional="OPTIONAL" in switches,
        mode=mode,
        keeps_permissions="USE_SOURCE_PERMISSIONS" in switches,
        patterns=tuple(patterns),
        only_matching="FILES_MATCHING" in switches,
    )
    return [replace(common, source=in_source(word) + ("/" if word.endswith("/") else "")) for word in sources]


def _by_keyword(words: Sequence[str]) -> Iterator[tuple[str, list[str]]]:
    """Yield each keyword with the words after it. The keyword is "" for words before the first keyword."""
    keyword, following = "", list[str]()
    for word in words:
        if word in _KEYWORDS:
            yield keyword, following
            keyword, following = word, []
        else:
            following.append(word)
    yield keyword, following


def _words_of(keyword: str, following: list[str]) -> list[str]:
    """Return the leading words that belong to the keyword."""
    if keyword in _ONE_VALUE or keyword in _PATTERNS:
        if not following:
            raise ValueError(f"given no value for {keyword}")
        return following[:1]
    if keyword in _PERMISSION_LISTS:
        count = next((n for n, word in enumerate(following) if word not in _PERMISSIONS), len(following))
        return following[:count]
    return following if keyword == "CONFIGURATIONS" else []


def _mode(permissions: Sequence[str]) -> int:
    mode = 0
    for permission in permissions:
        mode |= _PERMISSIONS[permission]
    return mode


def _pattern(keyword: str, text: str) -> CopyPattern:
    if keyword == "REGEX":
        return CopyPattern(regex.compiled(text))
    parts = rf"(?:^|/)(?=[^/]*(?:/[^/]*){{{text.count('/')}}}\Z)"  # as many names as in the pattern
    return CopyPattern(regex.Pattern(text, re.compile(parts + fnmatch.translate(text))))


def copy(item: Copy, base: Path, say: Say) -> Path:
    """Copy a file or folder, and return the path of the copy. A folder or an optional file may be missing.

    Args:
        base: the folder in which a relative `item.target` is resolved.
        say: called with a line of output for each file.

    Raises:
        CannotCopy: the source is a file that is not optional and does not exist.
        OSError: the source cannot be copied.
    """
    source, target = Path(item.source), base / item.target
    # As in rsync, a trailing slash denotes the contents of the folder.
    copied = target if item.source.endswith("/") else target / (item.rename or source.name)
    if not source.exists() and not source.is_symlink():
        if not (item.is_optional or item.is_folder):
            raise CannotCopy(f'file INSTALL cannot find "{source}": No such file or directory.')
    elif item.is_folder:
        _copy_folder(item, source, copied, say)
    else:
        copy_file(source, copied, say, mode=_mode_of(item, str(source)))
    return copied


def copy_file(source: Path, target: Path, say: Say, *, mode: int = FILE_MODE) -> None:
    """Copy a file unless the target has the same modification time. Links are copied as links.

    Raises:
        OSError: the file cannot be copied.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    if target.exists() and target.stat().st_mtime_ns == source.stat().st_mtime_ns:
        say(f"-- Up-to-date: {target}")
        return
    say(f"-- Installing: {target}")
    if source.is_symlink():
        remove_file(target)
        shutil.copy2(source, target, follow_symlinks=False)
        return
    with open_file(source) as content, replaced_file(target, is_synced=False) as file:
        shutil.copyfileobj(content, file)
    shutil.copystat(source, target)
    target.chmod(mode)


def _copy_folder(item: Copy, source: Path, target: Path, say: Say) -> None:
    target.mkdir(parents=True, exist_ok=True)
    for path in paths_to_copy(item, target):
        made = Path(os.path.normpath(target / path.relative_to(source)))
        if path == source or (path.is_dir() and not path.is_symlink()):
            made.mkdir(exist_ok=True)
        else:
            mode = FILE_MODE if path.is_symlink() and path.is_dir() else _mode_of(item, str(path))
            copy_file(path, made, say, mode=mode)


def paths_to_copy(item: Copy, target: Path | None = None) -> Iterator[Path]:
    """Yield the folders, files and links that a copy of a folder writes, each folder before its contents.

    Args:
        target: the folder of the copy, which is not searched if it is inside of the source.
    """
    for folder, folders, files in os.walk(item.source):
        folders[:] = [
            name
            for name in folders
            if name != "__pycache__"
            and Path(folder, name) != target
            and not _is_excluded(item, os.path.join(folder, name))
        ]
        yield Path(folder)
        links = [name for name in folders if os.path.islink(os.path.join(folder, name))]
        for name in links if not item.only_matching else ():  # os.walk() does not follow links to folders
            yield Path(folder, name)
        for name in files:
            path = os.path.join(folder, name)
            if not _is_excluded(item, path) and (_matching(item, path) or not item.only_matching):
                yield Path(path)


def _matching(item: Copy, path: str) -> list[CopyPattern]:
    path = with_slashes(path)
    return [pattern for pattern in item.patterns if pattern.expression.search(path)]


def _is_excluded(item: Copy, path: str) -> bool:
    return any(pattern.is_excluded for pattern in _matching(item, path))


def _mode_of(item: Copy, path: str) -> int:
    mode = stat.S_IMODE(os.stat(path).st_mode) if item.keeps_permissions else item.mode
    for pattern in _matching(item, path) if item.is_folder else ():
        mode = pattern.mode or mode
    return mode
