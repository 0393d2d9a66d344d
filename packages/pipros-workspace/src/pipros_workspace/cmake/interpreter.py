"""Interpreter for CMake files: conditions, loops, functions, included files and folders, and commands.

Commands that need only the scope are in `value_commands.py`; other commands are passed in as actions.
`Limits` bounds the number of loop iterations, the call depth and the number of commands.
"""

from __future__ import annotations

import enum
import os
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from pipros.basics.input_file import read_text
from pipros.basics.limits import process_limits
from pipros.basics.windows import with_slashes
from pipros_workspace.cmake import language
from pipros_workspace.cmake.blocks import BLOCKS, branches, end_of_block
from pipros_workspace.cmake.condition import is_true
from pipros_workspace.cmake.language import CMakeError, Command, CommandArgument, split_list
from pipros_workspace.cmake.loops import rounds
from pipros_workspace.cmake.names import BUILTIN_COMMANDS
from pipros_workspace.cmake.scope import CMAKE_VALUE_CHARACTERS, Scope, Unsupported
from pipros_workspace.cmake.value_commands import VALUE_COMMANDS
from pipros_workspace.cmake.words import options_of, sections

CMAKE_STEPS = 2_000_000
"""Limit: commands and loop iterations that one package's `CMakeLists.txt` executes. Beyond it, the build of
the package fails; the error names the file and line.
"""
CMAKE_ROUNDS = 100_000
"""Limit: iterations of one loop in a `CMakeLists.txt`. Beyond it, the build of the package fails; the error
names the file and line.
"""
CMAKE_DEPTH = 50
"""Limit: nesting of a package's CMake files and functions. Beyond it, the build of the package fails; the
error names the file and line.
"""

_MISTAKES = (ArithmeticError, LookupError, OSError, RecursionError, TypeError, ValueError)
"""Exceptions that a command may raise if its arguments are wrong."""

Action = Callable[[Command, list[str]], None]
"""Implementation of a command. It is called with the command and its arguments as words.

May raise `Unsupported`, or ValueError and other built-in errors for wrong arguments.
"""


class _Flow(enum.Enum):
    """How execution continues after a command."""

    NEXT = enum.auto()
    BREAK = enum.auto()
    CONTINUE = enum.auto()
    RETURN = enum.auto()


_CLOSINGS = frozenset((*(f"end{name}" for name in BLOCKS), "else", "elseif"))
_JUMPS = {"break": _Flow.BREAK, "continue": _Flow.CONTINUE, "return": _Flow.RETURN}


@dataclass(frozen=True, slots=True)
class _Function:
    """A `function()` or `macro()`, with the file that defines it."""

    is_macro: bool
    parameters: Sequence[str]
    body: Sequence[Command]
    file: str


