"""The CMake commands that need only the current scope, keyed by name."""

from __future__ import annotations

import ast
import operator
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from pipros.basics.input_file import read_file
from pipros.basics.limits import process_limits
from pipros.basics.replaced_file import write_whole
from pipros.basics.windows import with_slashes
from pipros.safe.expr import EXPRESSION_CHARACTERS
from pipros_workspace.cmake import files, lists, strings, variables
from pipros_workspace.cmake.configure import configure_file
from pipros_workspace.cmake.scope import Scope, ValueCommand
from pipros_workspace.cmake.words import options_of


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
    slim = path[:1] + re.sub("//+", "/", path[1:])  # //server has two slashes
    folder = (slim.rstrip("/") or "/").rpartition("/")[0]
    if len(folder) < len("C:/") and (drive := re.match("[A-Za-z]:/", slim)):
        folder = drive[0]
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


_VALUES = (
    "WORKING_DIRECTORY", "TIMEOUT", "RESULT_VARIABLE", "RESULTS_VARIABLE", "OUTPUT_VARIABLE",
    "ERROR_VARIABLE", "INPUT_FILE", "OUTPUT_FILE", "ERROR_FILE", "COMMAND_ECHO", "ENCODING",
    "COMMAND_ERROR_IS_FATAL",
)  # fmt: skip
_SWITCHES = (
    "OUTPUT_QUIET", "ERROR_QUIET", "OUTPUT_STRIP_TRAILING_WHITESPACE", "ERROR_STRIP_TRAILING_WHITESPACE",
    "ECHO_OUTPUT_VARIABLE", "ECHO_ERROR_VARIABLE",
)  # fmt: skip


def execute_process(words: list[str], scope: Scope) -> None:
    """Execute `execute_process(words)`. The output of each command is the input of the next command.

    Raises:
        ValueError: there is no command, or a command failed and `COMMAND_ERROR_IS_FATAL` is given.
    """
    commands, options, switches = _sort(words)
    if not commands or not all(commands):
        raise ValueError("called with no COMMAND")
    output, errors, results = _run(commands, options, scope)
    variables = {"OUTPUT_VARIABLE": output, "ERROR_VARIABLE": errors}
    if options.get("OUTPUT_VARIABLE", "") == options.get("ERROR_VARIABLE"):
        variables = {"OUTPUT_VARIABLE": output + errors}
    for key, text in variables.items():
        if key in options:
            stripped = key.replace("VARIABLE", "STRIP_TRAILING_WHITESPACE") in switches
            scope.values[options[key]] = text.rstrip() if stripped else text
    if "RESULT_VARIABLE" in options:
        scope.values[options["RESULT_VARIABLE"]] = results[-1]
    if "RESULTS_VARIABLE" in options:
        scope.values[options["RESULTS_VARIABLE"]] = ";".join(results)
    for key, text in (("OUTPUT_FILE", output), ("ERROR_FILE", errors)):
        if key in options:
            write_whole(Path(scope.in_binary(options[key])), text.encode())
    if not {"OUTPUT_VARIABLE", "OUTPUT_FILE"} & options.keys() and "OUTPUT_QUIET" not in switches:
        print(output, end="", flush=True)
    if not {"ERROR_VARIABLE", "ERROR_FILE"} & options.keys() and "ERROR_QUIET" not in switches:
        print(errors, end="", file=sys.stderr, flush=True)
    ended = list(zip(commands, results, strict=True)) if "COMMAND_ERROR_IS_FATAL" in options else []
    for command, result in ended[-1:] if options.get("COMMAND_ERROR_IS_FATAL") == "LAST" else ended:
        if result != "0":
            raise ValueError(f"the command [{' '.join(command)}] failed: {errors.strip() or result}")


def _sort(words: list[str]) -> tuple[list[list[str]], dict[str, str], set[str]]:
    commands: list[list[str]] = []
    options: dict[str, str] = {}
    switches: set[str] = set()
    rest = list(words)
    while rest:
        word = rest.pop(0)
        if word == "COMMAND":
            commands.append([])
        elif word in _SWITCHES:
            switches.add(word)
        elif word in _VALUES and rest:
            options[word] = rest.pop(0)
        elif commands:
            commands[-1].append(word)
    return commands, options, switches


