"""The packages of pipros that a build by genuine catkin needs, as far as genuine ROS lacks them.

Message packages are built with the others. Those of Python have nothing to build: `find_package()` finds a
small configuration in their place.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence
from pathlib import Path

from pipros.workspace.catkin.names import COMPONENT_COMMANDS, CORE_PACKAGES
from pipros.workspace.index import SHARED_PACKAGES
from pipros.workspace.layout import SourcePackage, read_source_space
from pipros.workspace.setup_files import write_if_changed

_CONFIGURATION = """\
# Made by catkin_make of pipros: {name} comes with pipros, without C++.
set({name}_FOUND_CATKIN_PROJECT TRUE)
set({name}_VERSION {version})
set({name}_INCLUDE_DIRS "")
set({name}_LIBRARIES "")
set({name}_EXPORTED_TARGETS "")
"""

_ONLY_GENUINE = frozenset(
    ("message_runtime", *(name for names in COMPONENT_COMMANDS.values() for name in names))
)
"""Packages that give commands or C++ libraries to CMake, so that only the genuine ones will do."""


def shipped_packages(
    packages: Sequence[SourcePackage], prefixes: Sequence[Path], components: Collection[str] = ()
) -> list[SourcePackage]:
    """The packages of pipros that these need, and that are installed below no prefix.

    Those with commands for CMake, and those with messages and a C++ library, are not among them: only the
    genuine ones will do. Message packages need others in turn.

    Args:
        components: names that are needed besides the dependencies in the manifests.
    """
    shipped = {package.name: package for package in read_source_space(SHARED_PACKAGES, os.environ).packages}
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
    """Whether CMake can build a package that comes with pipros: those of Python have nothing to build."""
    return (package.folder / "CMakeLists.txt").is_file()


def write_configuration(package: SourcePackage, prefix: Path) -> None:
    """Has `find_package()` find a package without building it."""
    name, version = package.name, str(package.manifest.version)
    folder = prefix / "share" / name / "cmake"
    write_if_changed(folder / f"{name}Config.cmake", _CONFIGURATION.format(name=name, version=version))


def is_below(name: str, prefix: Path) -> bool:
    """Whether CMake finds a package below a prefix.

    catkin installs to `share/<name>/cmake`; Debian moves packages that depend on the processor to
    `lib/<triplet>/cmake/<name>`.
    """
    config = f"{name}Config.cmake"
    if (prefix / "share" / name / "cmake" / config).is_file():
        return True
    return any((prefix / "lib").glob(f"cmake/{name}/{config}")) or any(
        (prefix / "lib").glob(f"*/cmake/{name}/{config}")
    )
