"""Parse CMake files, and expand arguments.

The rules are described at https://cmake.org/cmake/help/latest/manual/cmake-language.7.html.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from pipros.basics.errors import PiprosError


class CMakeError(PiprosError):
    """A CMake file is malformed, or a command in it fails.

    Attributes:
        file, line: the position. Lines are counted from 1; 0 if the file cannot be read.
        command: the command that failed or is malformed; empty if the error is not in a command.
    """

    def __init__(self, file: str, line: int, command: str, reason: str) -> None:
        self.file = file
        self.line = line
        self.command = command
        self.reason = reason
        where = f"{file}:{line}" + (f" ({command})" if command else "")
        super().__init__(f"CMake Error at {where}:\n  {reason}")


@dataclass(frozen=True, slots=True)
class CommandArgument:
    """An argument as written.

    Attributes:
        is_quoted: whether the argument is quoted, and therefore not split at semicolons.
        is_literal: whether the argument is in brackets (`[[…]]`), and therefore neither split nor expanded.
    """

    text: str
    is_quoted: bool = False
    is_literal: bool = False


@dataclass(frozen=True, slots=True)
class Command:
    """A command, `name(arguments)`. `name` is in lower case, because CMake ignores the case of commands."""

    name: str
    written_name: str
    arguments: tuple[CommandArgument, ...]
    line: int


_TOKEN = re.compile(
    r"""
      (?P<blank>    [ \t\r]+ )
    | (?P<newline>  \n )
    | (?P<block>    \#\[(?P<b>=*)\[ .*? \](?P=b)\] )
    | (?P<bracket>  \[(?P<q>=*)\[ .*? \](?P=q)\] )
    | (?P<unclosed> \#?\[=*\[ )
    | (?P<comment>  \#[^\n]* )
    | (?P<quoted>   " [^"\\]* (?: \\. [^"\\]* ){0,9999} " )
    | (?P<open>     \( )
    | (?P<close>    \) )
    | (?P<plain>    (?: \\. | \$\{[^{}]*\} | [^\s()\#"\\] )
                    (?: \\. | \$\{[^{}]*\} | "[^"\n]*" | [^\s()\#"\\$]+ | \$+(?!\{) | \$ ){0,9999} )
    """,
    re.VERBOSE | re.DOTALL,
)

_NAME = re.compile(r"[A-Za-z_]\w*", re.ASCII)


def parse(text: str, file: str) -> list[Command]:
    """Return the commands of a file, in order.

    Args:
        file: the path for error messages.

    Raises:
        CMakeError: a quote or parenthesis is not closed, or there is text between commands.
    """
    tokens = _tokens(text, file)
    commands = []
    for kind, value, line in tokens:
        if kind != "plain" or not _NAME.fullmatch(value):
            raise CMakeError(file, line, "", f"Parse error. Expected a command name, got [{value[:40]}]")
        opening = next(tokens, ("end", "", line))
        if opening[0] != "open":
            raise CMakeError(file, line, value, 'Parse error. Expected "(" after the command name')
        commands.append(Command(value.lower(), value, _arguments(tokens, file, line, value), line))
    return commands


_Token = tuple[str, str, int]


def _arguments(tokens: Iterator[_Token], file: str, line: int, command: str) -> tuple[CommandArgument, ...]:
    arguments: list[CommandArgument] = []
    depth = 1
    for kind, value, _ in tokens:
        if kind == "close":
            depth -= 1
            if depth == 0:
                return tuple(arguments)
        depth += kind == "open"
        if kind == "quoted":
            arguments.append(CommandArgument(value[1:-1].replace("\\\n", ""), is_quoted=True))
        elif kind == "bracket":
            inner = value[value.index("[", 1) + 1 : value.rindex("]", 0, -1)]
            arguments.append(CommandArgument(inner.removeprefix("\n"), is_quoted=True, is_literal=True))
        else:
            arguments.append(CommandArgument(value))
    raise CMakeError(file, line, command, "Parse error. The command is not closed; a ) is missing")


def _tokens(text: str, file: str) -> Iterator[_Token]:
    position, line = 0, 1
    while position < len(text):
        match = _TOKEN.match(text, position)
        if match is None or match["unclosed"]:
            what = "quote" if match is None else "bracket"
            raise CMakeError(
                file, line, "", f"Parse error at [{text[position : position + 20]}]; is a {what} unclosed?"
            )
        kind = match.lastgroup or ""
        if kind in ("b", "q"):
            kind = "block" if match["block"] else "bracket"
        if kind not in ("blank", "newline", "comment", "block"):
            yield kind, match[0], line
        line += match[0].count("\n")
        position = match.end()


_ESCAPES = {"n": "\n", "t": "\t", "r": "\r", ";": "\\;"}
_REFERENCES = {"${": False, "$ENV{": True, "$CACHE{": False}
_SPECIAL = re.compile(r"\\(.)|\$(?:ENV|CACHE)?\{|\}", re.DOTALL)
_NESTING_LIMIT = 50


def expand(
    arguments: Sequence[CommandArgument],
    variables: Mapping[str, str],
    environment: Mapping[str, str],
    limit_characters: int,
) -> list[str]:
    """Replace the variables in arguments, split unquoted arguments at semicolons, and return the words.

    Raises:
        ValueError: the total length of the words would exceed the limit.
    """
    words: list[str] = []
    used = 0
    for argument in arguments:
        if argument.is_literal:
            words.append(argument.text)
            continue
        text = expand_text(argument.text, variables, environment, limit_characters, used)
        used += len(text)
        if argument.is_quoted:
            words.append(text)
        else:
            words += [word.replace("\\;", ";") for word in split_list(text) if word]
    return words


def expand_text(
    text: str,
    variables: Mapping[str, str],
    environment: Mapping[str, str],
    limit_characters: int,
    used: int = 0,
) -> str:
    """Return `text` with its variables replaced. `used` characters already count towards the limit.

    Nested references (`${A_${B}}`) are replaced from the inside out.

    Raises:
        ValueError: the result would exceed the limit.
    """
    return _expand(text, 0, _Variables(variables, environment, limit_characters, used), 0)[0]


class _Variables:
    """Looks up the variables in one string, and limits the total length of the values."""

    def __init__(
        self, variables: Mapping[str, str], environment: Mapping[str, str], limit_characters: int, used: int
    ) -> None:
        self._sources = (variables, environment)
        self._limit, self._remaining = limit_characters, limit_characters - used

    def get(self, name: str, *, is_environment: bool) -> str:
        value = self._sources[is_environment].get(name, "")
        self._remaining -= len(value)
        if self._remaining < 0:
            raise ValueError(f"given arguments longer than {self._limit} characters")
        return value


def _expand(text: str, start: int, variables: _Variables, depth: int) -> tuple[str, int]:
    """Expand from `start` to the closing brace of the enclosing reference, or to the end of the text.

    Return the expanded text, and the position at which to continue.
    """
    pieces: list[str] = []
    position = start
    for _ in range(len(text)):
        match = _SPECIAL.search(text, position)
        if match is None:
            break
        pieces.append(text[position : match.start()])
        position = match.end()
        found = match[0]
        if found.startswith("\\"):
            pieces.append(_ESCAPES.get(match[1], match[1]))
        elif found == "}":
            if depth:
                return "".join(pieces), position
            pieces.append(found)
        elif depth >= _NESTING_LIMIT:
            pieces.append(found)
        else:
            name, position = _expand(text, position, variables, depth + 1)
            pieces.append(variables.get(name, is_environment=_REFERENCES[found]))
    return "".join([*pieces, text[position:]]), len(text)


def split_list(text: str) -> list[str]:
    """Split a list at semicolons that are neither escaped nor in square brackets."""
    elements, begin, depth = [], 0, 0
    for position, character in enumerate(text):
        depth += (character == "[") - (character == "]")
        if character == ";" and depth <= 0 and text[position - 1 : position] != "\\":
            elements.append(text[begin:position])
            begin = position + 1
    return [*elements, text[begin:]]