class Interpreter:
    """Executes CMake files.

    Attributes:
        scope: the current variables.
        file: the file being executed.
    """

    def __init__(
        self,
        scope: Scope,
        actions: Mapping[str, Action],
        *,
        check: Callable[[Command], None],
        on_unsupported: Callable[[Command, str], None],
        include_module: Callable[[str], None] = lambda _name: None,
        commands: Container[str] = (),
        targets: Container[str] = (),
        forgives: Callable[[CMakeError], bool] = lambda _error: False,
    ) -> None:
        """Store the arguments without executing a file.

        Args:
            actions: implementations of commands, by name in lower case.
            check: called before each command, except functions and macros defined in a file. Must raise
                `CMakeError` if the command is unknown.
            on_unsupported: called with a command, and a description of the feature that only CMake provides.
            include_module: called with the name of each included module for which no file was found.
            commands: further names for which `if(COMMAND name)` is true, besides CMake's own commands and
                the functions and macros defined so far.
            targets: the names for which `if(TARGET name)` is true.
            forgives: called with each error. If it returns True, execution continues after the command.
        """
        self.scope = scope
        self.file = ""
        self._commands = commands
        self._targets = targets
        self._actions = {**actions, "include": self._include, "add_subdirectory": self._add_subdirectory}
        self._check = check
        self._on_unsupported = on_unsupported
        self._include_module = include_module
        self._forgives = forgives
        self._functions: dict[str, _Function] = {}
        self._guarded: set[str] = set()
        self._depth = 0
        self._steps = 0

    def run_file(self, file: str) -> None:
        """Execute a file with the current folders and variables.

        Raises:
            CMakeError: the file cannot be read or contains an error. The message names the file and line.
        """
        try:
            text = read_text(file, process_limits().file_bytes, errors="replace")
        except OSError as error:
            raise CMakeError(file, 0, "", f"the file cannot be read: {error.strerror}") from None
        self.run_text(text, file)

    def run_text(self, text: str, file: str) -> None:
        """Execute source text as if it were the contents of `file`.

        Raises:
            CMakeError: the text contains an error. The message names the file and line.
        """
        commands = language.parse(text, file)
        with self._in_file(file, commands[0] if commands else None):
            self._run(commands)

    @contextmanager
    def _in_file(self, file: str, command: Command | None) -> Iterator[None]:
        """Make `file` the current file. Raises CMakeError if calls are nested too deeply."""
        limit = CMAKE_DEPTH
        if self._depth >= limit and command is not None:
            raise self.error(command, f"calls are nested more than {limit} deep")
        values = self.scope.values
        names = ("CMAKE_CURRENT_LIST_FILE", "CMAKE_CURRENT_LIST_DIR")
        before = self.file, [values.get(name, "") for name in names]
        self.file = file
        self._depth += 1
        listed = with_slashes(file)
        values.update(zip(names, (listed, os.path.dirname(listed)), strict=True))
        try:
            yield
        finally:
            self._depth -= 1
            self.file, folders = before
            values.update(zip(names, folders, strict=True))

    def _run(self, commands: Sequence[Command]) -> _Flow:
        """Execute commands until one of them changes the control flow. Return how execution continues."""
        position = 0
        while position < len(commands):
            command = commands[position]
            self._count_step(command)
            end = end_of_block(commands, position) if command.name in BLOCKS else position
            if end is None:
                raise self.error(command, f"A logical block is not closed; end{command.name}() is missing")
            try:
                flow = self._run_one(command, commands[position + 1 : end])
            except (CMakeError, *_MISTAKES) as error:
                problem = error if isinstance(error, CMakeError) else self.error(command, str(error))
                if not self._forgives(problem):
                    raise problem from None
                flow = _Flow.NEXT
            position = end
            if flow is not _Flow.NEXT:
                return flow
            position += 1
        return _Flow.NEXT

    def _run_one(self, command: Command, body: Sequence[Command]) -> _Flow:
        if command.name in BLOCKS:
            return self._run_block(command, body)
        if command.name == "include_guard":
            is_guarded = self.file in self._guarded
            self._guarded.add(self.file)
            return _Flow.RETURN if is_guarded else _Flow.NEXT
        return self._jump(command) if command.name in _JUMPS else self._run_command(command)

    def _count_step(self, command: Command) -> None:
        self._steps += 1
        limit = CMAKE_STEPS
        if self._steps > limit:
            raise self.error(command, f"more than {limit} commands were executed; is there an endless loop?")

    def _jump(self, command: Command) -> _Flow:
        words = self.words(command)
        if words[:1] == ["PROPAGATE"]:
            for name in words[1:]:
                self.scope.set_in_parent(name, self.scope.values.get(name))
        return _JUMPS[command.name]

    def _run_block(self, opening: Command, body: Sequence[Command]) -> _Flow:
        if opening.name in ("function", "macro"):
            name, *parameters = self.words(opening) or [""]
            if not name:
                raise self.error(opening, "called with incorrect number of arguments")
            self._functions[name.lower()] = _Function(opening.name == "macro", parameters, body, self.file)
            return _Flow.NEXT
        if opening.name == "foreach":
            return self._run_foreach(opening, body)
        if opening.name == "while":
            return self._run_while(opening, body)
        if opening.name == "block":
            return self._run_inner_block(opening, body)
        return self._run_if(opening, body)

    def _run_inner_block(self, opening: Command, body: Sequence[Command]) -> _Flow:
        options = sections(self.words(opening), ("SCOPE_FOR", "PROPAGATE"))
        if options["SCOPE_FOR"] and "VARIABLES" not in options["SCOPE_FOR"]:
            return self._run(body)
        with self.scope.inner():
            flow = self._run(body)
            for name in options["PROPAGATE"]:
                self.scope.set_in_parent(name, self.scope.values.get(name))
            return flow

    def _run_if(self, opening: Command, body: Sequence[Command]) -> _Flow:
        for branch, commands in branches(opening, body):
            if branch.name == "else" or self._holds(branch):
                return self._run(commands)
        return _Flow.NEXT

    def _holds(self, command: Command) -> bool:
        values, environment = self.scope.values, self.scope.environment
        words: list[tuple[str, bool]] = []
        for argument in command.arguments:
            if argument.is_quoted:
                words += [(word, True) for word in self._expanded([argument], command)]
            elif argument.text in ("(", ")"):
                words.append((argument.text, False))
            else:
                words += [(word, False) for word in self._expanded([argument], command)]
        try:
            names = _Names(self._functions, self._commands)
            return is_true(words, values, names, self._targets, environment, self.scope.cache)
        except ValueError as error:
            raise self.error(command, str(error)) from None

    def _run_foreach(self, opening: Command, body: Sequence[Command]) -> _Flow:
        try:
            names, all_rounds = rounds(self.words(opening), self.scope.values)
        except (ValueError, IndexError) as error:
            raise self.error(opening, f"called with wrong arguments: {error}") from None
        limit = CMAKE_ROUNDS
        with self.scope.restored(names):
            for number, elements in enumerate(all_rounds):
                if number >= limit:
                    raise self.error(opening, f"the loop exceeds the limit of {limit} iterations")
                self._count_step(opening)  # nested loops with empty bodies must be counted, too
                self.scope.values.update(zip(names, elements, strict=True))
                flow = self._run(body)
                if flow is _Flow.RETURN:
                    return flow
                if flow is _Flow.BREAK:
                    break
        return _Flow.NEXT

    def _run_while(self, opening: Command, body: Sequence[Command]) -> _Flow:
        if not opening.arguments:
            raise self.error(opening, "called with incorrect number of arguments")
        limit = CMAKE_ROUNDS
        for _ in range(limit):
            if not self._holds(opening):
                return _Flow.NEXT
            self._count_step(opening)
            flow = self._run(body)
            if flow is _Flow.RETURN:
                return flow
            if flow is _Flow.BREAK:
                return _Flow.NEXT
        raise self.error(
            opening, f"the loop exceeds the limit of {limit} iterations; is its condition ever false?"
        )

    def _run_command(self, command: Command) -> _Flow:
        words = self.words(command)
        if command.name in self._functions:
            return self._call(command, words)
        if command.name in _CLOSINGS:
            raise self.error(command, "Flow control statements are not properly nested.")
        self._check(command)
        try:
            if command.name in VALUE_COMMANDS:
                VALUE_COMMANDS[command.name](words, self.scope)
            elif command.name in self._actions:
                self._actions[command.name](command, words)
        except Unsupported as error:
            self._on_unsupported(command, str(error))
        return _Flow.NEXT

    def _call(self, command: Command, words: list[str]) -> _Flow:
        function = self._functions[command.name]
        parameters = function.parameters
        if len(words) < len(parameters):
            raise self.error(
                command, f"called with incorrect number of arguments: it needs {' '.join(parameters)}"
            )
        arguments = {f"ARGV{number}": word for number, word in enumerate(words)}
        arguments |= dict(zip(parameters, words, strict=False))
        arguments |= {
            "ARGC": str(len(words)),
            "ARGV": ";".join(words),
            "ARGN": ";".join(words[len(parameters) :]),
        }
        # In CMake, the arguments of a macro are not variables, so they must not remain after the call.
        kept = self.scope.restored(arguments) if function.is_macro else self.scope.inner()
        with self._in_file(function.file, command), kept:
            self.scope.values.update(arguments)
            flow = self._run(function.body)
        return flow if function.is_macro else _Flow.NEXT

    def _include(self, command: Command, words: list[str]) -> None:
        if not words:
            raise self.error(command, "include() called with no file")
        options = options_of(words[1:], "RESULT_VARIABLE")
        folders = [self.scope.in_source(""), *split_list(self.scope.values.get("CMAKE_MODULE_PATH", ""))]
        names = [words[0], f"{words[0]}.cmake"]
        for path in (os.path.join(folder, name) for folder in folders for name in names):
            if os.path.isfile(path):
                if options:
                    self.scope.values[options["RESULT_VARIABLE"]] = with_slashes(path)
                self.run_file(path)
                return
        if options:
            self.scope.values[options["RESULT_VARIABLE"]] = "NOTFOUND"
        if "/" not in words[0] and not words[0].endswith(".cmake"):
            self._include_module(words[0])
        elif "OPTIONAL" not in words:
            raise self.error(command, f"include could not find requested file:\n\n    {words[0]}")

    def _add_subdirectory(self, command: Command, words: list[str]) -> None:
        if not words:
            raise self.error(command, "add_subdirectory needs the source directory")
        path = self.scope.in_source(words[0])
        if not os.path.isfile(os.path.join(path, "CMakeLists.txt")):
            raise self.error(command, f"The source directory {path} does not contain a CMakeLists.txt file")
        binary = self.scope.in_binary(words[1] if len(words) > 1 else words[0])
        with self.scope.inner():
            self.scope.values["CMAKE_CURRENT_SOURCE_DIR"] = path
            self.scope.values["CMAKE_CURRENT_BINARY_DIR"] = binary
            self.run_file(os.path.join(path, "CMakeLists.txt"))

    def words(self, command: Command) -> list[str]:
        """Return the arguments of a command, with variables replaced and lists split.

        Raises:
            CMakeError: the arguments are too long.
        """
        return self._expanded(command.arguments, command)

    def _expanded(self, arguments: Sequence[CommandArgument], command: Command) -> list[str]:
        scope = self.scope
        try:
            return language.expand(arguments, scope.values, scope.environment, CMAKE_VALUE_CHARACTERS)
        except ValueError as error:
            raise self.error(command, str(error)) from None

    def error(self, command: Command, reason: str) -> CMakeError:
        """Return an error that names the location of a command in the current file."""
        return CMakeError(self.file, command.line, command.written_name, reason)


class _Names:
    """The names for which `if(COMMAND name)` is true: CMake's own commands, and the names in `others`."""

    def __init__(self, *others: Container[str]) -> None:
        self._all = (BUILTIN_COMMANDS, *others)

    def __contains__(self, name: object) -> bool:
        return any(name in names for names in self._all)
