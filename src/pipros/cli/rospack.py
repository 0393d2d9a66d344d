"""`rospack`: where packages are, and which need which."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from pipros.errors import PiprosError
from pipros.workspace.graph import DependencyGraph
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

_VALUE_OPTIONS = ("--target", "--attrib", "--top", "--length", "--lang")


class _Failed(PiprosError):
    """The command cannot be carried out; its text is what rospack says."""


class _Query:
    """One question: the package it is about, its options, and where the answers are."""

    def __init__(self, words: Sequence[str], options: Mapping[str, str]) -> None:
        self._words = words
        self.options = options
        self.index = PackageIndex.from_environment()
        self.graph = DependencyGraph(self.index)

    @property
    def package(self) -> str:
        """The package named, or the one around the current folder."""
        name = self._words[0] if self._words else ""
        if not name:
            here = self.index.containing(Path.cwd())
            if here is None or here.path != Path.cwd():
                raise _Failed("no package given")
            name = here.name
        if self.index.get(name) is None:
            raise _Failed(f"package '{name}' not found")
        return name

    def option(self, name: str) -> str:
        value = self.options.get(name, "")
        if not value:
            raise _Failed(f"no {name.removeprefix('--')} given")
        return value


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command and returns its exit code."""
    words, options, problem = _sort(list(sys.argv[1:] if argv is None else argv))
    if problem:
        return _complain(problem, options)
    if not words:
        _complain("no command given.  Try 'rospack help'", options)
        return 0
    command = words.pop(0)
    if command in ("help", "-h", "--help"):
        print(HELP)
        return 0
    answer = _COMMANDS.get(command.replace("deps", "depends") if command.startswith("deps") else command)
    if answer is None:
        return _complain(f"command {command} not implemented", options)
    if len(words) > 1:
        return _complain(
            "failed to parse command-line options: too many positional options have been specified on the "
            "command line",
            options,
        )
    try:
        lines = answer(_Query(words, options))
    except (PiprosError, OSError) as error:
        return _complain(str(error), options)
    for line in lines:
        print(line)
    return 0


def _sort(arguments: list[str]) -> tuple[list[str], dict[str, str], str]:
    """Words, options, and what is wrong with them."""
    words: list[str] = []
    options: dict[str, str] = {}
    while arguments:
        argument = arguments.pop(0)
        name, sign, value = argument.partition("=")
        if name in _VALUE_OPTIONS:
            if not sign and not arguments:
                return words, options, f"the required argument for option '{name}' is missing"
            options[name] = value if sign else arguments.pop(0)
        elif argument in ("-q", "--deps-only", "--zombie-only"):
            options[argument] = "yes"
        elif argument.startswith("-") and argument not in ("-h", "--help"):
            return words, options, f"failed to parse command-line options: unrecognised option '{argument}'"
        else:
            words.append(argument)
    return words, options, ""


def _complain(text: str, options: Mapping[str, str]) -> int:
    if "-q" not in options:
        print(f"[rospack] Error: {text}", file=sys.stderr)
    return 1


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
    return [
        " ".join(str(query.index.find(name).path / "package.xml") for name in query.graph.all(query.package))
    ]


def _depends_msgsrv(query: _Query) -> list[str]:
    found = []
    for name in query.graph.all(query.package):
        folder = query.index.find(name).path
        found += [
            str(folder / f"{kind}_gen" / "generated") for kind in ("msg", "srv") if (folder / kind).is_dir()
        ]
    return [" ".join(found)]


def _depends_why(query: _Query) -> list[str]:
    name, target = query.package, query.option("--target")
    chains = list(query.graph.chains(name, target))
    if not chains:
        return [f"No dependency chains from {name} to {target}"]
    return [
        f"Dependency chains from {name} to {target}:",
        *("* " + " -> ".join(chain) + " " for chain in chains),
    ]


def _plugins(query: _Query) -> list[str]:
    attribute = query.option("--attrib")
    found = query.graph.exporters(query.package, attribute, query.options.get("--top"))
    return [f"{package.name} {value}" for package, value in found]


def _export(query: _Query) -> list[str]:
    language, attribute = query.option("--lang"), query.option("--attrib")
    name = query.package
    packages = [*(query.graph.all(name)), *([] if "--deps-only" in query.options else [name])]
    values = [
        export.attributes[attribute]
        for package in packages
        for export in query.graph.manifest(package).exports
        if export.tag == language and attribute in export.attributes
    ]
    return [" ".join(values)]


def _rosdep(query: _Query) -> list[str]:
    name = query.package
    needed = {one for package in [name, *query.graph.all(name)] for one in query.graph.named(package)}
    return [f"name: {one}" for one in sorted(needed)]


def _rosdep0(query: _Query) -> list[str]:
    return [f"name: {needed}" for needed in query.graph.named(query.package)]


def _nothing(query: _Query) -> list[str]:
    # Version control of packages ended with rosbuild; the question is still understood.
    _ = query.package  # complains about one that does not exist
    return []


def _compiler_flags(query: _Query) -> list[str]:
    raise _Failed(
        f"compiler flags of '{query.package}' are a matter of compiled code; ask pkg-config for them, which "
        "genuine catkin feeds"
    )


def _langs(_query: _Query) -> list[str]:
    return ["genpy"]


def _profile(query: _Query) -> list[str]:
    from pipros.workspace.profile import profile

    length = query.options.get("--length", "20")
    if not length.lstrip("-").isdecimal():
        raise _Failed(f"the length [{length}] is no number")
    return profile(query.index.folders, int(length), only_empty="--zombie-only" in query.options)


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
    "cflags-only-I": _compiler_flags,
    "cflags-only-other": _compiler_flags,
    "libs-only-L": _compiler_flags,
    "libs-only-l": _compiler_flags,
    "libs-only-other": _compiler_flags,
    "profile": _profile,
}


if __name__ == "__main__":
    sys.exit(main())
