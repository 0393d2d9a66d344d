"""Build wheels for packages and whole workspaces, in dependency order."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from email.parser import HeaderParser
from pathlib import Path
from typing import TYPE_CHECKING

from pipros.packages.crawl import MANIFEST
from pipros.wheels.archive import ArchiveEntry, write_wheel
from pipros.wheels.dependencies import dependencies_of, is_shipped
from pipros.wheels.file_tree import WheelRefused
from pipros.wheels.metadata import TAG, base_name, metadata_text, wheel_text
from pipros.wheels.names import PREFIX, distribution_name
from pipros.wheels.package_build import FindFolder, editable_files, package_files, read_package
from pipros.wheels.python_keys import PYTHON_KEYS
from pipros.workspace.catkin.project import Project
from pipros.workspace.index import PackageIndex
from pipros.workspace.layout import WORKSPACE_MARKER, SourcePackage, read_source_space

if TYPE_CHECKING:
    from pipros.basics.printable import Say


@dataclass(frozen=True, slots=True)
class WheelOptions:
    """Options for a build.

    Attributes:
        is_strict: whether compiled targets are an error.
        is_whole: whether each package's folder is added as a whole.
        is_editable: whether the wheels only point to the packages' folders.
        keys: requirements by rosdep key.
    """

    is_strict: bool = False
    is_whole: bool = False
    is_editable: bool = False
    keys: Mapping[str, str] = field(default_factory=lambda: PYTHON_KEYS)


@dataclass(frozen=True, slots=True)
class BuiltWheel:
    """A wheel, with notes on parts that were left out and on a folder that was added as a whole."""

    package: SourcePackage
    file: Path
    notes: tuple[str, ...] = ()


def source_packages(folders: Sequence[Path]) -> list[SourcePackage]:
    """Return the packages below folders, in build order. In a workspace, only `src` is searched.

    Raises:
        WheelRefused: a manifest is invalid, there is no package, or two packages would have the same
            distribution name.
        InvalidName: a package name cannot be converted to a distribution name.
        WorkspaceError: two packages have the same name, or packages depend on each other in a cycle.
    """
    sources = [_source_of(folder) for folder in folders]
    space = read_source_space(sources[0], os.environ, *sources[1:])
    if space.errors:
        raise WheelRefused("\n".join(space.errors))
    if not space.packages:
        raise WheelRefused(f"there is no package.xml in {', '.join(map(str, folders))}, or below")
    known: dict[str, str] = {}
    for package in space.packages:
        name = distribution_name(package.name)
        other = known.setdefault(name, package.name)
        if other != package.name:
            raise WheelRefused(
                f"packages {other} and {package.name} would both be distributed as {name}; rename one"
            )
    return space.packages


def _source_of(folder: Path) -> Path:
    has_source = (folder / "src").is_dir() and not (folder / MANIFEST).is_file()
    is_workspace = has_source or (folder / WORKSPACE_MARKER).is_file()
    return (folder / "src" if is_workspace else folder).absolute()


def build_wheels(
    packages: Sequence[SourcePackage], output: Path, options: WheelOptions, say: Say
) -> list[BuiltWheel]:
    """Build a wheel for each package, and return the wheels in the same order.

    If a build fails, no wheel is written.

    Raises:
        PiprosError, OSError: a package cannot be built, or a wheel cannot be written.
    """
    projects: dict[str, Project] = {}
    surroundings = _Surroundings(packages)
    installed: dict[str, str] = {}
    built = []
    output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="pipros-wheel-") as name:
        for package in packages:
            folder = Path(name, package.name)
            if options.is_editable:
                files, project = editable_files(package), None
            else:
                project = read_package(package, folder, surroundings.folder, projects, say)
                projects[package.name] = project
                files = package_files(
                    package,
                    project,
                    folder,
                    surroundings.folder,
                    say,
                    is_strict=options.is_strict,
                    is_whole=options.is_whole,
                )
            for path in files.entries:
                other = installed.setdefault(path.removeprefix("data/"), package.name)
                if other != package.name:
                    raise WheelRefused(
                        f"packages {other} and {package.name} both install {path.removeprefix('data/')}"
                    )
            metadata = metadata_of(package, project, options, surroundings.is_ros_package)
            made = Path(name, f"{base_name(package)}-{TAG}.whl")
            _write(package, files.entries, metadata, made)
            built.append(BuiltWheel(package, output / made.name, tuple(files.notes)))
            shutil.rmtree(folder, ignore_errors=True)
        for wheel in built:
            shutil.move(Path(name, wheel.file.name), wheel.file)
    return built


def metadata_of(
    package: SourcePackage,
    project: Project | None,
    options: WheelOptions,
    is_ros_package: Callable[[str], bool] | None = None,
) -> str:
    """Return the metadata of a package's wheel.

    Args:
        is_ros_package: function that returns whether a name belongs to a ROS package with its own wheel; by
            default, packages in sibling folders and installed packages are known.
    """
    known = is_ros_package or _Surroundings([package]).is_ros_package
    return metadata_text(package, project, dependencies_of(package, project, known, options.keys))


def surroundings_of(packages: Sequence[SourcePackage]) -> FindFolder:
    """Return a function that finds the given packages, packages in sibling folders, and installed ones."""
    return _Surroundings(packages).folder


def _write(package: SourcePackage, files: Mapping[str, ArchiveEntry], metadata: str, file: Path) -> None:
    base = base_name(package)
    entries = {f"{base}.{path}" if path.startswith("data/") else path: entry for path, entry in files.items()}
    info = f"{base}.dist-info"
    entries[f"{info}/METADATA"] = ArchiveEntry(metadata.encode())
    entries[f"{info}/WHEEL"] = ArchiveEntry(wheel_text().encode())
    write_wheel(file, entries, info)


class _Surroundings:
    """The packages known to a build: those to build, those in sibling folders, and installed packages."""

    def __init__(self, packages: Sequence[SourcePackage]) -> None:
        self._folders = {package.name: package.folder for package in packages}
        self._index = PackageIndex.from_environment()
        self._named: set[str] = set()
        for parent in dict.fromkeys(package.folder.parent for package in packages):
            for manifest in parent.glob(f"*/{MANIFEST}"):
                self._folders.setdefault(manifest.parent.name, manifest.parent)
        for package in packages:
            self._named |= _names_in_source_archive(package.folder)

    def folder(self, name: str) -> Path | None:
        """Return the folder of a package, or None."""
        folder = self._folders.get(name)
        if folder is None:
            found = self._index.get(name)
            folder = None if found is None else found.path
        return folder

    def is_ros_package(self, name: str) -> bool:
        """Return whether a ROS package with this name is or could be distributed as a wheel."""
        if name in self._folders or distribution_like(name) in self._named:
            return True
        return (
            not is_shipped(name) and self._index.get(name) is not None and not _is_debians(self._index, name)
        )


def _is_debians(index: PackageIndex, name: str) -> bool:
    from pipros.packages.system_packages import is_share_folder

    package = index.get(name)
    return package is not None and is_share_folder(str(package.path.parent))


def distribution_like(name: str) -> str:
    """Return the distribution name that a package with this name would have."""
    return PREFIX + name.replace("_", "-").lower()


def _names_in_source_archive(folder: Path) -> set[str]:
    """Return the distribution names of the ROS packages that the metadata of a source archive requires.

    The set is empty if `folder` is not an unpacked source archive.
    """
    try:
        text = (folder / "PKG-INFO").read_text("utf-8")
    except (OSError, UnicodeDecodeError):
        return set()
    required = HeaderParser().parsestr(text).get_all("Requires-Dist") or []
    return {
        item.split(">")[0].split("<")[0].split("=")[0].strip() for item in required if item.startswith(PREFIX)
    }
