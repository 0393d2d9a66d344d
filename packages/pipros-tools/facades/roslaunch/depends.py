"""`roslaunch.depends`: the packages that launch files need, as printed by `roslaunch-deps`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pipros.basics.errors import PiprosError
from pipros_tools.cli.roslaunch_deps import main
from pipros_tools.launch.check import known_nodes, needed_packages
from pipros_tools.launch.load_context import LoadContext
from pipros_tools.launch.model import Launch
from pipros_tools.launch.xml import load
from pipros_workspace.index import PackageIndex
from pipros_workspace.manifest import read_manifest

NAME = "roslaunch-deps"
RUN_KINDS = ("exec_depends",)
TEST_KINDS = (*RUN_KINDS, "test_depends")


class RoslaunchDepsException(Exception):
    """A launch file cannot be read, or the files belong to several packages."""


class RoslaunchDeps:
    """What a launch file needs: nodes (package and type), included files and packages."""

    def __init__(
        self,
        nodes: list[tuple[str, str]] | None = None,
        includes: list[str] | None = None,
        pkgs: list[str] | None = None,
    ) -> None:
        self.nodes, self.includes, self.pkgs = nodes or [], includes or [], pkgs or []

    def __eq__(self, other: object) -> bool:
        return isinstance(other, RoslaunchDeps) and vars(self) == vars(other)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"nodes: {self.nodes}\nincludes: {self.includes}\npkgs: {self.pkgs}"


def roslaunch_deps(
    files: Sequence[str],
    verbose: bool = False,  # noqa: ARG001
    use_test_depends: bool = False,
    ignore_unset_args: bool = False,
) -> tuple[str | None, dict[str, RoslaunchDeps], dict[str, set[str]]]:
    """Return the package of the files, what each file needs, and the undeclared packages.

    `includes` of a given file lists all files that it includes, directly or indirectly.

    Raises:
        RoslaunchDepsException: a file cannot be read, or the files belong to several packages.
    """
    index = PackageIndex.from_environment()
    owners = {owner.name: owner for owner in map(index.containing, map(Path, files)) if owner}
    if len(owners) > 1:
        raise RoslaunchDepsException(f"roslaunch files must be in the same package: {' vs. '.join(owners)}")
    found: dict[str, RoslaunchDeps] = {}
    needed: set[str] = set()
    for file in files:
        launch = _loaded(file, index, "" if ignore_unset_args else None)
        needed |= needed_packages(launch, index)
        found |= {each: _deps(launch, each) for each in launch.files}
        found[file].includes = [each for each in launch.files if each != file]
    kinds = TEST_KINDS if use_test_depends else RUN_KINDS
    declared = {name: {name, *read_manifest(owner.path).depends(*kinds)} for name, owner in owners.items()}
    return next(iter(owners), None), found, {name: needed - known for name, known in declared.items()}


def _loaded(file: str, index: PackageIndex, unset_as: str | None) -> Launch:
    try:
        return load([file], context=LoadContext.of_process(index).without_commands(), unset_as=unset_as)
    except PiprosError as error:
        raise RoslaunchDepsException(f"Cannot load roslaunch {error}") from None


def _deps(launch: Launch, file: str) -> RoslaunchDeps:
    nodes = [node for node in known_nodes(launch) if node.place and node.place.file == file]
    return RoslaunchDeps(
        [(node.package, node.type) for node in nodes], [], list(dict.fromkeys(node.package for node in nodes))
    )


def roslaunch_deps_main(argv: Sequence[str] = ()) -> int:
    """Run `roslaunch-deps`. The first word is the name of the command."""
    return main(list(argv)[1:])
