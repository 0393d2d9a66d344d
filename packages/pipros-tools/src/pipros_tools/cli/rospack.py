"""`rospack`: finds packages and their dependencies."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from functools import partial

from pipros_tools.cli.entry_point import command
from pipros_tools.cli.package_query import PackageQuery, QueryFailed, answer, complain, split_arguments

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

# Noetic reports an unknown package with one of two messages, depending on the command.
_UNKNOWN = dict.fromkeys(("depends", "depends1", "depends-on", "depends-on1"), "no such package {}")

_VALUE_OPTIONS = ("--target", "--attrib", "--top", "--length", "--lang")
_FLAGS = ("-q", "-v", "--deps-only", "--zombie-only")


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    words, options, problem = split_arguments(sys.argv[1:] if argv is None else argv, _VALUE_OPTIONS, _FLAGS)
    if problem:
        return complain("rospack", problem, options)
    if not words:
        complain("rospack", "no command given.  Try 'rospack help'", options)
        return 0
    if words[0] in ("help", "-h", "--help"):
        print(HELP)
        return 0

    def query_of(command: str, words: Sequence[str]) -> PackageQuery:
        return PackageQuery(words, options, unknown=_UNKNOWN.get(command, "package '{}' not found"))

    return answer("rospack", HELP, _COMMANDS, words, options, query_of)


def _find(query: PackageQuery) -> list[str]:
    name = query.name
    if "-v" not in query.options:
        return [str(query.index.find(name).path)]
    from pipros_workspace.candidates import describe_candidates

    return describe_candidates(query.index, name)


def _list_duplicates(query: PackageQuery) -> list[str]:
    duplicates = query.index.duplicates()
    return [
        line
        for name, folders in duplicates.items()
        for line in (name, *(f"- {folder}" for folder in folders))
    ]


def _depends_manifests(query: PackageQuery) -> list[str]:
    return [" ".join(str(query.index.find(name).manifest_file) for name in query.graph.all(query.name))]


def _depends_msgsrv(query: PackageQuery) -> list[str]:
    # Only rosbuild packages had separate folders for generated files, so the output is empty.
    query.graph.all(query.name)
    return [""]


def _plugins(query: PackageQuery) -> list[str]:
    attribute, top = query.option("--attrib", "no package / attrib given"), query.options.get("--top")
    if top is not None and query.index.get(top) is None:
        raise QueryFailed(f"no such package {top}")
    found = query.graph.exporters(query.name, attribute, top)
    return [f"{package.name} {value}" for package, value in found]


def _export(query: PackageQuery) -> list[str]:
    language, attribute = (
        query.option(name, "no package / lang / attrib given") for name in ("--lang", "--attrib")
    )
    name = query.name
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


def _rosdep(query: PackageQuery, *, only_direct: bool = False) -> list[str]:
    return [f"name: {key}" for key in query.graph.rosdeps(query.name, only_direct=only_direct)]


def _nothing(query: PackageQuery) -> list[str]:
    # Only rosbuild manifests specified a version control system, so the output is empty.
    _ = query.name  # raises an error if the package is unknown
    return []


def _flags(option: str, prefix: str = "") -> Callable[[PackageQuery], list[str]]:
    """Return a function that returns the flags from pkg-config on one line, each without `prefix`."""

    def ask(query: PackageQuery) -> list[str]:
        name = query.name
        if "--deps-only" in query.options:
            query.graph.all(name)
            return [""]  # pkg-config already includes the flags of the dependencies
        from pipros_workspace.pkg_config import flags

        return [" ".join(flags(name, option, prefix))]

    return ask


_COMMANDS: Mapping[str, Callable[[PackageQuery], list[str]]] = {
    "find": _find,
    "list": lambda query: [f"{package.name} {package.path}" for package in query.index],
    "list-names": lambda query: [package.name for package in query.index],
    "list-duplicates": _list_duplicates,
    "depends": lambda query: query.graph.all(query.name),
    "depends1": lambda query: query.graph.direct(query.name),
    "depends-on": lambda query: query.graph.dependents(query.name),
    "depends-on1": lambda query: query.graph.dependents(query.name, only_direct=True),
    "depends-indent": PackageQuery.indented_dependencies,
    "depends-manifests": _depends_manifests,
    "depends-msgsrv": _depends_msgsrv,
    "depends-why": PackageQuery.dependency_chains,
    "plugins": _plugins,
    "export": _export,
    **dict.fromkeys(("rosdep", "rosdeps"), _rosdep),
    **dict.fromkeys(("rosdep0", "rosdeps0"), partial(_rosdep, only_direct=True)),
    "vcs": _nothing,
    "vcs0": _nothing,
    "langs": lambda _query: ["genpy"],
    "cflags-only-I": _flags("cflags-only-I", "-I"),
    "cflags-only-other": _flags("cflags-only-other"),
    "libs-only-L": _flags("libs-only-L", "-L"),
    "libs-only-l": _flags("libs-only-l", "-l"),
    "libs-only-other": _flags("libs-only-other"),
    "profile": PackageQuery.crawl_times,
}


if __name__ == "__main__":
    sys.exit(main())
