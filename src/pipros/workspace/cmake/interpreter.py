"""Carries out the language part of CMake: variables, conditions, loops, functions, included files.

Commands that are not of the language are given to `actions`. Loops and calls are bounded.
"""

from __future__ import annotations

import enum
import os
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from contextlib import contextmanager

from pipros.workspace.cmake import files, language, lists, paths, strings
from pipros.workspace.cmake.condition import is_true
from pipros.workspace.cmake.configure import configure_file
from pipros.workspace.cmake.language import CMakeError, Command, split_list
from pipros.workspace.cmake.loops import rounds
from pipros.workspace.cmake.names import BUILTIN_COMMANDS, CATKIN_COMMANDS
from pipros.workspace.cmake.processes import execute_process
from pipros.workspace.cmake.scope import Scope, Unsupported, ValueCommand
from pipros.workspace.cmake.settings import (
    cmake_parse_arguments,
    get_property,
    option,
    set_property,
    set_variable,
    unset,
)

LOOP_LIMIT = 100_000
"""Rounds of one loop; more is a loop without an end."""

DEPTH_LIMIT = 50
"""Files and functions within each other; more is a function that calls itself."""

Action = Callable[[Command, list[str]], None]
"""What a command means: gets the command and its arguments as words."""


class _Flow(enum.Enum):
    """What comes after a command."""

    NEXT = enum.auto()
    BREAK = enum.auto()
    CONTINUE = enum.auto()
    RETURN = enum.auto()


_JUMPS = {"break": _Flow.BREAK, "continue": _Flow.CONTINUE, "return": _Flow.RETURN}
_BLOCKS = ("if", "foreach", "while", "function", "macro", "block")

_VALUE_COMMANDS: Mapping[str, ValueCommand] = {
    "cmake_parse_arguments": cmake_parse_arguments,
    "configure_file": configure_file,
    "execute_process": execute_process,
    "file": files.carry_out,
    "find_file": paths.find_file,
    "find_path": paths.find_path,
    "find_program": paths.find_program,
    "get_filename_component": paths.get_filename_component,
    "get_property": get_property,
    "list": lists.carry_out,
    "math": strings.math,
    "option": option,
    "separate_arguments": strings.separate_arguments,
    "set": set_variable,
    "set_property": set_property,
    "string": strings.carry_out,
    "unset": unset,
}


