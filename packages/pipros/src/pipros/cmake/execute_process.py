"""The command `execute_process()`, which runs programs without a shell while a `CMakeLists.txt` is read."""

from __future__ import annotations

import subprocess
import sys

from pipros.basics.input_file import read_file
from pipros.cmake.scope import Scope

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
            with open(scope.in_binary(options[key]), "w", encoding="utf-8") as file:
                file.write(text)
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
        data = read_file(scope.in_source(options["INPUT_FILE"]), scope.limits.file_bytes)
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
