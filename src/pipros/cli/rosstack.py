"""`rosstack`: where stacks are, and which need which. Since catkin, a package is a stack of itself."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from pipros.cli.query_arguments import TOO_MANY_WORDS, complain, split_arguments
from pipros.cli.streams import command
from pipros.errors import PiprosError
from pipros.packages.crawl import STACKS
from pipros.workspace.dependency_graph import DependencyGraph
from pipros.workspace.index import PackageIndex

HELP = """\
USAGE: rosstack [options] <command> [stack]
  Allowed commands:
    help
    find [stack]
    contents [stack]
    list
    list-names
    depends [stack] (alias: deps)
    depends-manifests [stack] (alias: deps-manifests)
    depends1 [stack] (alias: deps1)
    depends-indent [stack] (alias: deps-indent)
    depends-why --target=<target> [stack] (alias: deps-why)
    depends-on [stack]
    depends-on1 [stack]
    contains [package]
    contains-path [package]
    profile [--length=<length>]{blank}

 If [stack] is omitted, the current working directory
 is used (if it contains a stack.xml).
""".format(blank=" ")

_VALUE_OPTIONS = ("--target", "--length", "--attrib", "--top", "--lang")
_FLAGS = ("-q", "-h")

# Noetic has three texts for an unknown stack.
_UNKNOWN = {
    **dict.fromkeys(("depends", "depends1", "depends-on", "depends-on1"), "no such package {}"),
    **dict.fromkeys(("contains", "contains-path"), "stack containing package {} not found"),
}


class _Failed(PiprosError):
    """The command cannot be carried out; its text is what rosstack says."""


class _Question:
    """What was asked: the stack that it is about, and its options."""

    def __init__(self, command: str, words: Sequence[str], options: Mapping[str, str]) -> None:
        self._noun = "package" if command.startswith("contains") else "stack"
        self._words = words
        self._unknown = _UNKNOWN.get(command, "stack '{}' not found")
        self.options = options
        self.index = PackageIndex.from_environment(kinds=STACKS)
        self.graph = DependencyGraph(self.index)

    @property
    def has_words(self) -> bool:
        return bool(self._words)

    @property
    def stack(self) -> str:
        """The stack named, or the one whose folder is the current one."""
        name = self._words[0] if self._words else ""
        if not name:
            around = self.index.containing(Path.cwd())
            if around is None or around.path != Path.cwd():
                raise _Failed(f"no {self._noun} given")
            name = around.name
        if self.index.get(name) is None:
            raise _Failed(self._unknown.format(name))
        return name

    @property
    def folder(self) -> str:
        return str(self.index.find(self.stack).path)


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command and returns its exit code."""
    words, options, problem = split_arguments(sys.argv[1:] if argv is None else argv, _VALUE_OPTIONS, _FLAGS)
    if problem:
        return complain("rosstack", problem, options)
    if not words or "--help" in words:
        if "-h" in options:
            print(HELP)
        else:
            complain("rosstack", "no command given.  Try 'rosstack help'", options)
        return 0
    asked = words.pop(0)
    if asked == "help":
        print(HELP)
        return 0
    if asked.startswith("deps"):
        asked = asked.replace("deps", "depends")
    answer = _COMMANDS.get(asked)
    if answer is None:
        return complain("rosstack", f"command {asked} not implemented", options)
    if len(words) > 1:
        return complain("rosstack", TOO_MANY_WORDS, options)
    question = _Question(asked, words, options)
    if question.has_words and asked in ("list", "list-names", "profile"):
        return complain("rosstack", "invalid option(s) given", options)
    try:
        lines = answer(question)
    except (PiprosError, OSError) as error:
        return complain("rosstack", str(error), options)
    for line in lines:
        print(line)
    return 0


def _contents(question: _Question) -> list[str]:
    """The packages of a stack: itself; none of a metapackage. Noetic does not fail for an unknown stack."""
    try:
        name = question.stack
    except _Failed as error:
        if not question.has_words:
            raise
        print(f"[rosstack] Error: {str(error).replace(chr(39), '')}", file=sys.stderr)
        return []
    is_metapackage = any(export.tag == "metapackage" for export in question.graph.manifest(name).exports)
    return [] if is_metapackage else [name]


def _depends_indent(question: _Question) -> list[str]:
    lines: list[str] = []

    def add(name: str, depth: int, path: tuple[str, ...]) -> None:
        for needed in question.graph.direct(name):
            if needed in path:
                raise _Failed(f"package '{path[0]}' depends on itself")
            lines.append("  " * depth + needed)
            add(needed, depth + 1, (*path, needed))

    name = question.stack
    add(name, 0, (name,))
    return lines


def _depends_manifests(question: _Question) -> list[str]:
    needed = question.graph.all(question.stack)
    return [" ".join(str(question.index.find(name).path / "package.xml") for name in needed)]


def _depends_why(question: _Question) -> list[str]:
    name, target = question.stack, question.options.get("--target", "")
    if not target:
        raise _Failed("no stack or target given")
    if question.index.get(target) is None:
        raise _Failed(f"stack '{target}' not found")
    chains = question.graph.chains(name, target)
    return [
        f"Dependency chains from {name} to {target}:",
        *("* " + " -> ".join(chain) + " " for chain in chains),
    ]


def _profile(question: _Question) -> list[str]:
    from pipros.workspace.crawl_times import crawl_times

    length = question.options.get("--length", "20")
    if not length.lstrip("-").isdecimal():
        raise _Failed(f"--length must be a number, got [{length}]")
    return crawl_times(question.index.folders, int(length), only_empty=False)


_COMMANDS: Mapping[str, Callable[[_Question], Sequence[str]]] = {
    "find": lambda question: [question.folder],
    "contents": _contents,
    "list": lambda question: [f"{package.name} {package.path}" for package in question.index],
    "list-names": lambda question: [package.name for package in question.index],
    "depends": lambda question: question.graph.all(question.stack),
    "depends1": lambda question: question.graph.direct(question.stack),
    "depends-on": lambda question: question.graph.dependents(question.stack),
    "depends-on1": lambda question: question.graph.dependents(question.stack, only_direct=True),
    "depends-indent": _depends_indent,
    "depends-manifests": _depends_manifests,
    "depends-why": _depends_why,
    "contains": lambda question: [question.stack],
    "contains-path": lambda question: [question.folder],
    "profile": _profile,
}


if __name__ == "__main__":
    sys.exit(main())
