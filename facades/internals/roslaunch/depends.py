"""Package dependencies of launch files."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from pipros.basics.errors import PiprosError
from pipros.basics.lazy_names import star_names as _star_names
from pipros.launch.arguments import split_arguments
from pipros.launch.check import UNSET, known_nodes
from pipros.launch.load_context import LoadContext
from pipros.launch.model import Launch, Node
from pipros.launch.xml import load
from pipros.workspace.index import PackageIndex
from pipros.workspace.manifest import read_manifest
from rosgraph.names import load_mappings
from roslaunch.substitution_args import convert_value, resolve_args

__all__ = [
    "NAME",
    "RoslaunchDeps",
    "RoslaunchDepsException",
    "calculate_missing",
    "convert_value",
    "fullusage",
    "load_mappings",
    "parse_launch",
    "print_deps",
    "resolve_args",
    "rl_file_deps",
    "roslaunch_deps",
    "roslaunch_deps_main",
]

_star_names(__name__, "DomNode=xml.dom:Node os xml.dom.minidom:parse rospkg sys")

NAME = "roslaunch-deps"


class RoslaunchDepsException(Exception):
    """The dependencies of a launch file cannot be determined."""


class RoslaunchDeps:
    """Dependencies of a launch file: nodes as (package, type), included files and packages."""

    def __init__(
        self,
        nodes: list[tuple[str, str]] | None = None,
        includes: list[str] | None = None,
        pkgs: list[str] | None = None,
    ) -> None:
        self.nodes = [] if nodes is None else nodes
        self.includes = [] if includes is None else includes
        self.pkgs = [] if pkgs is None else pkgs

    def __eq__(self, other: object) -> bool:
        return isinstance(other, RoslaunchDeps) and all(
            set(own) == set(others)
            for own, others in (
                (self.nodes, other.nodes),
                (self.includes, other.includes),
                (self.pkgs, other.pkgs),
            )
        )

    __hash__ = None  # type: ignore[assignment]  # its lists change

    def __str__(self) -> str:
        return f"nodes: {self.nodes}\nincludes: {self.includes}\npkgs: {self.pkgs}"

    __repr__ = __str__


FileDeps = dict[str, RoslaunchDeps]


def _package_of(file: str, index: PackageIndex) -> str | None:
    owner = index.containing(Path(os.path.abspath(file)))
    return None if owner is None else owner.name


def parse_launch(
    launch_file: str, file_deps: FileDeps, verbose: bool, *, ignore_unset_args: bool = False
) -> None:
    """Add the dependencies of a launch file and its included files to `file_deps`, keyed by file.

    Raises:
        RoslaunchDepsException: the file is invalid.
    """
    if verbose:
        print(f"processing launch {launch_file}")
    index = PackageIndex.from_environment()
    launch = _loaded(launch_file, index, UNSET if ignore_unset_args else None)
    file_deps.update({file: RoslaunchDeps() for file in launch.files})
    for file, included in launch.includes:
        if verbose:
            print(f"processing included launch {included}")
        _add_include(file_deps[file], file, included, index)
    for node in known_nodes(launch):
        _add_node(file_deps[node.place.file if node.place else launch_file], node)


def _loaded(file: str, index: PackageIndex, unset_as: str | None) -> Launch:
    context = LoadContext.of_process(index)
    try:
        return load([file], split_arguments(sys.argv)[0], context=context, unset_as=unset_as)
    except PiprosError as error:
        raise RoslaunchDepsException(str(error)) from error


def _add_include(deps: RoslaunchDeps, file: str, included: str, index: PackageIndex) -> None:
    package = _package_of(included, index)
    if included not in deps.includes:
        deps.includes.append(included)
    if package is None:
        print(f"ERROR: cannot determine package for [{included}]", file=sys.stderr)
    elif package != _package_of(file, index):
        deps.pkgs.append(package)


def _add_node(deps: RoslaunchDeps, node: Node) -> None:
    if (node.package, node.type) not in deps.nodes:
        deps.nodes.append((node.package, node.type))
    if node.package not in deps.pkgs:
        deps.pkgs.append(node.package)


def rl_file_deps(file_deps: FileDeps, launch_file: str, verbose: bool = False) -> None:
    """Same as `parse_launch`, with the arguments in another order."""
    parse_launch(launch_file, file_deps, verbose)


def calculate_missing(
    base_pkg: str | None,
    missing: dict[str, set[str]],
    file_deps: Mapping[str, RoslaunchDeps],
    use_test_depends: bool = False,
) -> dict[str, set[str]]:
    """Add the dependencies not declared in each package's manifest to `missing`. Return `missing`."""
    _ = base_pkg
    index = PackageIndex.from_environment()
    kinds = ("exec_depends", *(("test_depends",) if use_test_depends else ()))
    for file, deps in file_deps.items():
        owner = index.containing(Path(os.path.abspath(file)))
        if owner is None:
            print(f"ERROR: cannot determine package for [{file}]", file=sys.stderr)
            continue
        declared = {owner.name, *read_manifest(owner.path).depends(*kinds)}
        missing.setdefault(owner.name, set()).update(set(deps.pkgs) - declared)
    return missing


def roslaunch_deps(
    files: Sequence[str],
    verbose: bool = False,
    use_test_depends: bool = False,
    ignore_unset_args: bool = False,
) -> tuple[str | None, FileDeps, dict[str, set[str]]]:
    """Return the files' package, the dependencies by file, and the dependencies missing from manifests.

    Raises:
        RoslaunchDepsException: a file is invalid, or the files belong to several packages.
    """
    index = PackageIndex.from_environment()
    file_deps: FileDeps = {}
    base: str | None = None
    for file in files:
        if not os.path.exists(file):
            raise RoslaunchDepsException(f"roslaunch file [{file}] does not exist")
        package = _package_of(file, index)
        if base and package != base:
            raise RoslaunchDepsException(f"roslaunch files must be in the same package: {base} vs. {package}")
        base = package
        parse_launch(file, file_deps, verbose, ignore_unset_args=ignore_unset_args)
    return base, file_deps, calculate_missing(base, {}, file_deps, use_test_depends)


def print_deps(base_pkg: str | None, file_deps: Mapping[str, RoslaunchDeps], verbose: bool) -> None:
    """Print the packages that files need.

    If `verbose` is true, also print the nodes and files that need them.
    """
    _ = base_pkg
    if verbose:
        index = PackageIndex.from_environment()
        for file, deps in file_deps.items():
            for package, kind in deps.nodes:
                print(f"{package} [{package}/{kind}]")
            print(f"{_package_of(file, index)} [{file}]")
        print("-" * 80)
    print(" ".join(sorted({package for deps in file_deps.values() for package in deps.pkgs})))


def fullusage() -> None:
    """Print the usage of the command."""
    print(f"Usage:\n\t{NAME} [options] <file-or-package>\n")


def roslaunch_deps_main(argv: Sequence[str] | None = None) -> None:
    """Run the command. `argv` starts with the program's name. Exit the process on failure."""
    from pipros.cli.roslaunch_deps import main

    code = main(None if argv is None else list(argv)[1:])
    if code:
        sys.exit(code)