def _run(commands: list[list[str]], options: dict[str, str], scope: Scope) -> tuple[str, str, list[str]]:
    """Run a pipeline. Return the output, the error output, and an exit code or error for each command."""
    folder = scope.in_binary(options.get("WORKING_DIRECTORY", ""))
    data = b""
    if "INPUT_FILE" in options:
        data = read_file(scope.in_source(options["INPUT_FILE"]), process_limits().file_bytes)
    errors, results = b"", []
    for command in commands:
        try:
            ended = subprocess.run(  # noqa: S603
                command,
                cwd=folder or None,
                env=scope.environment,
                input=data,
                capture_output=True,
                timeout=float(options["TIMEOUT"]) if "TIMEOUT" in options else None,
                check=False,
            )
        except subprocess.TimeoutExpired:
            data, result = b"", "Process terminated due to timeout"
        except OSError as error:
            data, result = b"", error.strerror or str(error)
        else:
            data, result = ended.stdout, str(ended.returncode)
            errors += ended.stderr
        results.append(result)
    return data.decode("utf-8", "replace"), errors.decode("utf-8", "replace"), results


_TWO_TO_63 = 2**63
_LEADING_ZEROS = re.compile(r"\b0+(?=[0-9])")


def math(words: list[str], scope: Scope) -> None:
    """Execute `math(EXPR variable expression [OUTPUT_FORMAT …])`.

    Raises:
        ValueError: the expression is malformed, or divides by zero.
    """
    if words[:1] != ["EXPR"] or len(words) < 3:
        raise ValueError("must have the form math(EXPR variable expression)")
    # This also limits the nesting; the depth at which Python's parser fails differs between processes.
    limit = EXPRESSION_CHARACTERS
    if len(words[2]) > limit:
        raise ValueError(f"the expression has {len(words[2])} characters; the limit is {limit} characters")
    try:
        # Unlike in Python, leading zeros are allowed.
        text = _LEADING_ZEROS.sub("", words[2].strip())
        value = _value(ast.parse(text, mode="eval").body)
    # the parser raises MemoryError if the expression is nested too deeply
    except (SyntaxError, RecursionError, MemoryError):
        raise ValueError(f'cannot parse the expression: "{words[2]}"') from None
    except ZeroDivisionError:
        raise ValueError(f"divide by zero in: {words[2]}") from None
    value = (value + _TWO_TO_63) % (2 * _TWO_TO_63) - _TWO_TO_63
    is_hexadecimal = words[3:] == ["OUTPUT_FORMAT", "HEXADECIMAL"]
    scope.values[words[1]] = hex(value % (2 * _TWO_TO_63)) if is_hexadecimal else str(value)


_BINARY: Mapping[type, Callable[[int, int], int]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: lambda left, right: abs(left) // abs(right) * (1 if (left < 0) == (right < 0) else -1),
    ast.Mod: lambda left, right: abs(left) % abs(right) * (-1 if left < 0 else 1),
    ast.BitOr: operator.or_,
    ast.BitAnd: operator.and_,
    ast.BitXor: operator.xor,
    # Processors use only the lowest six bits of the shift count.
    ast.LShift: lambda left, right: left << (right & 63),
    ast.RShift: lambda left, right: left >> (right & 63),
}


def _value(node: Any) -> int:
    match node:
        case ast.Constant(value=int(number)) if not isinstance(number, bool):
            if number >= _TWO_TO_63:
                raise ValueError(f"a numeric value is out of range: {number}")
            return number
        case ast.BinOp() if type(node.op) in _BINARY:
            return _BINARY[type(node.op)](_value(node.left), _value(node.right))
        case ast.UnaryOp(op=ast.USub()):
            return -_value(node.operand)
        case ast.UnaryOp(op=ast.UAdd()):
            return _value(node.operand)
        case ast.UnaryOp(op=ast.Invert()):
            return ~_value(node.operand)
    raise ValueError("the expression must consist of integers, + - * / % | & ^ ~ << >> and parentheses")


VALUE_COMMANDS: Mapping[str, ValueCommand] = {
    "cmake_parse_arguments": variables.cmake_parse_arguments,
    "configure_file": configure_file,
    "execute_process": execute_process,
    "file": files.carry_out,
    "find_file": find_file,
    "find_path": find_path,
    "find_program": find_program,
    "get_filename_component": get_filename_component,
    "get_property": variables.get_property,
    "list": lists.carry_out,
    "math": math,
    "option": variables.option,
    "separate_arguments": strings.separate_arguments,
    "set": variables.set_variable,
    "set_property": variables.set_property,
    "string": strings.carry_out,
    "unset": variables.unset,
}
