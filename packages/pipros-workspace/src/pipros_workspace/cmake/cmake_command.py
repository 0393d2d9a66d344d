"""Replacement for the program `cmake` if CMake is not installed: `cmake -E tool …` and `cmake -P script`.

Packages' custom commands use `cmake` to copy files and run programs.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence

from pipros.basics.errors import PiprosError
from pipros.basics.windows import with_slashes
from pipros_workspace.cmake.interpreter import Interpreter
from pipros_workspace.cmake.language import Command
from pipros_workspace.cmake.message import MessageKind, read_message
from pipros_workspace.cmake.names import BUILTIN_COMMANDS
from pipros_workspace.cmake.scope import Scope
from pipros_workspace.cmake.tools import run_tool


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program and return its exit code."""
    words = list(sys.argv[1:] if argv is None else argv)
    try:
        if words[:1] == ["-E"] and len(words) > 1:
            return run_tool(words[1], words[2:])
        if "-P" in words[:-1]:
            place = words.index("-P")
            return run_script(words[place + 1], words[:place], ["cmake", *words])
    except (PiprosError, OSError) as error:
        print(error, file=sys.stderr)
        return 1
    print("pipros's cmake supports only -E and -P. Install CMake to use other options", file=sys.stderr)
    return 1


def run_script(file: str, settings: Sequence[str] = (), arguments: Sequence[str] = ()) -> int:
    """Execute a script, and return 0.

    Args:
        settings: command-line options `-DNAME=VALUE`.
        arguments: the values of `CMAKE_ARGV0`, `CMAKE_ARGV1`, …

    Raises:
        CMakeError: the script is malformed, or a command in it fails.
    """
    variables = {
        "CMAKE_COMMAND": with_slashes(sys.argv[0]),
        "CMAKE_SCRIPT_MODE_FILE": with_slashes(os.path.abspath(file)),
        "CMAKE_ARGC": str(len(arguments)),
        **{f"CMAKE_ARGV{number}": word for number, word in enumerate(arguments)},
    }
    for setting in settings:
        name, sign, value = setting.removeprefix("-D").partition("=")
        if setting.startswith("-D") and sign:
            variables[name.partition(":")[0]] = value
    script_interpreter(variables).run_file(os.path.abspath(file))
    return 0


def script_interpreter(settings: Mapping[str, str]) -> Interpreter:
    """Return an interpreter for scripts, which do not have targets.

    Args:
        settings: the initial cache entries.
    """
    folder = with_slashes(os.getcwd())
    names = ("SOURCE_DIR", "BINARY_DIR", "CURRENT_SOURCE_DIR", "CURRENT_BINARY_DIR")
    variables = {f"CMAKE_{name}": folder for name in names}

    def check(command: Command) -> None:
        if command.name not in BUILTIN_COMMANDS:
            raise interpreter.error(command, f'Unknown CMake command "{command.written_name}".')

    def fail_without_cmake(command: Command, what: str) -> None:
        raise interpreter.error(command, f"{what} needs CMake, which is not installed")

    def message(command: Command, words: list[str]) -> None:
        kind, text = read_message(words)
        if kind is MessageKind.ERROR:
            raise interpreter.error(command, text)
        if kind is MessageKind.STATUS:
            print(f"-- {text}", flush=True)
        elif kind is MessageKind.NOTICE:
            print(text, file=sys.stderr, flush=True)
        elif kind is MessageKind.WARNING:
            place = f"{interpreter.file}:{command.line} ({command.written_name})"
            print(f"CMake Warning at {place}:\n  {text}\n\n", file=sys.stderr, flush=True)

    interpreter = Interpreter(
        Scope({**variables, "UNIX": "1"}, settings, os.environ),
        {"message": message},
        check=check,
        on_unsupported=fail_without_cmake,
    )
    return interpreter


if __name__ == "__main__":
    sys.exit(main())
