"""Carries out the language part of CMake: variables, conditions, loops, functions, included files.

Commands that are not of the language are given to `actions`. Loops are bounded; nothing outside of
the file is changed or run.
"""

from __future__ import annotations

import glob
import os
from collections.abc import Callable, Mapping, Sequence

from pipros.workspace import cmake
from pipros.workspace.cmake import CMakeError, Command
from pipros.workspace.cmake_condition import is_true
from pipros.workspace.cmake_names import BUILTIN_COMMANDS, CATKIN_COMMANDS

LOOP_LIMIT = 10_000
"""Rounds of one `foreach(… RANGE …)`."""

DEPTH_LIMIT = 50
"""Files and functions within each other; more is a function that calls itself."""

Action = Callable[[Command, list[str]], None]
"""What a command means: gets the command and its arguments as words."""


class Interpreter:
    """Carries out files.

    Attributes:
        variables: as they are at the moment.
        file: the file that is being carried out.
    """

    def __init__(
        self,
        variables: dict[str, str],
        environment: Mapping[str, str],
        actions: Mapping[str, Action],
        check: Callable[[Command], None],
        note: Callable[[str], None],
    ) -> None:
        """Nothing is read yet.

        Args:
            actions: what commands mean, by their names in lower case.
            check: called before a command that is no function of the file; raises when it is unknown.
            note: takes remarks about what is left out.
        """
        self.variables = variables
        self.file = ""
        self._environment = environment
        self._actions = {
            **actions,
            "set": self._set,
            "unset": self._unset,
            "option": self._option,
            "list": self._list,
            "file": self._glob,
            "include": self._include,
            "add_subdirectory": self._add_subdirectory,
        }
        self._check = check
        self._note = note
        self._macros: dict[str, tuple[list[str], list[Command]]] = {}
        self._depth = 0

    def run_file(self, file: str) -> None:
        """Carries out a file; its folder is the current source folder meanwhile."""
        try:
            with open(file, encoding="utf-8", errors="replace") as opened:
                text = opened.read()
        except OSError as error:
            raise CMakeError(file, 0, "", f"cannot be read: {error.strerror}") from None
        outer_file, self.file = self.file, file
        outer_folder = self.variables.get("CMAKE_CURRENT_SOURCE_DIR", "")
        folder = os.path.dirname(file)
        self.variables["CMAKE_CURRENT_SOURCE_DIR"] = folder
        self.variables["CMAKE_CURRENT_LIST_DIR"] = folder
        self._run(cmake.parse(text, file))
        self.variables["CMAKE_CURRENT_SOURCE_DIR"] = outer_folder
        self.file = outer_file

    def _run(self, commands: Sequence[Command]) -> bool:
        """Carries commands out; False when `return()` ended the file."""
        position = 0
        while position < len(commands):
            command = commands[position]
            if command.name in ("if", "foreach", "while", "function", "macro"):
                end = self._end_of_block(commands, position)
                if not self._run_block(command, commands[position + 1 : end]):
                    return False
                position = end + 1
                continue
            if command.name == "return":
                return False
            self._run_command(command)
            position += 1
        return True

    def _end_of_block(self, commands: Sequence[Command], start: int) -> int:
        name = commands[start].name
        depth = 0
        for position in range(start, len(commands)):
            depth += commands[position].name == name
            depth -= commands[position].name == f"end{name}"
            if depth == 0:
                return position
        raise self.error(commands[start], f"A logical block is not closed; end{name}() is missing")

    def _run_block(self, opening: Command, body: Sequence[Command]) -> bool:
        if opening.name in ("function", "macro"):
            name, *parameters = self.words(opening)
            self._macros[name.lower()] = (parameters, list(body))
            return True
        if opening.name == "foreach":
            return self._run_foreach(opening, body)
        if opening.name == "while":
            self._note(f"{self.file}:{opening.line} (while): loops with while() are left out")
            return True
        return self._run_if(opening, body)

    def _run_if(self, opening: Command, body: Sequence[Command]) -> bool:
        depth, branch_start, branch = 0, 0, opening
        for position, command in enumerate([*body, Command("else", "else", (), opening.line)]):
            depth += command.name == "if"
            depth -= command.name == "endif"
            if depth or command.name not in ("elseif", "else"):
                continue
            if branch.name == "else" or self._holds(branch):
                return self._run(body[branch_start:position])
            branch, branch_start = command, position + 1
        return True

    def _holds(self, command: Command) -> bool:
        written = [(argument.text, argument.is_quoted) for argument in command.arguments]
        words = [
            (cmake.expand_text(text, self.variables, self._environment), is_quoted)
            for text, is_quoted in written
        ]
        known = BUILTIN_COMMANDS | CATKIN_COMMANDS.keys() | self._macros.keys()
        try:
            return is_true(words, self.variables, known)
        except ValueError as error:
            raise self.error(command, str(error)) from None

    def _run_foreach(self, opening: Command, body: Sequence[Command]) -> bool:
        variable, *words = self.words(opening)
        if words[:1] == ["RANGE"]:
            first, last = (0, int(words[1])) if len(words) == 2 else (int(words[1]), int(words[2]))
            words = [str(number) for number in range(first, min(last, first + LOOP_LIMIT) + 1)]
        elif words[:1] == ["IN"]:
            kind, words = (words[1] if len(words) > 1 else ""), words[2:]
            if kind == "LISTS":
                words = [item for name in words for item in self.variables.get(name, "").split(";") if item]
        for word in words:
            self.variables[variable] = word
            if not self._run(body):
                return False
        return True

    def _run_command(self, command: Command) -> None:
        words = self.words(command)
        if command.name in self._macros:
            self._call(command, words)
            return
        self._check(command)
        action = self._actions.get(command.name)
        if action is not None:
            action(command, words)

    def _call(self, command: Command, words: list[str]) -> None:
        if self._depth >= DEPTH_LIMIT:
            raise self.error(command, f"calls are nested more than {DEPTH_LIMIT} deep")
        parameters, body = self._macros[command.name]
        self.variables.update(zip(parameters, words, strict=False))
        self.variables["ARGN"] = ";".join(words[len(parameters) :])
        self._depth += 1
        self._run(body)
        self._depth -= 1

    def _set(self, _command: Command, words: list[str]) -> None:
        if not words or words[0].startswith("ENV{"):
            return
        values = words[1:]
        for end in ("CACHE", "PARENT_SCOPE"):
            if end in values:
                values = values[: values.index(end)]
        self.variables[words[0]] = ";".join(values)

    def _unset(self, _command: Command, words: list[str]) -> None:
        self.variables.pop(words[0] if words else "", None)

    def _option(self, _command: Command, words: list[str]) -> None:
        if words:
            self.variables.setdefault(words[0], words[2] if len(words) > 2 else "OFF")

    def _list(self, _command: Command, words: list[str]) -> None:
        if len(words) >= 2 and words[0] == "APPEND":
            known = [self.variables[words[1]]] if self.variables.get(words[1]) else []
            self.variables[words[1]] = ";".join(known + words[2:])

    def _glob(self, _command: Command, words: list[str]) -> None:
        if len(words) < 2 or words[0] not in ("GLOB", "GLOB_RECURSE"):
            return
        folder = self.variables["CMAKE_CURRENT_SOURCE_DIR"]
        patterns = words[2:]
        relative_to = None
        if patterns[:1] == ["RELATIVE"]:
            relative_to, patterns = patterns[1], patterns[2:]
        found: set[str] = set()
        for pattern in patterns:
            if pattern in ("CONFIGURE_DEPENDS", "LIST_DIRECTORIES", "true", "false"):
                continue
            whole = os.path.join(folder, pattern)
            if words[0] == "GLOB_RECURSE":
                whole = os.path.join(os.path.dirname(whole), "**", os.path.basename(whole))
            found.update(glob.glob(whole, recursive=True))
        paths = sorted(os.path.relpath(path, relative_to) if relative_to else path for path in found)
        self.variables[words[1]] = ";".join(paths)

    def _include(self, _command: Command, words: list[str]) -> None:
        path = os.path.join(self.variables["CMAKE_CURRENT_SOURCE_DIR"], words[0]) if words else ""
        if os.path.isfile(path):
            self.run_file(path)

    def _add_subdirectory(self, command: Command, words: list[str]) -> None:
        path = os.path.join(self.variables["CMAKE_CURRENT_SOURCE_DIR"], words[0] if words else "")
        if not os.path.isfile(os.path.join(path, "CMakeLists.txt")):
            raise self.error(command, f"The source directory {path} does not contain a CMakeLists.txt file")
        self.run_file(os.path.join(path, "CMakeLists.txt"))

    def words(self, command: Command) -> list[str]:
        """The arguments of a command with variables replaced and lists split."""
        return cmake.expand(command.arguments, self.variables, self._environment)

    def error(self, command: Command, reason: str) -> CMakeError:
        """An error at a command of the file that is being carried out."""
        return CMakeError(self.file, command.line, command.written_name, reason)
