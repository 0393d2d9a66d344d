"""Substitution arguments: `$(find pkg)`, `$(arg x)`, `$(env X)`, `$(anon x)`, `$(eval …)` and others.

This module performs no I/O; packages and environment are passed in (see `LoadContext`). The rules are those
of http://wiki.ros.org/roslaunch/XML#substitution_args; unspecified cases are handled as in Noetic.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from pipros.basics.errors import NotFound, PiprosError
from pipros.safe.expr import Expression
from pipros.safe.expr_walk import ExpressionError
from pipros_tools.launch.budget import LaunchBudget
from pipros_tools.launch.param_types import convert

LAUNCH_INSERT_CHARACTERS = 1024 * 1024
"""Limit: the text that all substitutions in one attribute or element insert. Beyond it, the launch file is
refused; the error names the file and line.
"""

COMMANDS = ("find", "env", "optenv", "dirname", "anon", "arg")

_SUBSTITUTION = re.compile(r"\$\(([^()$]*)\)")
_EVAL = re.compile(r"\$\(eval (.*)\)", re.DOTALL)
# After `$(find pkg)`, the text up to a blank or the next substitution is a path below the package.
_FIND = re.compile(r"\$\( *find +([^ ()$]+) *\)([^ $]*)")


class SubstitutionError(PiprosError, ValueError):
    """A substitution is malformed, or refers to something that does not exist."""


class UnsetArgument(SubstitutionError):
    """`$(arg x)` refers to an argument that has no value.

    Attributes:
        is_declared: whether there is an `<arg>` with this name.
    """

    def __init__(self, name: str, *, is_declared: bool) -> None:
        self.name = name
        self.is_declared = is_declared
        super().__init__(f"requires the '{name}' arg to be set")


class FindResource(Protocol):
    """Finds a package, or a file in it, on this computer."""

    def __call__(self, package: str, path: str) -> str:
        """Return the full path of `path` in the package, or of the package's folder if `path` is empty.

        Raises:
            NotFound: the package is unknown.
        """


@dataclass(slots=True, eq=False, repr=False)
class Substitution:
    """The substitutions in one file, and the values to which they may refer.

    Attributes:
        arguments: values of `<arg>`s; None for an `<arg>` that has no value.
        folder: the file's folder, for `$(dirname)`; None for text from standard input.
        anonymous: names generated for `$(anon x)` so far in this file.
        unset_as: the value to use for unset arguments; None to reject them.
        budget: budget shared by all files of a launch.
    """

    find: FindResource
    environment: Mapping[str, str]
    make_anonymous: Callable[[str], str]
    arguments: dict[str, str | None] = field(default_factory=dict)
    folder: str | None = None
    anonymous: dict[str, str] = field(default_factory=dict)
    unset_as: str | None = None
    budget: LaunchBudget = field(default_factory=LaunchBudget)

    def resolve(self, text: str) -> str:
        """Return the text with all substitutions applied.

        Raises:
            SubstitutionError: a command is unknown or has the wrong number of words; a variable or argument
                is unset; or the substitutions in this text insert more than `LAUNCH_INSERT_CHARACTERS`
                characters.
            OverBudget: the launch exceeds `LAUNCH_BYTES`, which counts files, command outputs and
                substitutions.
            ExpressionError: an `$(eval …)` is invalid.
            NotFound: a package is unknown.
        """
        if "$(" not in text:
            return text
        whole = _EVAL.fullmatch(text)
        if whole is not None:
            value = str(self._evaluate(whole[1]))
            self.budget.add_bytes(len(value))
            return value
        self._check_brackets(text)
        # `find` is substituted after the others, so that `$(find pkg)/$(arg x)` is one path.
        text = _SUBSTITUTION.sub(self._limit_growth(self._replace), text)
        return _FIND.sub(self._limit_growth(self._replace_find), text)

    def _limit_growth(self, replace: Callable[[re.Match[str]], str]) -> Callable[[re.Match[str]], str]:
        """Wrap `replace` to limit the total number of characters that its calls insert.

        Without this limit, a value would double with every `<arg>` that contains the previous one twice.
        """
        limit = LAUNCH_INSERT_CHARACTERS
        inserted = 0

        def replacement(match: re.Match[str]) -> str:
            nonlocal inserted
            text = replace(match)
            inserted += len(text)
            if inserted > limit:
                raise SubstitutionError(
                    "the substitutions insert too many characters: " + f"the limit is {limit} characters"
                )
            self.budget.add_bytes(len(text))
            return text

        return replacement

    def _check_brackets(self, text: str) -> None:
        start = text.find("$(")
        while start >= 0:
            end = text.find(")", start)
            if end < 0:
                return
            inside = text[start + 2 : end]
            if "$" in inside:
                raise SubstitutionError(
                    f"Dollar signs '$' cannot be inside of substitution args [{text[start : end + 1]}]"
                )
            if "(" in inside:
                raise SubstitutionError(
                    f"Invalid left parenthesis '(' in substitution args [{text[start : end + 1]}]"
                )
            start = text.find("$(", end)

    def _replace(self, match: re.Match[str]) -> str:
        written = match[1]
        command, *words = [word for word in written.strip(" ").split(" ") if word] or [""]
        if not command:
            return match[0]
        if command == "find":
            if len(words) != 1:
                raise SubstitutionError(f"$(find pkg) command only accepts one argument [{written}]")
            return match[0]
        if command == "env":
            if len(words) != 1:
                raise SubstitutionError(f"$(env var) command only accepts one argument [{written}]")
            return self._env(words[0])
        if command == "optenv":
            if not words:
                raise SubstitutionError(f"$(optenv var) must specify an environment variable [{written}]")
            return self.environment.get(words[0], " ".join(words[1:]))
        if command == "anon":
            if not words:
                raise SubstitutionError(f"$(anon var) must specify a name [{written}]")
            if len(words) > 1:
                raise SubstitutionError(f"$(anon var) may only specify one name [{written}]")
            return self._anon(words[0])
        if command == "arg":
            if not words:
                raise SubstitutionError(f"$(arg var) must specify a variable name [{written}]")
            if len(words) > 1:
                raise SubstitutionError(f"$(arg var) may only specify one arg [{written}]")
            return self._arg(words[0])
        if command == "dirname" and not words:
            return self._dirname()
        raise SubstitutionError(
            f"Unknown substitution command [{written}]. Valid commands are {list(COMMANDS)}"
        )

    def _replace_find(self, match: re.Match[str]) -> str:
        path = self._find(match[1], match[2])
        # A substitution that follows is part of the path, even if it is another `$(find pkg)`.
        return path if match[2] or not match.string.startswith("$", match.end()) else path + "/"

    def _find(self, package: str, path: str) -> str:
        return self.find(package, path.replace("\\", "/").lstrip("/"))

    def _env(self, name: str) -> str:
        value = self.environment.get(name)
        if value is None:
            raise SubstitutionError(f"environment variable '{name}' is not set")
        return value

    def _anon(self, base: str) -> str:
        if base not in self.anonymous:
            self.anonymous[base] = self.make_anonymous(base)
        return self.anonymous[base]

    def _arg(self, name: str) -> str:
        value = self.arguments.get(name)
        if value is None:
            if self.unset_as is None:
                raise UnsetArgument(name, is_declared=name in self.arguments)
            return self.unset_as
        return value

    def _dirname(self) -> str:
        if self.folder is None:
            raise SubstitutionError("Cannot substitute $(dirname), no file/directory information available.")
        return self.folder

    def _evaluate(self, expression: str) -> Any:
        if "__" in expression:
            raise SubstitutionError("$(eval ...) may not contain double underscore expressions")
        functions: dict[str, Callable[..., Any]] = {
            "arg": lambda name: convert(self._arg(name), "auto"),
            "env": self._env,
            "optenv": lambda name, default="": self.environment.get(name, default),
            "find": lambda package: self.find(package, ""),
            "anon": self._anon,
            "dirname": self._dirname,
        }
        try:
            parsed = Expression(expression, functions=functions)
            # Convert only the arguments that the expression uses: a file may have thousands of arguments.
            values = {name: self.arguments.get(name) for name in parsed.names()}
            return parsed.value(
                {name: convert(text, "auto") for name, text in values.items() if text is not None}
            )
        except ExpressionError as error:
            cause = error.__cause__
            if isinstance(cause, (SubstitutionError, NotFound)):
                raise cause from None
            raise


def anonymous_name(base: str) -> str:
    """Return a name that is unique across processes and computers: `base_<host>_<process id>_<number>`."""
    import random
    import socket

    name = f"{base}_{socket.gethostname()}_{os.getpid()}_{random.randrange(2**63)}"  # noqa: S311
    return re.sub(r"[.:-]", "_", name)
