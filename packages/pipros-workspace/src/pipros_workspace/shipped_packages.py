"""Find the packages shipped with pipros that a build with genuine catkin needs and genuine ROS lacks.

Message packages are built along with the workspace. Python packages need no build: `find_package()` finds a
small configuration file for each of them.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence
from pathlib import Path

from pipros_workspace.catkin.names import COMPONENT_COMMANDS, CORE_PACKAGES
from pipros_workspace.index import SHIPPED_FOLDERS
from pipros_workspace.layout import SourcePackage, read_source_space
from pipros_workspace.setup_files import write_if_changed

_CONFIGURATION = """\
# Created by pipros's catkin_make: {name} is shipped with pipros, without C++.
set({name}_FOUND_CATKIN_PROJECT TRUE)
set({name}_VERSION {version})
set({name}_INCLUDE_DIRS "")
set({name}_LIBRARIES "")
set({name}_EXPORTED_TARGETS "")
"""

_ONLY_GENUINE = frozenset(
    ("message_runtime", *(name for names in COMPONENT_COMMANDS.values() for name in names))
)
"""Packages with CMake commands or C++ libraries, for which pipros has no substitute."""


def shipped_packages(
    packages: Sequence[SourcePackage], prefixes: Sequence[Path], components: Collection[str] = ()
) -> list[SourcePackage]:
    """Return the packages shipped with pipros that the given packages need and that no prefix contains.

    Packages with CMake commands, or with messages and a C++ library, are excluded, because pipros has no
    substitute for these. The dependencies of message packages are included.

    Args:
        components: names that are required in addition to the dependencies in the manifests.
    """
    shipped = {
        package.name: package
        for folder in reversed(SHIPPED_FOLDERS)
        for package in read_source_space(folder, os.environ).packages
    }
    seen = {package.name for package in packages}
    wanted = set(components).union(*(package.all_dependencies for package in packages))
    needed: list[SourcePackage] = []
    while wanted:
        found = wanted & shipped.keys() - seen
        seen |= found
        wanted = set()
        for name in sorted(found):
            package = shipped[name]
            has_to_be_genuine = name in (CORE_PACKAGES if has_cmake(package) else _ONLY_GENUINE)
            if has_to_be_genuine or any(is_below(name, prefix) for prefix in prefixes):
                continue
            needed.append(package)
            if has_cmake(package):
                wanted |= package.all_dependencies
    return needed


def has_cmake(package: SourcePackage) -> bool:
    """Return whether CMake can build a package shipped with pipros. Python packages need no build."""
    return (package.folder / "CMakeLists.txt").is_file()


def write_configuration(package: SourcePackage, prefix: Path) -> None:
    """Write a configuration file that lets `find_package()` find a package that is not built."""
    name, version = package.name, str(package.manifest.version)
    folder = prefix / "share" / name / "cmake"
    write_if_changed(folder / f"{name}Config.cmake", _CONFIGURATION.format(name=name, version=version))


def is_below(name: str, prefix: Path) -> bool:
    """Return whether CMake finds a package below a prefix.

    catkin installs to `share/<name>/cmake`; Debian moves architecture-dependent packages to
    `lib/<triplet>/cmake/<name>`.
    """
    config = f"{name}Config.cmake"
    if (prefix / "share" / name / "cmake" / config).is_file():
        return True
    return any((prefix / "lib").glob(f"cmake/{name}/{config}")) or any(
        (prefix / "lib").glob(f"*/cmake/{name}/{config}")
    )
