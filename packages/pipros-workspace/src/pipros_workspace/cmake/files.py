"""The command `file()`, which reads, writes, finds and copies files."""

from __future__ import annotations

import filecmp
import fnmatch
import hashlib
import os
import re
import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

from pipros.basics.input_file import read_file
from pipros.basics.limits import process_limits
from pipros.basics.replaced_file import naming, write_whole
from pipros.basics.windows import relative_path, remove_file, replace_file, with_slashes
from pipros_workspace.cmake import regex
from pipros_workspace.cmake.configure import configured
from pipros_workspace.cmake.copying import CannotCopy, copy, read_copies
from pipros_workspace.cmake.scope import Scope, Unsupported
from pipros_workspace.cmake.words import options_of

HASHES = ("MD5", "SHA1", "SHA224", "SHA256", "SHA384", "SHA512")
_GIVEN_PERMISSIONS = frozenset(("PERMISSIONS", "FILE_PERMISSIONS", "NO_SOURCE_PERMISSIONS"))
_WILD = re.compile(r"[*?\[]")


def carry_out(words: list[str], scope: Scope) -> None:
    """Execute `file(words)`.

    Raises:
        ValueError: the arguments are wrong, or a file cannot be read or written.
        Unsupported: only CMake itself supports the subcommand.
    """
    operation, *rest = words or [""]
    action = _OPERATIONS.get(operation)
    if action is None:
        raise Unsupported(f"file({operation})")
    try:
        action(rest, scope)
    except CannotCopy as error:
        raise ValueError(str(error)) from None
    except IndexError:
        raise ValueError(f"sub-command {operation} has too few arguments") from None
    except OSError as error:
        raise ValueError(f"{operation}: {error.filename or rest}: {error.strerror or error}") from None


def _glob(words: list[str], scope: Scope, *, is_recursive: bool) -> None:
    output, *rest = words
    relative_to, with_folders = None, not is_recursive
    found: set[str] = set()
    while rest:
        word = rest.pop(0)
        if word == "RELATIVE":
            relative_to = rest.pop(0)
        elif word == "LIST_DIRECTORIES":
            with_folders = rest.pop(0).lower() in ("true", "on", "1", "yes")
        elif word not in ("CONFIGURE_DEPENDS", "FOLLOW_SYMLINKS"):
            pattern = scope.in_source(word)
            found.update((_matching_below if is_recursive else _matching)(pattern, with_folders=with_folders))
    paths = sorted(relative_path(path, relative_to) if relative_to else path for path in found)
    scope.values[output] = with_slashes(";".join(paths))


def _matching(pattern: str, *, with_folders: bool) -> list[str]:
    """Return the paths that match an absolute pattern. As in CMake, the paths include hidden files."""
    drive, rest = os.path.splitdrive(pattern)  # the drive may be //server/share; elsewhere, it is empty
    found, parts = [drive], rest.split("/")[1:]
    for part in parts:
        # A name that exists is meant, even if it has brackets: the workspace may be in such a folder.
        found = [
            f"{base}/{name}"
            for base in found
            for name in ([part] if os.path.lexists(f"{base}/{part}") else _names(f"{base}/"))
            if name == part or (_WILD.search(part) and fnmatch.fnmatchcase(name, part))
        ]
    return [path for path in found if with_folders or not os.path.isdir(path)]


def _matching_below(pattern: str, *, with_folders: bool) -> Iterator[str]:
    """Yield paths at any depth whose last component matches the last component of the pattern.

    The search starts in the folders that match the rest of the pattern.
    """
    base, _, last = pattern.rpartition("/")
    for root in _matching(base, with_folders=True) if _WILD.search(base) else [base]:
        for folder, folders, files in os.walk(root):
            names = [*files, *folders] if with_folders else files
            yield from (os.path.join(folder, name) for name in names if fnmatch.fnmatchcase(name, last))


def _names(folder: str) -> list[str]:
    try:
        return os.listdir(folder)
    except OSError:
        return []


def _read(words: list[str], scope: Scope) -> None:
    options = dict(zip(words[2::2], words[3::2], strict=False))
    content = read_file(scope.in_source(words[0]), process_limits().file_bytes)[
        int(options.get("OFFSET", "0")) :
    ]
    if "LIMIT" in options:
        content = content[: int(options["LIMIT"])]
    scope.values[words[1]] = content.hex() if "HEX" in words[2:] else content.decode("utf-8", "replace")


def _strings(words: list[str], scope: Scope) -> None:
    options = dict(zip(words[2::2], words[3::2], strict=False))
    content = read_file(scope.in_source(words[0]), process_limits().file_bytes)
    lines = content.decode("utf-8", "replace").splitlines()
    if "REGEX" in options:
        pattern = regex.compiled(options["REGEX"])
        lines = [line for line in lines if pattern.search(line)]
    kept = [line.replace(";", "\\;") for line in lines]
    limit = int(options.get("LIMIT_COUNT", "0"))
    scope.values[words[1]] = ";".join(kept[:limit] if limit else kept)


def _write(words: list[str], scope: Scope, mode: str) -> None:
    path = Path(scope.in_source(words[0]))
    path.parent.mkdir(parents=True, exist_ok=True)
    content = "".join(words[1:]).encode()
    if mode == "w":
        write_whole(path, content)
        return
    with naming(path), path.open("ab") as file:
        file.write(content)


def _touch(words: list[str], scope: Scope, *, makes: bool = True) -> None:
    for word in words:
        path = Path(scope.in_source(word))
        if makes or path.exists():
            path.touch()


def _remove(words: list[str], scope: Scope, *, is_recursive: bool) -> None:
    if not words:
        raise ValueError("must be called with at least two arguments")
    for word in filter(None, words):
        remove(scope.in_source(word), is_recursive=is_recursive)


