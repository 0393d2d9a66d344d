"""Determine what provides each dependency of the given packages, for `pipros install` and `rosdep`.

Only `package.xml` files are read, so `--dry-run` does not run any of the packages' code.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cache
from pathlib import Path

from pipros.basics.errors import InvalidName
from pipros.packages.apt_names import PROGRAM_PACKAGES
from pipros_wheels.dependencies import DependencySource, classify, run_dependencies, shipped_by
from pipros_wheels.folder_wheels import FolderWheels, fits, split_requirement
from pipros_wheels.index import IndexedWheel
from pipros_wheels.installer import installed_version
from pipros_wheels.names import ON_PYPI, PREFIX, distribution_name
from pipros_workspace.index import PackageIndex
from pipros_workspace.layout import SourcePackage

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
        has_in_index: function that returns whether the chosen index has a wheel for a requirement such as
            `ros1-arm>=1.2`; None if no index was chosen. It is called once for each requirement.
        keys: requirements by rosdep key.
    """

    folders: Sequence[Path] = ()
    has_in_index: Callable[[str], bool] | None = None
    keys: Mapping[str, str] | None = None


@dataclass(slots=True)
class _Need:
    """A dependency: its distribution, the packages that need it, and their limits on its version.

    Attributes:
        name: the name in a manifest, or that of the distribution.
        requirement: the requirement for a PyPI project, without the limits unless only pip can read them.
        is_named: whether a manifest names it.
        bounds: the limits, shared with the other names of the same distribution.
    """

    name: str
    distribution: str
    requirement: str = ""
    is_named: bool = False
    users: set[str] = field(default_factory=set[str])
    bounds: dict[str, None] = field(default_factory=dict[str, None])

    @property
    def key(self) -> str:
        return self.requirement or self.distribution or self.name

    @property
    def limits(self) -> str:
        return ",".join(self.bounds)


def make_plan(packages: Sequence[SourcePackage], places: Places, errors: list[str]) -> list[PlanStep]:
    """Return the steps for packages and their run-time dependencies, sorted by name.

    A dependency is provided by the first of these: the given packages, a wheel in a folder, pipros, a PyPI
    project, an installed wheel, a wheel in the index, an installed package, or a Debian package, which is
    only listed. What the wheels in folders require is added. A wheel or a project is within the version
    limits of all packages and wheels that need it.

    Args:
        errors: receives the reason for each needed file in a folder that is not a valid wheel, and for each
            installed wheel outside of the version limits that nothing replaces.
    """
    planner = _Planner(packages, places, errors)
    for package in packages:
        planner.add_manifest(package)
    planner.follow_wheels()
    return planner.steps()


