"""Determine what provides each dependency of the given packages, for `pipros install` and `rosdep`.

Only `package.xml` files are read, so `--dry-run` does not run any of the packages' code.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from pipros.basics.errors import InvalidName
from pipros.packages.apt_names import PROGRAM_PACKAGES
from pipros.wheels.dependencies import DependencySource, classify, is_shipped
from pipros.wheels.index import read_wheel_name
from pipros.wheels.names import distribution_name, normalized
from pipros.workspace.index import PackageIndex
from pipros.workspace.layout import SourcePackage

_QUERY_LIMIT_S = 20.0


class Provider(Enum):
    """What provides a package or a dependency."""

    SOURCE = "built from source"
    PIPROS = "pipros"
    FOLDER = "wheel in a folder"
    INDEX = "wheel in an index"
    INSTALLED = "installed"
    PYPI = "PyPI"
    DEBIAN = "Debian (not installed)"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class PlanStep:
    """A package or a dependency, and what provides it.

    Attributes:
        target: the distribution, Debian package, requirement or folder; empty if there is none.
        needed_by: the packages that depend on it.
    """

    name: str
    provider: Provider
    target: str = ""
    needed_by: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Places:
    """The places to search for dependencies.

    Attributes:
        folders: folders with wheels.
        has_in_index: function that returns whether a distribution is in the chosen index or already
            installed; None if no index was chosen.
        keys: requirements by rosdep key.
    """

    folders: Sequence[Path] = ()
    has_in_index: Callable[[str], bool] | None = None
    keys: Mapping[str, str] | None = None


def make_plan(packages: Sequence[SourcePackage], places: Places) -> list[PlanStep]:
    """Return the steps for packages and their run-time dependencies, sorted by name.

    A dependency is provided by the first of these: the given packages, a wheel in a folder, pipros, a PyPI
    project, a wheel in the index, an installed package, or a Debian package, which is only listed.
    """
    names = {package.name for package in packages}
    users: dict[str, list[str]] = {name: [] for name in names}
    for package in packages:
        for name in sorted(run_dependencies(package)):
            users.setdefault(name, []).append(package.name)
    known = _wheels_in(places.folders)
    index = PackageIndex.from_environment()
    steps = []
    for name, needed_by in sorted(users.items()):
        if name in names:
            step = PlanStep(name, Provider.SOURCE, distribution_name(name))
        else:
            step = _step(name, known, places, index)
        steps.append(PlanStep(step.name, step.provider, step.target, tuple(needed_by)))
    return steps


def run_dependencies(package: SourcePackage) -> set[str]:
    """Return the names of a package's run-time dependencies."""
    return package.dependencies("exec_depends", "build_export_depends")


def _step(name: str, known: set[str], places: Places, index: PackageIndex) -> PlanStep:
    found = classify(name, False, places.keys or {})
    wheel = _distribution(name)
    if wheel in known:
        return PlanStep(name, Provider.FOLDER, wheel)
    if found.source is DependencySource.PYPI:
        return PlanStep(name, Provider.PYPI, found.requirement)
    if found.source is DependencySource.PIPROS:
        return PlanStep(name, Provider.PIPROS, "pipros" if is_shipped(name) else "")
    if wheel and places.has_in_index is not None and places.has_in_index(wheel):
        return PlanStep(name, Provider.INDEX, wheel)
    package = index.get(name)
    if package is not None:
        return PlanStep(name, Provider.INSTALLED, str(package.path))
    debian = debian_package(name)
    return PlanStep(name, Provider.DEBIAN, debian) if debian else PlanStep(name, Provider.UNKNOWN)


def _distribution(name: str) -> str:
    try:
        return distribution_name(name)
    except InvalidName:
        return ""


def _wheels_in(folders: Iterable[Path]) -> set[str]:
    return {normalized(read_wheel_name(file.name)[0]) for folder in folders for file in folder.glob("*.whl")}


def debian_package(name: str) -> str:
    """Return Debian's package for a dependency, or an empty string if apt does not know one.

    Debian's packages are often named like the rosdep key or `ros-KEY`; apt is queried for both names.
    """
    table = PROGRAM_PACKAGES.get(name)
    if table is not None:
        return table
    program = shutil.which("apt-cache")
    if program is None or not name.isprintable() or name.startswith("-"):
        return ""
    for candidate in (name, f"ros-{name.replace('_', '-')}"):
        try:
            ended = subprocess.run(  # noqa: S603
                [program, "show", "--no-all-versions", "--", candidate],
                stdin=subprocess.DEVNULL,
                capture_output=True,
                timeout=_QUERY_LIMIT_S,
                check=False,
            )
        except (OSError, subprocess.TimeoutExpired):
            return ""
        if ended.returncode == 0 and ended.stdout.strip():
            return candidate
    return ""


def plan_table(steps: Sequence[PlanStep]) -> list[str]:
    """Return the plan as lines: name, provider, target, and the packages that need it."""
    rows = [("package or key", "provided by", "as", "needed by")]
    rows += [
        (step.name, step.provider.value, step.target or "-", ", ".join(step.needed_by) or "-")
        for step in steps
    ]
    widths = [max(len(row[column]) for row in rows) for column in range(3)]
    return [
        "  ".join([*(text.ljust(width) for text, width in zip(row, widths, strict=False)), row[3]]).rstrip()
        for row in rows
    ]
