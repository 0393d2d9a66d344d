"""Shared parts of `rospack` and `rosstack`: argument parsing without `optparse`, and package queries."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path

from pipros.basics.errors import PiprosError
from pipros.packages.crawl import PACKAGES
from pipros_workspace.dependency_graph import DependencyGraph
from pipros_workspace.index import PackageIndex


def split_arguments(
    arguments: Sequence[str], value_options: Collection[str], flags: Collection[str]
) -> tuple[list[str], dict[str, str], str]:
    """Return the words, the options, and an error text, which is empty if the arguments are valid.

    Args:
        arguments: arguments from the command line.
        value_options: options whose value follows `=` or is the next argument.
        flags: options without a value. `-h` and `--help` are words unless they are flags.
    """
    words: list[str] = []
    options: dict[str, str] = {}
    left = iter(arguments)
    for argument in left:
        argument = "-q" if argument == "--quiet" else argument
        name, sign, value = argument.partition("=")
        if name in value_options:
            if not sign:
                following = next(left, None)
                if following is None:
                    return words, options, f"the required argument for option '{name}' is missing"
                value = following
            options[name] = value
        elif argument in flags:
            options[argument] = "yes"
        elif argument.startswith("-") and argument not in ("-h", "--help"):
            return words, options, f"failed to parse command-line options: unrecognised option '{argument}'"
        else:
            words.append(argument)
    return words, options, ""


_TOO_MANY_WORDS = (
    "failed to parse command-line options: "
    "too many positional options have been specified on the command line"
)


def complain(tool: str, text: str, options: Mapping[str, str]) -> int:
    """Print the error, unless `-q` is given; return the exit code."""
    if "-q" not in options:
        print(f"[{tool}] Error: {text}", file=sys.stderr)
    return 1


class QueryFailed(PiprosError):
    """A command cannot be executed. The text is printed after `[rospack] Error: ` or `[rosstack] Error: `."""


class UnknownPackage(QueryFailed):
    """A package or stack does not exist. `name` is its name."""

    def __init__(self, text: str, name: str) -> None:
        super().__init__(text)
        self.name = name


class PackageQuery:
    """One command's arguments, with the package index and the dependency graph.

    All methods raise `QueryFailed` if the arguments are invalid.

    Attributes:
        words: arguments that are not options: at most one, the name of a package or stack.
    """

    def __init__(
        self,
        words: Sequence[str],
        options: Mapping[str, str],
        *,
        noun: str = "package",
        unknown: str = "package '{}' not found",
        kinds: Sequence[str] = PACKAGES,
    ) -> None:
        """Store the arguments. The index is read on first use.

        Args:
            words, options: results from `split_arguments`.
            noun: the word for a package in error messages.
            unknown: the error text for an unknown package, with `{}` in place of its name.
            kinds: the kinds of packages to include; see `PackageIndex`.
        """
        self.words = words
        self.options = options
        self._noun = noun
        self._unknown = unknown
        self.index = PackageIndex.from_environment(kinds=kinds)
        self.graph = DependencyGraph(self.index)

    @property
    def name(self) -> str:
        """The name of the given package or, by default, of the package in the working directory.

        Raises:
            QueryFailed: the package does not exist, or none was given and the working directory is not a
                package.
        """
        name = self.words[0] if self.words else ""
        if not name:
            current = self.index.containing(Path.cwd())
            if current is None or current.path != Path.cwd():
                raise QueryFailed(f"no {self._noun} given")
            name = current.name
        if self.index.get(name) is None:
            raise UnknownPackage(self._unknown.format(name), name)
        return name

    def option(self, name: str, complaint: str) -> str:
        """Return the value of an option. `complaint` is Noetic's error text for a missing option."""
        value = self.options.get(name, "")
        if not value:
            raise QueryFailed(complaint)
        return value

    def indented_dependencies(self) -> list[str]:
        """Return all dependencies as an indented tree, with repetitions (`depends-indent`)."""
        lines: list[str] = []

        def add(name: str, depth: int, path: tuple[str, ...]) -> None:
            for needed in self.graph.direct(name):
                if needed in path:
                    raise QueryFailed(f"package '{needed}' depends on itself")
                lines.append("  " * depth + needed)
                add(needed, depth + 1, (*path, needed))

        name = self.name
        add(name, 0, (name,))
        return lines

    def dependency_chains(self) -> list[str]:
        """Return a heading and each dependency path to the package given with `--target` (`depends-why`)."""
        name, target = self.name, self.option("--target", f"no {self._noun} or target given")
        if self.index.get(target) is None:
            raise QueryFailed(f"{self._noun} '{target}' not found")
        return [
            f"Dependency chains from {name} to {target}:",
            *("* " + " -> ".join(chain) + " " for chain in self.graph.chains(name, target)),
        ]

    def crawl_times(self) -> list[str]:
        """Return a report on the folders that take the longest to search (`profile`)."""
        from pipros.packages.installed_packages import is_installed_share
        from pipros.packages.system_packages import is_share_folder
        from pipros_workspace.crawl_times import crawl_times

        length = self.options.get("--length", "20")
        if not length.lstrip("-").isdecimal():
            raise QueryFailed(f"--length must be an integer, got [{length}]")
        folders = [
            folder
            for folder in self.index.folders
            if not is_share_folder(str(folder))
            and not is_installed_share(str(folder))  # installed packages are not crawled
        ]
        return crawl_times(folders, int(length), only_empty="--zombie-only" in self.options)


def answer(
    tool: str,
    help_text: str,
    commands: Mapping[str, Callable[[PackageQuery], Sequence[str]]],
    words: Sequence[str],
    options: Mapping[str, str],
    query_of: Callable[[str, Sequence[str]], PackageQuery],
) -> int:
    """Print the lines that a command returns, and return the exit code.

    Args:
        help_text: a line for each command, with its options, and `[package]` or `[stack]` if it takes one.
        commands: functions by the names of the commands.
        words, options: results from `split_arguments`; the first word is the command.
        query_of: called with the command, without its aliases, and its words; may raise `QueryFailed`.
    """
    command, *words = words
    if command.startswith("deps"):
        command = command.replace("deps", "depends")
    ask = commands.get(command)
    if ask is None:
        return complain(tool, f"command {command} not implemented", options)
    if len(words) > 1:
        return complain(tool, _TOO_MANY_WORDS, options)
    usage = next(line for line in help_text.splitlines() if command in re.findall(r"[\w-]+", line))
    has_options = any(each.startswith("--") for each in options)
    if (words and not re.search(r"\[\w+\]", usage)) or (has_options and "--" not in usage):
        return complain(tool, "invalid option(s) given", options)
    try:
        lines = ask(query_of(command, words))
    except (PiprosError, OSError) as error:
        code = complain(tool, str(error), options)
        if isinstance(error, UnknownPackage):
            from pipros.packages.well_known import similar_packages, why_not_here

            advice = why_not_here(error.name) or similar_packages(error.name)
            if advice and "-q" not in options:
                print(f"[{tool}] {advice}", file=sys.stderr)
        return code
    for line in lines:
        print(line)
    return 0
