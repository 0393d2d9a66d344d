"""Build packages in isolation: each has its own build space and devel space."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from pipros_workspace import genuine_catkin, native_tools
from pipros_workspace.build import build
from pipros_workspace.build_options import BuildOptions
from pipros_workspace.build_result import BuildResult
from pipros_workspace.catkin.project import Project
from pipros_workspace.cmake_runs import NativeBuildFailed
from pipros_workspace.environment import underlays_of_build
from pipros_workspace.layout import SourcePackage, WorkspaceFolders, closure
from pipros_workspace.setup_files import write_relaying_setup_files, write_setup_files

if TYPE_CHECKING:
    from pipros.basics.printable import Say

_BUILDER_LINES = ("-- ~~", "-- +++", "-- ==>")


@dataclass(frozen=True, slots=True)
class IsolatedOptions:
    """Options for an isolated build.

    Attributes:
        merges: whether all packages share one devel space.
        is_quiet: whether a package's output is printed only if the package fails.
        build: the options for each package; `only` and `left_out` have no effect.
    """

    merges: bool = False
    is_quiet: bool = False
    build: BuildOptions = field(default_factory=BuildOptions)


@dataclass(slots=True)
class IsolatedResult:
    """The outcome of an isolated build.

    Attributes:
        errors: the errors of the package that failed. The build stops at this package.
        needs_genuine: a package that genuine catkin must build; empty if there is none. The build also stops
            at this package.
    """

    errors: list[str] = field(default_factory=list)
    needs_genuine: str = ""


def build_isolated(
    layout: WorkspaceFolders,
    packages: Sequence[SourcePackage],
    chosen: Sequence[SourcePackage],
    options: IsolatedOptions,
    say: Say,
    variables: Mapping[str, str],
) -> IsolatedResult:
    """Build packages one after another.

    The devel spaces of earlier packages or, if packages are installed, the install space are underlays of
    later packages. If a package turns out to have compiled code, the build starts over, and genuine catkin
    builds this package and its dependencies.

    Args:
        layout: `build` and `devel` are the parent folders of the packages' spaces.
        packages: all packages in the workspace, in build order.
        chosen: the packages to build.

    Raises:
        MissingTools: a package needs CMake, but a tool is not installed; see `native_tools.find_tools`.
        OSError: a space cannot be written.
    """
    genuine: frozenset[str] = frozenset()
    while True:
        result = _build_all(layout, packages, chosen, options, genuine, say, variables)
        if not result.needs_genuine:
            return result
        name = result.needs_genuine
        try:
            native_tools.find_tools(variables)
        except native_tools.MissingTools as error:
            raise native_tools.MissingTools(
                f"the package [{name}] must be built by genuine catkin, but {error}"
            ) from None
        say(f"==> The package '{name}' needs CMake: genuine catkin builds it and its dependencies")
        genuine |= closure(packages, {name})


def _build_all(
    layout: WorkspaceFolders,
    packages: Sequence[SourcePackage],
    chosen: Sequence[SourcePackage],
    options: IsolatedOptions,
    genuine: frozenset[str],
    say: Say,
    variables: Mapping[str, str],
) -> IsolatedResult:
    """Build packages until one fails, or needs genuine catkin and is not in `genuine`."""
    result = IsolatedResult()
    projects: dict[str, Project] = {}
    sources: list[Path] = []
    last: Path | None = None
    for number, package in enumerate(packages, 1):
        devel = layout.devel if options.merges else layout.devel / package.name
        sources = [*sources, package.folder] if options.merges else [package.folder]
        if package not in chosen:
            variables = _with_underlay(variables, layout.install if options.build.installs else devel)
            last = devel if devel.is_dir() else last
            continue
        is_plain = package.build_type == "cmake"
        say(f"\n==> Processing {'plain cmake' if is_plain else 'catkin'} package: '{package.name}'")
        lines: list[str] = []
        tell = lines.append if options.is_quiet else _without_headings(say)
        spaces = replace(layout, build=layout.build / package.name, devel=devel)
        if is_plain:
            outcome = _build_plain(package, spaces, sources, options.build, tell, variables)
        else:
            alone = replace(
                options.build,
                only=frozenset((package.name,)),
                is_alone=True,
                genuine=genuine & {package.name},
                sources=tuple(sources),
            )
            outcome = build(spaces, alone, tell, variables, projects)
        if outcome.needs_genuine:
            result.needs_genuine = package.name
            return result
        if outcome.errors:
            for line in lines:
                say(line)
            say(f"<== Failed to process package '{package.name}'")
            result.errors = outcome.errors
            return result
        projects.update(outcome.projects)
        variables = _with_underlay(variables, layout.install if options.build.installs else devel)
        last = devel
        say(f"<== Finished processing package [{number} of {len(packages)}]: '{package.name}'")
    if last is not None and not options.merges:
        write_relaying_setup_files(layout.devel, last)
    return result


def _build_plain(
    package: SourcePackage,
    layout: WorkspaceFolders,
    sources: Sequence[Path],
    options: BuildOptions,
    say: Say,
    variables: Mapping[str, str],
) -> BuildResult:
    """Build a package with CMake alone, and write the setup files of the spaces."""
    tools = native_tools.find_tools(variables)
    prefix = layout.install if options.installs else layout.devel
    result = BuildResult()
    try:
        genuine_catkin.build_plain(tools, package, layout.build, prefix, options, say, variables)
    except NativeBuildFailed as error:
        result.errors.append(f"{package.name}: {error}")
    else:
        underlays = underlays_of_build(variables, layout.devel)
        write_setup_files(layout.devel, sources, underlays)
        if options.installs:
            write_setup_files(layout.install, (), underlays)
    return result


def _without_headings(say: Say) -> Say:
    """Return a function like `say` that omits the lines that `catkin_make` prints around each package."""
    return lambda line: None if line.startswith(_BUILDER_LINES) else say(line)


def _with_underlay(variables: Mapping[str, str], prefix: Path) -> dict[str, str]:
    known = [entry for entry in variables.get("CMAKE_PREFIX_PATH", "").split(os.pathsep) if entry]
    return {**variables, "CMAKE_PREFIX_PATH": os.pathsep.join(dict.fromkeys([str(prefix), *known]))}