def remove(path: str, *, is_recursive: bool) -> None:
    """Remove a file or link if it exists. A folder is removed only if `is_recursive` is true."""
    if os.path.isdir(path) and not os.path.islink(path):
        if is_recursive:
            shutil.rmtree(path)
    else:
        remove_file(path)


def _rename(words: list[str], scope: Scope) -> None:
    replace_file(scope.in_source(words[0]), scope.in_source(words[1]))


def _make_directory(words: list[str], scope: Scope) -> None:
    for word in words:
        os.makedirs(scope.in_source(word), exist_ok=True)


def _copy(words: list[str], scope: Scope, *, is_installing: bool = False) -> None:
    for item in read_copies(words, scope.in_source):
        # Unlike INSTALL, COPY gives files the permissions of their sources.
        keeps = not is_installing and _GIVEN_PERMISSIONS.isdisjoint(words)
        copied = replace(
            item,
            target=scope.in_binary(item.target),
            is_folder=os.path.isdir(item.source),
            keeps_permissions=keeps or item.keeps_permissions,
        )
        copy(copied, Path("/"), print if is_installing else lambda _line: None)


def _copy_file(words: list[str], scope: Scope) -> None:
    source, target = scope.in_source(words[0]), scope.in_source(words[1])
    if not ("ONLY_IF_DIFFERENT" in words and os.path.isfile(target) and filecmp.cmp(source, target, False)):
        shutil.copyfile(source, target)


def _link(words: list[str], scope: Scope) -> None:
    source, target = words[0], scope.in_source(words[1])
    remove_file(target)
    if "SYMBOLIC" in words:
        os.symlink(source, target)
    else:
        os.link(scope.in_source(source), target)


def _set(compute: Callable[[list[str], Scope], str]) -> Callable[[list[str], Scope], None]:
    """Return a subcommand that stores the result of `compute` in the variable given by its first word."""

    def carry_out(words: list[str], scope: Scope) -> None:
        scope.values[words[0]] = compute(words[1:], scope)

    return carry_out


def _relative_path(path: str, folder: str) -> str:
    """Return a path relative to a folder.

    As in CMake, a path that consists only of `..` components ends with a slash.
    """
    relative = with_slashes(relative_path(path, folder))
    if relative == ".":
        return ""
    return f"{relative}/" if relative.endswith("..") else relative


def _timestamp(words: list[str], scope: Scope) -> None:
    format_and_zone = words[2:]
    form = next((word for word in format_and_zone if word != "UTC"), "%Y-%m-%dT%H:%M:%S")
    try:
        changed = os.stat(scope.in_source(words[0])).st_mtime
    except OSError:
        scope.values[words[1]] = ""
        return
    when = time.gmtime(changed) if "UTC" in format_and_zone else time.localtime(changed)
    scope.values[words[1]] = time.strftime(form, when)


def _digest(words: list[str], scope: Scope, algorithm: str) -> None:
    content = read_file(scope.in_source(words[0]), process_limits().file_bytes)
    scope.values[words[1]] = hashlib.new(algorithm, content, usedforsecurity=False).hexdigest()


def _configure(words: list[str], scope: Scope) -> None:
    options = options_of(words, "OUTPUT", "CONTENT")
    target = Path(scope.in_binary(options["OUTPUT"]))
    target.parent.mkdir(parents=True, exist_ok=True)
    write_whole(target, configured(options["CONTENT"], scope, at_only="@ONLY" in words).encode())


_OPERATIONS: Mapping[str, Callable[[list[str], Scope], None]] = {
    **{name: partial(_digest, algorithm=name.lower()) for name in HASHES},
    "GLOB": lambda words, scope: _glob(words, scope, is_recursive=False),
    "GLOB_RECURSE": lambda words, scope: _glob(words, scope, is_recursive=True),
    "READ": _read,
    "STRINGS": _strings,
    "WRITE": lambda words, scope: _write(words, scope, "w"),
    "APPEND": lambda words, scope: _write(words, scope, "a"),
    "TOUCH": _touch,
    "TOUCH_NOCREATE": lambda words, scope: _touch(words, scope, makes=False),
    "REMOVE": lambda words, scope: _remove(words, scope, is_recursive=False),
    "REMOVE_RECURSE": lambda words, scope: _remove(words, scope, is_recursive=True),
    "RENAME": _rename,
    "MAKE_DIRECTORY": _make_directory,
    "COPY": _copy,
    "INSTALL": lambda words, scope: _copy(words, scope, is_installing=True),
    "COPY_FILE": _copy_file,
    "CREATE_LINK": _link,
    "CONFIGURE": _configure,
    "LOCK": lambda _words, _scope: None,
    "RELATIVE_PATH": _set(lambda words, _scope: _relative_path(words[1], words[0])),
    "TIMESTAMP": _timestamp,
    "TO_CMAKE_PATH": lambda words, scope: scope.values.update(
        {words[1]: with_slashes(words[0].replace(os.pathsep, ";"))}
    ),
    "TO_NATIVE_PATH": lambda words, scope: scope.values.update(
        {words[1]: words[0].replace("/", os.sep).replace(";", os.pathsep)}
    ),
    "SIZE": lambda words, scope: scope.values.update(
        {words[1]: str(os.path.getsize(scope.in_source(words[0])))}
    ),
    "REAL_PATH": lambda words, scope: scope.values.update(
        {words[1]: with_slashes(os.path.realpath(scope.in_source(words[0])))}
    ),
    "READ_SYMLINK": lambda words, scope: scope.values.update(
        {words[1]: with_slashes(os.readlink(scope.in_source(words[0])))}
    ),
}
