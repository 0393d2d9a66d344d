"""`rospack`: finds packages and their dependencies."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from pipros.cli.query_arguments import TOO_MANY_WORDS, complain, split_arguments
from pipros.cli.streams import command
from pipros.errors import PiprosError
from pipros.workspace.dependency_graph import DependencyGraph
from pipros.workspace.index import PackageIndex

HELP = """\
USAGE: rospack <command> [options] [package]
  Allowed commands:
    help
    cflags-only-I     [--deps-only] [package]
    cflags-only-other [--deps-only] [package]
    depends           [package] (alias: deps)
    depends-indent    [package] (alias: deps-indent)
    depends-manifests [package] (alias: deps-manifests)
    depends-msgsrv    [package] (alias: deps-msgsrv)
    depends-on        [package]
    depends-on1       [package]
    depends-why --target=<target> [package] (alias: deps-why)
    depends1          [package] (alias: deps1)
    export [--deps-only] --lang=<lang> --attrib=<attrib> [package]
    find [package]
    langs
    libs-only-L     [--deps-only] [package]
    libs-only-l     [--deps-only] [package]
    libs-only-other [--deps-only] [package]
    list
    list-duplicates
    list-names
    plugins --attrib=<attrib> [--top=<toppkg>] [package]
    profile [--length=<length>] [--zombie-only]
    rosdep  [package] (alias: rosdeps)
    rosdep0 [package] (alias: rosdeps0)
    vcs  [package]
    vcs0 [package]
  Extra options:
    -q     Quiets error reports.

 If [package] is omitted, the current working directory
 is used (if it contains a package.xml or manifest.xml).