class _Planner:
    def __init__(self, packages: Sequence[SourcePackage], places: Places, errors: list[str]) -> None:
        self._built = {package.name: distribution_name(package.name) for package in packages}
        self._keys = places.keys or {}
        self._wheels = FolderWheels(places.folders, errors)
        self._errors = errors
        self._has_in_index = cache(places.has_in_index or (lambda _requirement: False))
        self._index = PackageIndex.from_environment()
        self._needs: dict[tuple[str, str], _Need] = {}
        self._first: dict[str, _Need] = {}  # by key

    def add_manifest(self, package: SourcePackage) -> None:
        """Add a package and the dependencies in its manifest."""
        self._add(_Need(package.name, self._built[package.name], is_named=True))
        for name, bounds in run_dependencies(package).items():
            found = classify(name, False, self._keys)
            need = _Need(name, _distribution(name), is_named=True, bounds=dict.fromkeys(bounds))
            if found.source is DependencySource.PYPI and self._wheel(need) is None:
                need = _project(name, found.requirement, is_named=True)
            self._add(need, package.name)
        if package.name in ON_PYPI:
            requirement = ON_PYPI[package.name][1]
            self._add(_project(split_requirement(requirement)[0], requirement), package.name)

    def _add(self, need: _Need, user: str = "") -> None:
        first = self._first.setdefault(need.key, need)
        first.bounds |= need.bounds
        need.bounds = first.bounds
        row = need if need.is_named else first
        row = self._needs.setdefault((row.name, row.key), row)
        row.users.update(filter(None, [user]))

    def follow_wheels(self) -> None:
        """Add what the wheels in folders require, until nothing is new."""
        followed = set[Path]()
        while True:
            found = [self._wheel(need) for need in self._needs.values()]
            new = [wheel for wheel in found if wheel is not None and wheel.file not in followed]
            if not new:
                return
            for wheel in new:
                followed.add(wheel.file)
                for text in wheel.requires:
                    self._add_required(text, wheel.name)

    def _add_required(self, text: str, user: str) -> None:
        name, limits, _is_simple = split_requirement(text)
        is_own = name == "pipros" or (name.startswith("pipros-") and installed_version(name) is not None)
        if is_own or "extra ==" in text:
            return
        if name.startswith(PREFIX):
            need = _Need(name, name, bounds=dict.fromkeys(filter(None, [limits])))
        else:
            need = _project(name, text)
        self._add(need, user)

    def steps(self) -> list[PlanStep]:
        """Return the steps for all that is needed, sorted by name."""
        found = [
            replace(self._step(need), needed_by=tuple(sorted(need.users))) for need in self._needs.values()
        ]
        return sorted(found, key=lambda step: step.name)

    def _wheel(self, need: _Need) -> IndexedWheel | None:
        """Return the wheel in a folder that provides a need; pip chooses if only it can read the limits."""
        if need.name in self._built or need.requirement not in ("", need.distribution):
            return None
        return self._wheels.find(need.distribution, need.limits)

    def _step(self, need: _Need) -> PlanStep:
        name, distribution = need.name, need.distribution
        if name in self._built:
            return PlanStep(name, Provider.SOURCE, distribution)
        if wheel := self._wheel(need):
            return PlanStep(name, Provider.FOLDER, f"{wheel.name}=={wheel.version}", wheel=wheel)
        if need.requirement:
            return PlanStep(name, Provider.PYPI, need.requirement + need.limits)
        if need.is_named and classify(name, False, self._keys).source is DependencySource.PIPROS:
            target = shipped_by(name)
            is_there = target in ("", "pipros") or installed_version(target) is not None
            return PlanStep(name, Provider.PIPROS if is_there else Provider.PYPI, target)
        return self._ros_package(need)

    def _ros_package(self, need: _Need) -> PlanStep:
        """Return the step for a ROS package that no folder has."""
        name, distribution = need.name, need.distribution
        version = installed_version(distribution) if distribution else None
        if version is not None and fits(version, need.limits):
            return PlanStep(name, Provider.INSTALLED, f"{distribution}=={version}")
        if distribution and self._has_in_index(distribution + need.limits):
            return PlanStep(name, Provider.INDEX, distribution + need.limits)
        if version is not None:
            self._errors.append(
                f"{', '.join(sorted(need.users))} requires {distribution}{need.limits}, but {version} is "
                "installed, and no folder or chosen index has another that fits"
            )
            return PlanStep(name, Provider.INSTALLED, f"{distribution}=={version}")
        package = self._index.get(name) if need.is_named else None
        if package is not None:
            return PlanStep(name, Provider.INSTALLED, str(package.path))
        debian = debian_package(name) if need.is_named else ""
        return PlanStep(name, Provider.DEBIAN, debian) if debian else PlanStep(name, Provider.UNKNOWN)


def _project(name: str, requirement: str, *, is_named: bool = False) -> _Need:
    """Return the need for a PyPI project, with the limits in the requirement if they can be read."""
    project, limits, is_simple = split_requirement(requirement)
    if not is_simple:
        return _Need(name, project, requirement, is_named)
    return _Need(name, project, project, is_named, bounds=dict.fromkeys(filter(None, [limits])))


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