class Interpreter:
    """Carries out files.

    Attributes:
        scope: the variables of the moment.
        file: the file that is being carried out.
    """

    def __init__(
        self,
        scope: Scope,
        actions: Mapping[str, Action],
        *,
        check: Callable[[Command], None],
        beyond: Callable[[Command, str], None],
        targets: Container[str] = (),
    ) -> None:
        """Nothing is read yet.

        Args:
            actions: what commands mean, by their names in lower case.
            check: called before a command that is no function of the file; raises when it is unknown.
            beyond: called for what only the real CMake can do, with the words for it.
            targets: the names that exist, for `if(TARGET name)`.
        """
        self.scope = scope
        self.file = ""
        self._targets = targets
        self._actions = {**actions, "include": self._include, "add_subdirectory": self._add_subdirectory}
        self._check = check
        self._beyond = beyond
        self._functions: dict[str, tuple[bool, list[str], list[Command], str]] = {}
        self._guarded: set[str] = set()
        self._depth = 0

    def run_file(self, file: str) -> None:
        """Carries out a file, in the folders and variables of the moment.

        Raises:
            CMakeError: with file and line, for everything that is wrong.
        """
        try:
            with open(file, encoding="utf-8", errors="replace") as opened:
                text = opened.read()
        except OSError as error:
            raise CMakeError(file, 0, "", f"cannot be read: {error.strerror}") from None
        self.run_text(text, file)

    def run_text(self, text: str, file: str) -> None:
        """Carries out a text as if it stood in that file."""
        commands = language.parse(text, file)
        with self._in_file(file, commands[0] if commands else None):
            self._run(commands)

    @contextmanager
    def _in_file(self, file: str, command: Command | None) -> Iterator[None]:
        """What is carried out meanwhile is of that file, and one deeper."""
        if self._depth >= DEPTH_LIMIT and command is not None:
            raise self.error(command, f"calls are nested more than {DEPTH_LIMIT} deep")
        values = self.scope.values
        names = ("CMAKE_CURRENT_LIST_FILE", "CMAKE_CURRENT_LIST_DIR")
        before = self.file, [values.get(name, "") for name in names]
        self.file = file
        self._depth += 1
        values.update(zip(names, (file, os.path.dirname(file)), strict=True))
        try:
            yield
        finally:
            self._depth -= 1
            self.file, folders = before
            values.update(zip(names, folders, strict=True))

    def _run(self, commands: Sequence[Command]) -> _Flow:
        """Carries commands out, up to the one that ends this loop, function or file."""
        position = 0
        while position < len(commands):
            command = commands[position]
            flow = _Flow.NEXT
            if command.name in _BLOCKS:
                end = self._end_of_block(commands, position)
                flow = self._run_block(command, commands[position + 1 : end])
                position = end
            elif command.name == "include_guard":
                flow = _Flow.RETURN if self.file in self._guarded else _Flow.NEXT
                self._guarded.add(self.file)
            elif command.name in _JUMPS:
                flow = self._jump(command)
            else:
                flow = self._run_command(command)
            if flow is not _Flow.NEXT:
                return flow
            position += 1
        return _Flow.NEXT

    def _jump(self, command: Command) -> _Flow:
        words = self.words(command)
        if words[:1] == ["PROPAGATE"]:
            for name in words[1:]:
                self.scope.set_in_parent(name, self.scope.values.get(name))
        return _JUMPS[command.name]

    def _end_of_block(self, commands: Sequence[Command], start: int) -> int:
        name = commands[start].name
        depth = 0
        for position in range(start, len(commands)):
            depth += commands[position].name == name
            depth -= commands[position].name == f"end{name}"
            if depth == 0:
                return position
        raise self.error(commands[start], f"A logical block is not closed; end{name}() is missing")

    def _run_block(self, opening: Command, body: Sequence[Command]) -> _Flow:
        if opening.name in ("function", "macro"):
            name, *parameters = self.words(opening) or [""]
            self._functions[name.lower()] = (opening.name == "function", parameters, list(body), self.file)
            return _Flow.NEXT
        if opening.name == "foreach":
            return self._run_foreach(opening, body)
        if opening.name == "while":
            return self._run_while(opening, body)
        if opening.name == "block":
            with self.scope.inner():
                return self._run(body)
        return self._run_if(opening, body)

    def _run_if(self, opening: Command, body: Sequence[Command]) -> _Flow:
        depth, branch_start, branch = 0, 0, opening
        for position, command in enumerate([*body, Command("else", "else", (), opening.line)]):
            depth += command.name == "if"
            depth -= command.name == "endif"
            if depth or command.name not in ("elseif", "else"):
                continue
            if branch.name == "else" or self._holds(branch):
                return self._run(body[branch_start:position])
            branch, branch_start = command, position + 1
        return _Flow.NEXT

    def _holds(self, command: Command) -> bool:
        values, environment = self.scope.values, self.scope.environment
        words: list[tuple[str, bool]] = []
        for argument in command.arguments:
            if argument.is_quoted:
                words += [(word, True) for word in language.expand([argument], values, environment)]
            elif argument.text in ("(", ")"):
                words.append((argument.text, False))
            else:
                words += [(word, False) for word in language.expand([argument], values, environment)]
        known = BUILTIN_COMMANDS | CATKIN_COMMANDS.keys() | self._functions.keys()
        try:
            return is_true(words, values, known, self._targets, environment)
        except ValueError as error:
            raise self.error(command, str(error)) from None

    def _run_foreach(self, opening: Command, body: Sequence[Command]) -> _Flow:
        try:
            names, all_rounds = rounds(self.words(opening), self.scope.values)
        except (ValueError, IndexError) as error:
            raise self.error(opening, f"given arguments that make no sense: {error}") from None
        values = self.scope.values
        before = {name: values.get(name) for name in names}
        flow = _Flow.NEXT
        for number, elements in enumerate(all_rounds):
            if number >= LOOP_LIMIT:
                raise self.error(opening, f"the loop goes on for more than {LOOP_LIMIT} rounds")
            values.update(zip(names, elements, strict=True))
            flow = self._run(body)
            if flow in (_Flow.BREAK, _Flow.RETURN):
                break
        for name, value in before.items():
            if value is None:
                self.scope.unset(name)
            else:
                values[name] = value
        return _Flow.RETURN if flow is _Flow.RETURN else _Flow.NEXT

    def _run_while(self, opening: Command, body: Sequence[Command]) -> _Flow:
        for _ in range(LOOP_LIMIT):
            if not self._holds(opening):
                return _Flow.NEXT
            flow = self._run(body)
            if flow is _Flow.RETURN:
                return flow
            if flow is _Flow.BREAK:
                return _Flow.NEXT
        raise self.error(
            opening, f"the loop goes on for more than {LOOP_LIMIT} rounds; can its condition end it?"
        )

    def _run_command(self, command: Command) -> _Flow:
        words = self.words(command)
        if command.name in self._functions:
            return self._call(command, words)
        self._check(command)
        computes = _VALUE_COMMANDS.get(command.name)
        if computes is not None:
            try:
                computes(words, self.scope)
            except Unsupported as error:
                self._beyond(command, str(error))
            except ValueError as error:
                raise self.error(command, str(error)) from None
        elif command.name in self._actions:
            self._actions[command.name](command, words)
        return _Flow.NEXT

    def _call(self, command: Command, words: list[str]) -> _Flow:
        is_function, parameters, body, file = self._functions[command.name]
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
        with self._in_file(file, command):
            if is_function:
                with self.scope.inner():
                    self.scope.values.update(arguments)
                    self._run(body)
                return _Flow.NEXT
            # What a macro is given are no variables in CMake, and not there any more afterwards.
            before = {name: self.scope.values.get(name) for name in arguments}
            self.scope.values.update(arguments)
            flow = self._run(body)
            for name, value in before.items():
                if value is None:
                    self.scope.unset(name)
                else:
                    self.scope.values[name] = value
            return flow

    def _include(self, command: Command, words: list[str]) -> None:
        if not words:
            raise self.error(command, "include() called with no file")
        places = [self.scope.in_source(""), *split_list(self.scope.values.get("CMAKE_MODULE_PATH", ""))]
        names = [words[0], f"{words[0]}.cmake"]
        for path in (os.path.join(place, name) for place in places for name in names):
            if os.path.isfile(path):
                self.run_file(path)
                return
        if "/" not in words[0] and not words[0].endswith(".cmake"):
            if "include_module" in self._actions:
                self._actions["include_module"](command, words)
        elif "OPTIONAL" not in words:
            raise self.error(command, f"include could not find requested file:\n\n    {words[0]}")

    def _add_subdirectory(self, command: Command, words: list[str]) -> None:
        path = self.scope.in_source(words[0] if words else "")
        if not os.path.isfile(os.path.join(path, "CMakeLists.txt")):
            raise self.error(command, f"The source directory {path} does not contain a CMakeLists.txt file")
        binary = self.scope.in_binary(words[1] if len(words) > 1 else words[0])
        with self.scope.inner():
            self.scope.values["CMAKE_CURRENT_SOURCE_DIR"] = path
            self.scope.values["CMAKE_CURRENT_BINARY_DIR"] = binary
            self.run_file(os.path.join(path, "CMakeLists.txt"))

    def words(self, command: Command) -> list[str]:
        """The arguments of a command with variables replaced and lists split."""
        return language.expand(command.arguments, self.scope.values, self.scope.environment)

    def error(self, command: Command, reason: str) -> CMakeError:
        """An error at a command of the file that is being carried out."""
        return CMakeError(self.file, command.line, command.written_name, reason)