"""

# Noetic has two texts for an unknown package.
_NO_SUCH_PACKAGE = dict.fromkeys(("depends", "depends1", "depends-on", "depends-on1"), "no such package {}")

_VALUE_OPTIONS = ("--target", "--attrib", "--top", "--length", "--lang")
_FLAGS = ("-q", "--deps-only", "--zombie-only")


class _Failed(PiprosError):
    """The command fails; the text is printed after `[rospack] Error: `."""


class _Query:
    """The arguments of one command, with the package index and the dependency graph."""

    def __init__(self, command: str, words: Sequence[str], options: Mapping[str, str]) -> None:
        self._words = words
        self._unknown = _NO_SUCH_PACKAGE.get(command, "package '{}' not found")
        self.options = options
        self.index = PackageIndex.from_environment()
        self.graph = DependencyGraph(self.index)

    @property
    def package(self) -> str:
        """The package named, or the one around the current folder."""
        name = self._words[0] if self._words else ""
        if not name:
            current = self.index.containing(Path.cwd())
            if current is None or current.path != Path.cwd():
                raise _Failed("no package given")
            name = current.name
        if self.index.get(name) is None:
            raise _Failed(self._unknown.format(name))
        return name

    def option(self, name: str, complaint: str) -> str:
        """The value of an option; `complaint` is Noetic's error when it is missing."""
        value = self.options.get(name, "")
        if not value:
            raise _Failed(complaint)
        return value


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command and returns its exit code."""
    words, options, problem = split_arguments(sys.argv[1:] if argv is None else argv, _VALUE_OPTIONS, _FLAGS)
    if problem:
        return complain("rospack", problem, options)
    if not words:
        complain("rospack", "no command given.  Try 'rospack help'", options)
        return 0
    command = words.pop(0)
    if command in ("help", "-h", "--help"):
        print(HELP)
        return 0
    if command.startswith("deps"):
        command = command.replace("deps", "depends")
    answer = _COMMANDS.get(command)
    if answer is None:
        return complain("rospack", f"command {command} not implemented", options)
    if len(words) > 1:
        return complain("rospack", TOO_MANY_WORDS, options)
    try:
        lines = answer(_Query(command, words, options))
    except (PiprosError, OSError) as error:
        return complain("rospack", str(error), options)
    for line in lines:
        print(line)
    return 0


def _find(query: _Query) -> list[str]:
    return [str(query.index.find(query.package).path)]


def _list(query: _Query) -> list[str]:
    return [f"{package.name} {package.path}" for package in query.index]


def _list_names(query: _Query) -> list[str]:
    return [package.name for package in query.index]


def _list_duplicates(query: _Query) -> list[str]:
    duplicates = query.index.duplicates()
    return [
        line
        for name, folders in duplicates.items()
        for line in (name, *(f"- {folder}" for folder in folders))
    ]


def _depends(query: _Query) -> list[str]:
    return query.graph.all(query.package)


def _depends1(query: _Query) -> list[str]:
    return query.graph.direct(query.package)


def _depends_on(query: _Query) -> list[str]:
    return query.graph.dependents(query.package)


def _depends_on1(query: _Query) -> list[str]:
    return query.graph.dependents(query.package, only_direct=True)


def _depends_indent(query: _Query) -> list[str]:
    lines: list[str] = []

    def add(name: str, depth: int, path: tuple[str, ...]) -> None:
        for needed in query.graph.direct(name):
            if needed in path:
                raise _Failed(f"package '{path[0]}' depends on itself")
            lines.append("  " * depth + needed)
            add(needed, depth + 1, (*path, needed))

    name = query.package
    add(name, 0, (name,))
    return lines


def _depends_manifests(query: _Query) -> list[str]:
    return [" ".join(str(query.index.find(name).manifest_file) for name in query.graph.all(query.package))]


def _depends_msgsrv(query: _Query) -> list[str]:
    # Only rosbuild packages had separate folders for generated files.
    query.graph.all(query.package)
    return [""]


def _depends_why(query: _Query) -> list[str]:
    name, target = query.package, query.option("--target", "no package or target given")
    if query.index.get(target) is None:
        raise _Failed(f"package '{target}' not found")
    return [
        f"Dependency chains from {name} to {target}:",
        *("* " + " -> ".join(chain) + " " for chain in query.graph.chains(name, target)),
    ]


def _plugins(query: _Query) -> list[str]:
    attribute, top = query.option("--attrib", "no package / attrib given"), query.options.get("--top")
    if top is not None and query.index.get(top) is None:
        raise _Failed(f"no such package {top}")
    found = query.graph.exporters(query.package, attribute, top)
    return [f"{package.name} {value}" for package, value in found]


def _export(query: _Query) -> list[str]:
    language, attribute = (
        query.option(name, "no package / lang / attrib given") for name in ("--lang", "--attrib")
    )
    name = query.package
    packages = [*query.graph.all(name), *([] if "--deps-only" in query.options else [name])]
    values = []
    for package in reversed(packages):
        exports = [export for export in query.graph.manifest(package).exports if export.tag == language]
        if len(exports) > 1 and "-q" not in query.options:
            print(f"[rospack] Warning: ignoring duplicate {language} tag in export block", file=sys.stderr)
        if exports and attribute in exports[0].attributes:
            value = exports[0].attributes[attribute]
            values.append(value.replace("${prefix}", str(query.index.find(package).path)))
    return [" ".join(values)]


def _rosdep(query: _Query) -> list[str]:
    return [f"name: {key}" for key in query.graph.rosdeps(query.package)]


def _rosdep0(query: _Query) -> list[str]:
    return [f"name: {key}" for key in query.graph.rosdeps(query.package, only_direct=True)]


def _nothing(query: _Query) -> list[str]:
    # Manifests of rosbuild named a version control system; the commands still exist.
    _ = query.package  # raises for an unknown package
    return []


def _flags(option: str, prefix: str = "") -> Callable[[_Query], list[str]]:
    """A command that prints the flags of pkg-config, each without its prefix."""

    def ask(query: _Query) -> list[str]:
        name = query.package
        if "--deps-only" in query.options:
            query.graph.all(name)
            return [""]  # the flags of pkg-config include those of the dependencies
        from pipros.workspace.pkg_config import flags

        return [" ".join(flags(name, option, prefix))]

    return ask


def _langs(_query: _Query) -> list[str]:
    return ["genpy"]


def _profile(query: _Query) -> list[str]:
    from pipros.workspace.crawl_times import crawl_times

    length = query.options.get("--length", "20")
    if not length.lstrip("-").isdecimal():
        raise _Failed(f"--length must be a number, got [{length}]")
    return crawl_times(query.index.folders, int(length), only_empty="--zombie-only" in query.options)


_COMMANDS: Mapping[str, Callable[[_Query], list[str]]] = {
    "find": _find,
    "list": _list,
    "list-names": _list_names,
    "list-duplicates": _list_duplicates,
    "depends": _depends,
    "depends1": _depends1,
    "depends-on": _depends_on,
    "depends-on1": _depends_on1,
    "depends-indent": _depends_indent,
    "depends-manifests": _depends_manifests,
    "depends-msgsrv": _depends_msgsrv,
    "depends-why": _depends_why,
    "plugins": _plugins,
    "export": _export,
    "rosdep": _rosdep,
    "rosdeps": _rosdep,
    "rosdep0": _rosdep0,
    "rosdeps0": _rosdep0,
    "vcs": _nothing,
    "vcs0": _nothing,
    "langs": _langs,
    "cflags-only-I": _flags("cflags-only-I", "-I"),
    "cflags-only-other": _flags("cflags-only-other"),
    "libs-only-L": _flags("libs-only-L", "-L"),
    "libs-only-l": _flags("libs-only-l", "-l"),
    "libs-only-other": _flags("libs-only-other"),
    "profile": _profile,
}


if __name__ == "__main__":
    sys.exit(main())
