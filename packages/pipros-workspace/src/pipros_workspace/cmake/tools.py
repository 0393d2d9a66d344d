"""The tools of `cmake -E`, which copy, compare and remove files, and run programs."""

from __future__ import annotations

import filecmp
import os
import shutil
import subprocess
import time
from collections.abc import Callable, Mapping
from pathlib import Path

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_text
from pipros.basics.windows import replace_file
from pipros_workspace.cmake.files import remove


class ToolFailed(PiprosError):
    """A tool is unknown, or its arguments are wrong."""


def run_tool(name: str, words: list[str]) -> int:
    """Run `cmake -E name words` and return its exit code.

    Raises:
        ToolFailed: the tool is unknown, or its arguments are wrong.
        OSError: a file cannot be accessed, or a program cannot be run.
    """
    tool = _TOOLS.get(name)
    if tool is None:
        known = ", ".join(sorted(_TOOLS))
        raise ToolFailed(
            f"the tool after -E must be one of {known}; got {name}. Install CMake to use other tools"
        )
    try:
        return tool(words) or 0
    except (IndexError, ValueError):
        raise ToolFailed(f"cmake -E {name}: wrong arguments: {' '.join(words)}") from None


def _copy(words: list[str], *, if_different: bool = False) -> None:
    *sources, target = [word for word in words if word != "-t"]
    for source in sources:
        path = Path(target, Path(source).name) if os.path.isdir(target) else Path(target)
        if not (if_different and path.is_file() and filecmp.cmp(source, path, False)):
            path.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(source, path)


def _copy_directory(words: list[str]) -> None:
    *sources, target = words
    for source in sources:
        shutil.copytree(source, target, symlinks=True, dirs_exist_ok=True)


def _make_directory(words: list[str]) -> None:
    for word in words:
        os.makedirs(word, exist_ok=True)


def _touch(words: list[str], *, makes: bool = True) -> None:
    for word in words:
        if makes or os.path.exists(word):
            Path(word).touch()


def _remove(words: list[str], *, is_recursive: bool) -> None:
    options = "".join(word for word in words if word.startswith("-"))
    for word in words:
        if not word.startswith("-"):
            remove(word, is_recursive=is_recursive or "r" in options.lower())


def _rename(words: list[str]) -> None:
    source, target = words
    replace_file(source, target)


def _create_symlink(words: list[str]) -> None:
    source, target = words
    remove(target, is_recursive=False)
    os.symlink(source, target)


def _echo(words: list[str], *, end: str = "\n") -> None:
    print(" ".join(words), end=end, flush=True)


def _cat(words: list[str]) -> None:
    for word in words:
        print(read_text(word, errors="replace"), end="", flush=True)


def _compare_files(words: list[str]) -> int:
    first, second = words[-2:]
    return 0 if filecmp.cmp(first, second, False) else 1


def _environment(words: list[str]) -> int:
    variables = dict(os.environ)
    rest = list(words)
    while rest and (rest[0].startswith("--unset=") or "=" in rest[0] or rest[0] == "--"):
        word = rest.pop(0)
        if word == "--":
            break
        name, _, value = word.partition("=")
        if name == "--unset":
            variables.pop(value, None)
        else:
            variables[name] = value
    return subprocess.run(rest, env=variables, check=False).returncode  # noqa: S603


def _change_directory(words: list[str]) -> int:
    folder, *command = words
    return subprocess.run(command, cwd=folder, check=False).returncode  # noqa: S603


def _sleep(words: list[str]) -> None:
    time.sleep(sum(map(float, words)))


_TOOLS: Mapping[str, Callable[[list[str]], int | None]] = {
    "cat": _cat,
    "chdir": _change_directory,
    "compare_files": _compare_files,
    "copy": _copy,
    "copy_if_different": lambda words: _copy(words, if_different=True),
    "copy_directory": _copy_directory,
    "create_symlink": _create_symlink,
    "echo": _echo,
    "echo_append": lambda words: _echo(words, end=""),
    "env": _environment,
    "false": lambda _words: 1,
    "make_directory": _make_directory,
    "remove": lambda words: _remove(words, is_recursive=False),
    "remove_directory": lambda words: _remove(words, is_recursive=True),
    "rename": _rename,
    "rm": lambda words: _remove(words, is_recursive=False),
    "sleep": _sleep,
    "touch": _touch,
    "touch_nocreate": lambda words: _touch(words, makes=False),
    "true": lambda _words: 0,
}
