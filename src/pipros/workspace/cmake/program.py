"""Stands in for the program `cmake` where that is not installed: `cmake -E tool …` and `cmake -P script`.

Custom commands of packages use these to copy files and to run programs.
"""

from __future__ import annotations

import filecmp
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from pipros.errors import PiprosError
from pipros.workspace.cmake.files import remove
from pipros.workspace.cmake.interpreter import Interpreter
from pipros.workspace.cmake.language import Command
from pipros.workspace.cmake.messages import Kind, read_message
from pipros.workspace.cmake.names import BUILTIN_COMMANDS
from pipros.workspace.cmake.scope import Scope
from pipros.workspace.installation import Installation


class _Failed(PiprosError):
    """The program ends with 1 and this text."""


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the program and returns its exit code."""
    words = list(sys.argv[1:] if argv is None else argv)
    try:
        if words[:1] == ["-E"] and len(words) > 1:
            return _run_tool(words[1], words[2:])
        if "-P" in words[:-1]:
            place = words.index("-P")
            return run_script(words[place + 1], words[:place], ["cmake", *words])
    except (PiprosError, OSError) as error:
        print(error, file=sys.stderr)
        return 1
    print("This is the cmake of pipros, which knows -E and -P only. Install CMake for more", file=sys.stderr)
    return 1


def run_script(file: str, settings: Sequence[str] = (), arguments: Sequence[str] = ()) -> int:
    """Carries out a script; settings are as on the command line, `-DNAME=VALUE`.

    Raises:
        CMakeError: with file and line, for everything that is wrong.
    """
    variables = {
        "CMAKE_COMMAND": sys.argv[0],
        "CMAKE_SCRIPT_MODE_FILE": os.path.abspath(file),
        "CMAKE_ARGC": str(len(arguments)),
        **{f"CMAKE_ARGV{number}": word for number, word in enumerate(arguments)},
    }
    for setting in settings:
        name, sign, value = setting.removeprefix("-D").partition("=")
        if setting.startswith("-D") and sign:
            variables[name.partition(":")[0]] = value
    _interpreter(variables).run_file(os.path.abspath(file))
    return 0


def run_install_code(one: Installation, settings: Mapping[str, str]) -> None:
    """Carries out an `install(CODE)` or `install(SCRIPT)`.

    Raises:
        CMakeError: with file and line, for everything that is wrong.
    """
    interpreter = _interpreter(settings)
    if one.kind == "code":
        interpreter.run_text(one.source, "install(CODE)")
    else:
        interpreter.run_file(one.source)


def _interpreter(settings: Mapping[str, str]) -> Interpreter:
    """One for scripts, which have no targets, with variables set."""
    folder = os.getcwd()
    names = ("SOURCE_DIR", "BINARY_DIR", "CURRENT_SOURCE_DIR", "CURRENT_BINARY_DIR")
    variables = {f"CMAKE_{name}": folder for name in names}

    def check(command: Command) -> None:
        if command.name not in BUILTIN_COMMANDS:
            raise interpreter.error(command, f'Unknown CMake command "{command.written_name}".')

    def beyond(command: Command, what: str) -> None:
        raise interpreter.error(command, f"only CMake itself knows {what}; install it")

    def message(command: Command, words: list[str]) -> None:
        kind, text = read_message(words)
        if kind is Kind.ERROR:
            raise interpreter.error(command, text)
        if kind is Kind.STATUS:
            print(f"-- {text}", flush=True)
        elif kind is Kind.NOTICE:
            print(text, file=sys.stderr, flush=True)
        elif kind is Kind.WARNING:
            place = f"{interpreter.file}:{command.line} ({command.written_name})"
            print(f"CMake Warning at {place}:\n  {text}\n\n", file=sys.stderr, flush=True)

    interpreter = Interpreter(
        Scope({**variables, "UNIX": "1"}, settings, os.environ),
        {"message": message},
        check=check,
        beyond=beyond,
    )
    return interpreter


def _run_tool(name: str, words: list[str]) -> int:
    tool = _TOOLS.get(name)
    if tool is None:
        raise _Failed(f"cmake -E {name} is not known to the cmake of pipros. Install CMake for it")
    try:
        return tool(words) or 0
    except (IndexError, ValueError):
        raise _Failed(f"cmake -E {name}: these arguments make no sense: {' '.join(words)}") from None


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
    os.replace(source, target)


def _create_symlink(words: list[str]) -> None:
    source, target = words
    remove(target, is_recursive=False)
    os.symlink(source, target)


def _echo(words: list[str], *, end: str = "\n") -> None:
    print(" ".join(words), end=end, flush=True)


def _cat(words: list[str]) -> None:
    for word in words:
        print(Path(word).read_text("utf-8", "replace"), end="", flush=True)


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


if __name__ == "__main__":
    sys.exit(main())
