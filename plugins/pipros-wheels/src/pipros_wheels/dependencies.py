"""Translate the dependencies in a `package.xml` to requirements for pip.

A dependency is part of pipros, a PyPI project (`python_keys.py`), or another ROS package, whose wheel is
named after it. Other dependencies, such as C++ libraries and Debian packages, cannot be installed by pip.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum, auto

from pipros.basics.input_file import read_text
from pipros.basics.plugin_table import distribution_of_package
from pipros.packages import SHARE
from pipros.packages.well_known import COMPILED
from pipros_wheels.file_tree import WheelRefused
from pipros_wheels.names import ON_PYPI, distribution_name
from pipros_workspace.catkin.names import CORE_PACKAGES
from pipros_workspace.catkin.project import Project
from pipros_workspace.layout import SourcePackage

_VERSIONS = {
    "version_lt": "<",
    "version_lte": "<=",
    "version_eq": "==",
    "version_gte": ">=",
    "version_gt": ">",
}


_REQUIREMENT = re.compile(
    r"([A-Za-z0-9](?:[A-Za-z0-9._-]*[A-Za-z0-9])?)(?:\s*(\[[\w ,.-]*\]))?\s*([<>=!~][^;]*)?(;.*)?"
)
"""A requirement with extras, versions and a marker, but not at a URL, which not all indexes accept."""


class DependencySource(Enum):
    """What provides a dependency.

    `UNKNOWN` is a ROS package in a `CMakeLists.txt` that nothing provides. A wheel does not require it,
    because pip would ask a public index for it, where anyone can register its name.
    """

    PIPROS = auto()
    PYPI = auto()
    ROS = auto()
    UNKNOWN = auto()
    OTHER = auto()


@dataclass(frozen=True, slots=True)
class Dependency:
    """A run-time dependency of a package.

    Attributes:
        name: the name in the manifest.
        requirement: the requirement for pip; empty if there is nothing that pip can install.
    """

    name: str
    source: DependencySource
    requirement: str = ""


def run_dependencies(package: SourcePackage) -> dict[str, list[str]]:
    """Return the names of a package's run-time dependencies, with version limits such as `>=1.2`."""
    versions: dict[str, list[str]] = {}
    for kind in ("exec_depends", "build_export_depends"):
        for item in getattr(package.manifest, kind):
            if item.evaluated_condition is not False:
                bounds = versions.setdefault(str(item.name), [])
                bounds += [
                    f"{sign}{getattr(item, name)}" for name, sign in _VERSIONS.items() if getattr(item, name)
                ]
    return versions


def dependencies_of(
    package: SourcePackage,
    project: Project | None,
    is_ros_package: Callable[[str], bool],
    keys: Mapping[str, str],
) -> list[Dependency]:
    """Return the run-time dependencies of a package, sorted by name.

    Args:
        project: the package's parsed `CMakeLists.txt`, which may name ROS packages; None if it was not read.
        is_ros_package: function that returns whether a name belongs to a known ROS package with its own
            wheel, for example a package in the same workspace.
        keys: requirements by rosdep key.
    """
    versions = run_dependencies(package)
    named: set[str] = set()
    if project is not None:
        for name in project.message_dependencies:
            versions.setdefault(name, [])
        named.update(project.message_dependencies)
        if not project.needs_cmake:  # with compiled code, components may be C++ libraries
            named.update(name for name, _ in project.components)
            named.update(absent.name for absent in project.absent)
    versions.pop(package.name, None)
    found = []
    for name, bounds in sorted(versions.items()):
        if name in named and not is_ros_package(name) and not _is_elsewhere(name, keys):
            found.append(Dependency(name, DependencySource.UNKNOWN))
        else:
            found.append(classify(name, is_ros_package(name), keys, bounds))
    return found + declared_requirements(package)


def declared_requirements(package: SourcePackage) -> list[Dependency]:
    """Return the requirements in the files that the manifest exports as `pip_requirements`.

    catkin_virtualenv installs these. Options of pip, such as `--hash` and `-e`, are not requirements.

    Raises:
        WheelRefused: a file does not exist.
    """
    found = []
    for export in package.manifest.exports:
        if export.tagname == "pip_requirements" and export.evaluated_condition is not False:
            file = package.folder / str(export.content).strip()
            try:
                lines = read_text(file).replace("\\\n", " ").splitlines()
            except OSError as error:
                where = f"{package.manifest_file} names it in <pip_requirements>"
                raise WheelRefused(f"cannot read {file}: {error.strerror}; {where}") from None
            for line in lines:
                text = re.split(r"(?:^|\s)(?:#|--hash)", line)[0].strip()
                if match := _REQUIREMENT.fullmatch(text):
                    found.append(Dependency(match[1], DependencySource.PYPI, text))
                elif text:
                    found.append(Dependency(f"{text} ({file.name})", DependencySource.OTHER))
    return found


def classify(
    name: str, is_ros_package: bool, keys: Mapping[str, str], bounds: list[str] | None = None
) -> Dependency:
    """Return what provides the dependency `name`.

    Args:
        is_ros_package: whether `name` is known to be a ROS package with its own wheel.
        bounds: the required versions of the ROS package, such as `>=1.2`.
    """
    if is_ros_package:
        return Dependency(
            name, DependencySource.ROS, distribution_name(name) + ",".join(dict.fromkeys(bounds or ()))
        )
    if name in ON_PYPI and name not in keys:
        return Dependency(name, DependencySource.PYPI, ON_PYPI[name][1])
    if distribution := shipped_by(name):
        return Dependency(name, DependencySource.PIPROS, distribution)
    if name in keys:
        requirement = keys[name]
        return Dependency(
            name, DependencySource.PYPI if requirement else DependencySource.PIPROS, requirement
        )
    return Dependency(name, DependencySource.OTHER)


def _is_elsewhere(name: str, keys: Mapping[str, str]) -> bool:
    """Return whether a name in a `CMakeLists.txt` does not belong to a ROS package with its own wheel."""
    return name in COMPILED | CORE_PACKAGES or name in keys or is_shipped(name)


def is_shipped(name: str) -> bool:
    """Return whether the package `name` is part of pipros or one of its plugins."""
    return shipped_by(name) != ""


def shipped_by(name: str) -> str:
    """Return the distribution of pipros with the package `name`, installed or not; empty if none has it."""
    if distribution := distribution_of_package(name):
        return distribution
    has_it = name.isidentifier() and os.path.isfile(os.path.join(SHARE, name, "package.xml"))
    return "pipros" if has_it else ""
