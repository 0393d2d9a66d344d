"""`rosstack`: finds stacks and their dependencies. Since catkin, each package is its own stack."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence

from pipros.packages.crawl import STACKS
from pipros_tools.cli.entry_point import command
from pipros_tools.cli.package_query import PackageQuery, QueryFailed, answer, complain, split_arguments

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

# Noetic reports an unknown stack with one of three messages, depending on the command.
_UNKNOWN = {
    **dict.fromkeys(("depends", "depends1", "depends-on", "depends-on1"), "no such package {}"),
    **dict.fromkeys(("contains", "contains-path"), "stack containing package {} not found"),
}


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    words, options, problem = split_arguments(sys.argv[1:] if argv is None else argv, _VALUE_OPTIONS, _FLAGS)
    if problem:
        return complain("rosstack", problem, options)
    if not words or "--help" in words:
        if "-h" in options:
            print(HELP)
        else:
            complain("rosstack", "no command given.  Try 'rosstack help'", options)
        return 0
    if words[0] == "help":
        print(HELP)
        return 0

    def query_of(command: str, words: Sequence[str]) -> PackageQuery:
        return PackageQuery(
            words,
            options,
            noun="package" if command.startswith("contains") else "stack",
            unknown=_UNKNOWN.get(command, "stack '{}' not found"),
            kinds=STACKS,
        )

    return answer("rosstack", HELP, _COMMANDS, words, options, query_of)


def _folder(query: PackageQuery) -> list[str]:
    return [str(query.index.find(query.name).path)]


def _contents(query: PackageQuery) -> list[str]:
    """Return the packages in a stack: none for a metapackage, otherwise the package of the same name.

    As in Noetic, an unknown stack causes an error message, but the command does not fail.
    """
    try:
        name = query.name
    except QueryFailed as error:
        if not query.words:
            raise
        print(f"[rosstack] Error: {str(error).replace(chr(39), '')}", file=sys.stderr)
        return []
    is_metapackage = any(export.tag == "metapackage" for export in query.graph.manifest(name).exports)
    return [] if is_metapackage else [name]


def _depends_manifests(query: PackageQuery) -> list[str]:
    needed = query.graph.all(query.name)
    return [" ".join(str(query.index.find(name).path / "package.xml") for name in needed)]


_COMMANDS: Mapping[str, Callable[[PackageQuery], Sequence[str]]] = {
    "find": _folder,
    "contents": _contents,
    "list": lambda query: [f"{package.name} {package.path}" for package in query.index],
    "list-names": lambda query: [package.name for package in query.index],
    "depends": lambda query: query.graph.all(query.name),
    "depends1": lambda query: query.graph.direct(query.name),
    "depends-on": lambda query: query.graph.dependents(query.name),
    "depends-on1": lambda query: query.graph.dependents(query.name, only_direct=True),
    "depends-indent": PackageQuery.indented_dependencies,
    "depends-manifests": _depends_manifests,
    "depends-why": PackageQuery.dependency_chains,
    "contains": lambda query: [query.name],
    "contains-path": _folder,
    "profile": PackageQuery.crawl_times,
}


if __name__ == "__main__":
    sys.exit(main())
