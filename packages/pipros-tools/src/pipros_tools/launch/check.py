"""Find errors in a launch file and undeclared dependencies of its package, without starting nodes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from pipros.basics.errors import NotFound, PiprosError
from pipros_tools.launch.load_context import LoadContext
from pipros_tools.launch.model import Launch, LaunchNode
from pipros_tools.launch.xml import Loader
from pipros_workspace.executables import find_executables, package_of_programs
from pipros_workspace.index import PackageIndex
from pipros_workspace.manifest import read_manifest

_RUN_KINDS = ("exec_depends",)

UNSET = "an-argument-without-a-value"
"""The value of unset arguments in files that are only inspected."""


def mistakes(
    file: Path, index: PackageIndex, *, with_test_depends: bool = False, ignore_unset: bool = False
) -> list[str]:
    """Return the errors in a launch file and in the files it includes.

    Args:
        with_test_depends: whether `test_depend` counts as a declaration.
        ignore_unset: whether to accept arguments without a value. If so, the rest of a file is skipped after
            the first use of such an argument, except in an `<arg>`, where it is an error. As in Noetic, the
            packages and programs of nodes are only checked up to the first `<arg>` without a value.
    """
    loader = Loader(LoadContext.of_process(index), {}, skips_unset=ignore_unset)
    try:
        loader.load_file(str(file))
        launch = loader.finish()
        launch.check_machines()
    except PiprosError as error:
        return [str(error)]
    unset = [] if ignore_unset else [argument.name for argument in launch.arguments if argument.is_required]
    checked = loader.before_unset or launch
    return [
        *(f"No value for arg [{name}]" for name in unset),
        *_undeclared(checked, index, (*_RUN_KINDS, *(("test_depends",) if with_test_depends else ()))),
        *_without_program(checked, index),
        *(f"ROSLaunch config error: {text}" for text in launch.warnings if "DEPRECATED" not in text),
    ]


def known_nodes(launch: Launch) -> list[LaunchNode]:
    """Return the nodes, including test nodes, whose package and type do not depend on an unset argument."""
    nodes = (*launch.nodes, *(test.node for test in launch.tests))
    return [node for node in nodes if UNSET not in node.package and UNSET not in node.type]


def needed_packages(launch: Launch, index: PackageIndex) -> set[str]:
    """Return the names of the packages to which the nodes, tests and launch files belong."""
    packages = {node.package for node in known_nodes(launch)}
    for file in launch.files:
        owner = index.containing(Path(file))
        if owner is not None:
            packages.add(owner.name)
    return packages


def _undeclared(launch: Launch, index: PackageIndex, kinds: tuple[str, ...]) -> Iterator[str]:
    owner = index.containing(Path(launch.files[0]))
    if owner is None:
        return
    declared = {owner.name, *read_manifest(owner.path).depends(*kinds)}
    for file in launch.files[1:]:
        # A package declares the dependencies of its own launch files; packages that include them need not.
        included = index.containing(Path(file))
        if included is not None:
            declared |= set(read_manifest(included.path).depends())
    if missing := sorted(needed_packages(launch, index) - declared):
        yield f"Missing package dependencies: {owner.name}/package.xml: {', '.join(missing)}"


def _without_program(launch: Launch, index: PackageIndex) -> Iterator[str]:
    for node in known_nodes(launch):
        where = f" ({node.place})" if node.place else ""
        try:
            found = find_executables(package_of_programs(index, node.package), node.type)
        except NotFound:
            yield f"cannot find package [{node.package}] for node [{node.type}]{where}"
            continue
        if not found.runnable:
            hint = f"; {found.unusable[0]} is not executable" if found.unusable else ""
            yield f"cannot find node [{node.type}] in package [{node.package}]{where}{hint}"
