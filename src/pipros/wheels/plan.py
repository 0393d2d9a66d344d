"""Determine what provides each dependency of the given packages, for `pipros install` and `rosdep`.

Only `package.xml` files are read, so `--dry-run` does not run any of the packages' code.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from pathlib import Path

from pipros.basics.errors import InvalidName
from pipros.packages.apt_names import PROGRAM_PACKAGES
from pipros.wheels.dependencies import DependencySource, classify, is_shipped, run_dependencies
from pipros.wheels.folder_wheels import FolderWheels, split_requirement
from pipros.wheels.index import IndexedWheel
from pipros.wheels.installer import installed_version
from pipros.wheels.names import ON_PYPI, PREFIX, distribution_name
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
        wheel: the file to install, and no other, if a folder provides it.
    """

    name: str
    provider: Provider
    target: str = ""
    needed_by: tuple[str, ...] = ()
    wheel: IndexedWheel | None = None


@dataclass(frozen=True, slots=True)
class Places:
    """The places to search for dependencies.

    Attributes:
        folders: folders with wheels.
        has_in_index: function that returns whether the chosen index has a wheel of a distribution; None if
            no index was chosen.
        keys: requirements by rosdep key.
    """

    folders: Sequence[Path] = ()
    has_in_index: Callable[[str], bool] | None = None
    keys: Mapping[str, str] | None = None


@dataclass(slots=True)
class _Need:
    """A dependency: the packages that need it, and their limits on its version."""

    users: list[str] = field(default_factory=list)
    bounds: list[str] = field(default_factory=list)


def make_plan(packages: Sequence[SourcePackage], places: Places, errors: list[str]) -> list[PlanStep]:
    """Return the steps for packages and their run-time dependencies, sorted by name.

    A dependency is provided by the first of these: the given packages, a wheel in a folder, pipros, a PyPI
    project, an installed wheel, a wheel in the index, an installed package, or a Debian package, which is
    only listed. What the wheels in folders require is added.

    Args:
        errors: receives the reason for each needed file in a folder that is not a valid wheel.
    """
    names = {package.name for package in packages}
    built = {distribution_name(name) for name in names}
    needs: dict[str, _Need] = {name: _Need() for name in names}
    requirements: dict[str, _Need] = {}
    for package in packages:
        for name, bounds in run_dependencies(package).items():
            need = needs.setdefault(name, _Need())
            need.users.append(package.name)
            need.bounds += bounds
        if package.name in ON_PYPI:
            requirements.setdefault(ON_PYPI[package.name][1], _Need()).users.append(package.name)
    planner = _Planner(places, FolderWheels(places.folders, errors))
    steps = []
    for name, need in needs.items():
        found = (
            PlanStep(name, Provider.SOURCE, distribution_name(name))
            if name in names
            else planner.step(name, ",".join(need.bounds))
        )
        steps.append(replace(found, needed_by=tuple(sorted(need.users))))
    known = built | {step.wheel.name for step in steps if step.wheel}
    pending = [(step.wheel.requires, step.wheel.name) for step in steps if step.wheel]
    pending += [((text,), user) for text, need in requirements.items() for user in need.users]
    while pending:
        texts, user = pending.pop(0)
        for text in texts:
            step = planner.required(text, user)
            if step is not None and step.name not in known:
                known.add(step.name)
                steps.append(step)
                pending += [(step.wheel.requires, step.wheel.name)] if step.wheel else []
    return sorted(steps, key=lambda step: step.name)


class _Planner:
    def __init__(self, places: Places, wheels: FolderWheels) -> None:
        self._places = places
        self._wheels = wheels
        self._index = PackageIndex.from_environment()

    def step(self, name: str, bounds: str) -> PlanStep:
        """Return the step for a dependency in a manifest."""
        found = classify(name, False, self._places.keys or {})
        distribution = _distribution(name)
        wheel = self._wheels.find(distribution, bounds)
        if wheel is None and found.source is DependencySource.PYPI:
            return replace(self._project(found.requirement), name=name)
        if wheel is not None:
            return _of_wheel(name, wheel)
        if found.source is DependencySource.PIPROS:
            return PlanStep(name, Provider.PIPROS, "pipros" if is_shipped(name) else "")
        if distribution and (step := self._distribution(name, distribution)):
            return step
        package = self._index.get(name)
        if package is not None:
            return PlanStep(name, Provider.INSTALLED, str(package.path))
        debian = debian_package(name)
        return PlanStep(name, Provider.DEBIAN, debian) if debian else PlanStep(name, Provider.UNKNOWN)

    def required(self, text: str, user: str) -> PlanStep | None:
        """Return the step for a requirement of a wheel, named after the distribution; None for pipros."""
        name, bounds = split_requirement(text)
        if name == "pipros" or "extra ==" in text:
            return None
        if not name.startswith(PREFIX):
            return replace(self._project(text), name=name, needed_by=(user,))
        wheel = self._wheels.find(name, bounds or "")
        step = _of_wheel(name, wheel) if wheel else self._distribution(name, name)
        return replace(step or PlanStep(name, Provider.UNKNOWN), needed_by=(user,))

    def _project(self, requirement: str) -> PlanStep:
        """Return the step for a PyPI project, which a folder may have, too."""
        name, bounds = split_requirement(requirement)
        wheel = None if bounds is None else self._wheels.find(name, bounds)
        return _of_wheel(name, wheel) if wheel else PlanStep(name, Provider.PYPI, requirement)

    def _distribution(self, name: str, distribution: str) -> PlanStep | None:
        """Return the step for the wheel of a ROS package that is installed, or in the chosen index."""
        if (version := installed_version(distribution)) is not None:
            return PlanStep(name, Provider.INSTALLED, f"{distribution}=={version}")
        has_in_index = self._places.has_in_index
        if has_in_index is not None and has_in_index(distribution):
            return PlanStep(name, Provider.INDEX, distribution)
        return None


def _of_wheel(name: str, wheel: IndexedWheel) -> PlanStep:
    return PlanStep(name, Provider.FOLDER, f"{wheel.name}=={wheel.version}", wheel=wheel)


def _distribution(name: str) -> str:
    try:
        return distribution_name(name)
    except InvalidName:
        return ""


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
