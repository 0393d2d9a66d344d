"""`file()`: files are read, written, found and copied."""

from __future__ import annotations

import filecmp
import os
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path

from pipros.workspace.cmake import regex
from pipros.workspace.cmake.configure import configured
from pipros.workspace.cmake.globs import matching, matching_below
from pipros.workspace.cmake.scope import Scope, Unsupported
from pipros.workspace.cmake.words import options_of


def carry_out(words: list[str], scope: Scope) -> None:
    """Carries out `file(words)`.

    Raises:
        ValueError: the words make no sense, or a file cannot be read or written.
        Unsupported: a subcommand that is not known here.
    """
    operation, *rest = words or [""]
    action = _OPERATIONS.get(operation)
    if action is None:
        raise Unsupported(f"file({operation})")
    try:
        action(rest, scope)
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
            found.update((matching_below if is_recursive else matching)(pattern, with_folders=with_folders))
    paths = sorted(os.path.relpath(path, relative_to) if relative_to else path for path in found)
    scope.values[output] = ";".join(paths)


def _read(words: list[str], scope: Scope) -> None:
    options = dict(zip(words[2::2], words[3::2], strict=False))
    content = Path(scope.in_source(words[0])).read_bytes()[int(options.get("OFFSET", "0")) :]
    if "LIMIT" in options:
        content = content[: int(options["LIMIT"])]
    scope.values[words[1]] = content.hex() if "HEX" in words[2:] else content.decode("utf-8", "replace")


def _strings(words: list[str], scope: Scope) -> None:
    options = dict(zip(words[2::2], words[3::2], strict=False))
    lines = Path(scope.in_source(words[0])).read_text("utf-8", "replace").splitlines()
    if "REGEX" in options:
        pattern = regex.compiled(options["REGEX"])
        lines = [line for line in lines if pattern.search(line)]
    kept = [line.replace(";", "\\;") for line in lines]
    limit = int(options.get("LIMIT_COUNT", "0"))
    scope.values[words[1]] = ";".join(kept[:limit] if limit else kept)


def _write(words: list[str], scope: Scope, mode: str) -> None:
    path = Path(scope.in_source(words[0]))
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open(mode, encoding="utf-8") as file:
        file.write("".join(words[1:]))


def _touch(words: list[str], scope: Scope, *, makes: bool = True) -> None:
    for word in words:
        path = Path(scope.in_source(word))
        if makes:
            path.parent.mkdir(parents=True, exist_ok=True)
        if makes or path.exists():
            path.touch()


def _remove(words: list[str], scope: Scope, *, is_recursive: bool) -> None:
    for word in filter(None, words):
        remove(scope.in_source(word), is_recursive=is_recursive)


def remove(path: str, *, is_recursive: bool) -> None:
    """Removes what is there; folders only when that is wanted."""
    if os.path.isdir(path) and not os.path.islink(path):
        if is_recursive:
            shutil.rmtree(path)
    elif os.path.lexists(path):
        os.unlink(path)


def _rename(words: list[str], scope: Scope) -> None:
    os.replace(scope.in_source(words[0]), scope.in_source(words[1]))


def _make_directory(words: list[str], scope: Scope) -> None:
    for word in words:
        os.makedirs(scope.in_source(word), exist_ok=True)


def _copy(words: list[str], scope: Scope, *, tells: bool = False) -> None:
    from pipros.workspace.installation import Installation, install_one, read_installations

    for one in read_installations(["FILES", *words], scope.in_source):
        kind = "folder" if os.path.isdir(one.source) else "file"
        copied = Installation(kind, one.source, scope.in_binary(one.target), patterns=one.patterns,
                              only_matching=one.only_matching)  # fmt: skip
        install_one(copied, Path("/"), print if tells else lambda _line: None)


def _copy_file(words: list[str], scope: Scope) -> None:
    source, target = scope.in_source(words[0]), scope.in_source(words[1])
    if not ("ONLY_IF_DIFFERENT" in words and os.path.isfile(target) and filecmp.cmp(source, target, False)):
        shutil.copyfile(source, target)


def _link(words: list[str], scope: Scope) -> None:
    source, target = words[0], scope.in_source(words[1])
    if os.path.lexists(target):
        os.unlink(target)
    if "SYMBOLIC" in words:
        os.symlink(source, target)
    else:
        os.link(scope.in_source(source), target)


def _set(compute: Callable[[list[str], Scope], str]) -> Callable[[list[str], Scope], None]:
    """A subcommand whose first word is the variable for the value."""

    def carry_out(words: list[str], scope: Scope) -> None:
        scope.values[words[0]] = compute(words[1:], scope)

    return carry_out


def _configure(words: list[str], scope: Scope) -> None:
    options = options_of(words, "OUTPUT", "CONTENT")
    target = Path(scope.in_binary(options["OUTPUT"]))
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(configured(options["CONTENT"], scope, at_only="@ONLY" in words), "utf-8")


_OPERATIONS: Mapping[str, Callable[[list[str], Scope], None]] = {
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
    "INSTALL": lambda words, scope: _copy(words, scope, tells=True),
    "COPY_FILE": _copy_file,
    "CREATE_LINK": _link,
    "CONFIGURE": _configure,
    "LOCK": lambda _words, _scope: None,
    "RELATIVE_PATH": _set(lambda words, _scope: os.path.relpath(words[1], words[0])),
    "TO_CMAKE_PATH": lambda words, scope: scope.values.update({words[1]: words[0].replace(":", ";")}),
    "TO_NATIVE_PATH": lambda words, scope: scope.values.update({words[1]: words[0].replace(";", ":")}),
    "SIZE": lambda words, scope: scope.values.update(
        {words[1]: str(os.path.getsize(scope.in_source(words[0])))}
    ),
    "REAL_PATH": lambda words, scope: scope.values.update(
        {words[1]: os.path.realpath(scope.in_source(words[0]))}
    ),
    "READ_SYMLINK": lambda words, scope: scope.values.update(
        {words[1]: os.readlink(scope.in_source(words[0]))}
    ),
}
