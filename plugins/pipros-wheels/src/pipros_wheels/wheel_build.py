"""Build wheels for packages and whole workspaces, in dependency order."""

from __future__ import annotations

import logging
import os
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from email.parser import HeaderParser
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote

from pipros.basics.errors import InvalidName, PiprosError
from pipros.basics.input_file import read_text
from pipros.basics.windows import path_of_url
from pipros.packages.crawl import MANIFEST
from pipros.packages.system_packages import is_share_folder
from pipros_wheels.archive import ArchiveEntry, write_wheel
from pipros_wheels.dependencies import Dependency, DependencySource, dependencies_of, is_shipped
from pipros_wheels.file_tree import WheelRefused
from pipros_wheels.index import names_in
from pipros_wheels.metadata import TAG, base_name, metadata_text, wheel_text
from pipros_wheels.names import PREFIX, distribution_name, normalized
from pipros_wheels.package_build import ProvidedByPipros, editable_files, package_files
from pipros_wheels.package_reading import FindFolder, read_package, settings_of
from pipros_wheels.python_keys import PYTHON_KEYS
from pipros_workspace.catkin.context import FoundPackage
from pipros_workspace.catkin.project import Project
from pipros_workspace.catkin.project_reader import extras_in
from pipros_workspace.index import PackageIndex
from pipros_workspace.layout import WORKSPACE_MARKER, SourcePackage, SourceSpace, read_source_space

if TYPE_CHECKING:
    from pipros.basics.printable import Say

_LOG = logging.getLogger("pipros_wheels")


@dataclass(frozen=True, slots=True)
class WheelOptions:
    """Options for a build.

    Attributes:
        is_strict: whether compiled targets are an error.
        is_whole: whether each package's folder is added as a whole.
        is_editable: whether the wheels only point to the packages' folders.
        keys: requirements by rosdep key.
        folders: folders with wheels of further packages.
    """

    is_strict: bool = False
    is_whole: bool = False
    is_editable: bool = False
    keys: Mapping[str, str] = field(default_factory=lambda: PYTHON_KEYS)
    folders: Sequence[Path] = ()


@dataclass(frozen=True, slots=True)
class BuiltWheel:
    """A wheel, with notes on parts that were left out and on a folder that was added as a whole.

    `missing` are the packages that it needs, but does not require, because they are unknown.
    """

    package: SourcePackage
    file: Path
    notes: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class WheelBuild:
    """The result of a build.

    Attributes:
        wheels: the wheels, in build order.
        left_out: packages that are not built because pipros itself installs them, each with the reason.
        errors: packages that could not be built, each with the reason.
    """

    wheels: list[BuiltWheel] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)

    def missing(self) -> list[str]:
        """Return a line for each package that wheels need, but do not require, because it is unknown."""
        users: dict[str, list[str]] = {}
        for wheel in self.wheels:
            for name in wheel.missing:
                users.setdefault(name, []).append(wheel.package.name)
        return [_advice(name, found) for name, found in sorted(users.items())]


def _advice(name: str, users: Sequence[str]) -> str:
    more = f" and {len(users) - 3} more" if len(users) > 3 else ""
    verb = "does" if len(users) == 1 else "do"
    return (
        f"{', '.join(users[:3])}{more} {verb} not require {name}, because no such package is in the "
        "workspace, installed, or in a folder that PIP_FIND_LINKS names; anyone could publish such a "
        "project. --keys FILE adds it"
    )


def source_packages(folders: Sequence[Path]) -> SourceSpace:
    """Return the packages below folders, in build order. In a workspace, only `src` is searched.

    Packages that cannot be built are not returned but named in `errors`: those with an invalid manifest or
    name, those that share their name or the distribution's name, and those that depend on each other. Those
    for rosbuild are named in the log.

    Raises:
        WheelRefused: there is no package.
    """
    sources = [_source_of(folder) for folder in folders]
    space = read_source_space(sources[0], os.environ, *sources[1:])
    for old in space.rosbuild:
        _LOG.warning("%s is left out: a package for rosbuild, which catkin replaced in 2012", old)
    if not space.packages and not space.errors:
        raise WheelRefused(f"there is no package.xml in {', '.join(map(str, folders))}, or below")
    users: dict[str, list[SourcePackage]] = {}
    for package in space.packages:
        try:
            users.setdefault(distribution_name(package.name), []).append(package)
        except InvalidName as error:
            space.errors.append(f"{package.manifest_file}: {error}")
    for name, packages in users.items():
        if len(packages) > 1:
            both = " and ".join(package.name for package in packages)
            space.errors.append(f"packages {both} would both be distributed as {name}; rename one")
    kept = {packages[0].name for packages in users.values() if len(packages) == 1}
    space.packages[:] = [package for package in space.packages if package.name in kept]
    return space


def _source_of(folder: Path) -> Path:
    has_source = (folder / "src").is_dir() and not (folder / MANIFEST).is_file()
    is_workspace = has_source or (folder / WORKSPACE_MARKER).is_file()
    return (folder / "src" if is_workspace else folder).absolute()


def build_wheels(
    packages: Sequence[SourcePackage], output: Path, options: WheelOptions, say: Say
) -> WheelBuild:
    """Build a wheel for each package. The result has the wheels in the same order.

    If a package cannot be built, the packages that depend on it are left out, and all others are built.

    Raises:
        OSError: the folder for the wheels cannot be written.
    """
    result = WheelBuild()
    output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="pipros-wheel-") as folder:
        builder = _Builder(packages, Path(folder), options, say)
        failed: set[str] = set()
        for package in packages:
            try:
                culprits = sorted(
                    package.dependencies("build_depends", "build_export_depends", "exec_depends") & failed
                )
                if culprits:
                    raise WheelRefused(f"it is left out, because it needs {culprits[0]}, which failed")
                result.wheels.append(builder.build(package, output))
            except ProvidedByPipros as reason:
                builder.leave_out(package.name)
                result.left_out.append(f"{package.name}: {reason}")
            except (PiprosError, OSError) as error:
                failed.add(package.name)
                result.errors.append(f"{package.name}: {error}")
    return result


class _Builder:
    """Builds the wheels of some packages, one after the other."""

    def __init__(
        self, packages: Sequence[SourcePackage], folder: Path, options: WheelOptions, say: Say
    ) -> None:
        self._folder = folder
        self._options = options
        self._say = say
        self._surroundings = Surroundings(packages, options.folders)
        self._packages = {package.name: package for package in packages}
        self._projects: dict[str, Project | None] = {}
        self._found_extras: dict[str, list[str]] = {}
        self._installed: dict[str, str] = {}

    def leave_out(self, name: str) -> None:
        """Let no later wheel require a package whose wheel is not built."""
        self._surroundings.without_wheel.add(name)

    def build(self, package: SourcePackage, output: Path) -> BuiltWheel:
        """Build the wheel of a package."""
        folder = self._folder / package.name
        if self._options.is_editable:
            files, project = editable_files(package), None
        else:
            project = self._read(package, self._say)
            files = package_files(
                package,
                project,
                folder,
                self._surroundings.folder,
                self._say,
                is_strict=self._options.is_strict,
                is_whole=self._options.is_whole,
            )
        for path in files.entries:
            other = self._installed.get(path.removeprefix("data/"))
            if other is not None:
                raise WheelRefused(
                    f"packages {other} and {package.name} both install {path.removeprefix('data/')}"
                )
        dependencies = self._surroundings.dependencies_of(package, project, self._options.keys)
        made = output / f"{base_name(package)}-{TAG}.whl"
        _write(package, files.entries, metadata_text(package, project, dependencies), made)
        shutil.rmtree(folder / "install", ignore_errors=True)  # but not `build`, which has CFG_EXTRAS
        self._installed |= dict.fromkeys((path.removeprefix("data/") for path in files.entries), package.name)
        notes = list(files.notes)
        if package.build_type.startswith("ament"):
            notes = [
                f"is a package for ROS 2 (build type {package.build_type}), which rospack and rosrun do not "
                "find. Check out its branch for ROS 1"
            ]
        unknown = (each.name for each in dependencies if each.source is DependencySource.UNKNOWN)
        return BuiltWheel(package, made, tuple(notes), tuple(unknown))

    def _read(self, package: SourcePackage, say: Say) -> Project:
        project = self._projects.get(package.name)
        if project is None:
            self._projects[package.name] = None  # while it is read, so that a cycle ends
            folder = self._folder / package.name
            project = read_package(package, folder, self._surroundings.folder, self._extras, say)
            self._projects[package.name] = project
        return project

    def _extras(self, name: str) -> Sequence[str]:
        """Return the CMake files of a package for packages that find it, whatever the order of the build."""
        project, package = self._projects.get(name), self._packages.get(name)
        if project is None and package is not None and name not in self._projects:
            with suppress(PiprosError, OSError):  # reported when the package itself is built
                project = self._read(package, lambda _line: None)
        if project is not None:
            return project.cfg_extras
        folder = None if package is not None else self._surroundings.folder(name)
        if folder is None:
            return ()
        if name not in self._found_extras:
            self._found_extras[name] = []  # while it is read, so that a cycle ends
            self._found_extras[name] = extras_in(
                folder,
                name,
                settings_of(self._folder / name),
                os.environ,
                lambda other: FoundPackage(extras=self._extras(other)),
            )
        return self._found_extras[name]


def metadata_of(package: SourcePackage, project: Project | None, options: WheelOptions) -> str:
    """Return the metadata of the wheel of a package that is built alone."""
    found = Surroundings([package], options.folders).dependencies_of(package, project, options.keys)
    return metadata_text(package, project, found)


def surroundings_of(packages: Sequence[SourcePackage]) -> FindFolder:
    """Return a function that finds the given packages, packages in sibling folders, and installed ones."""
    return Surroundings(packages).folder


def _write(package: SourcePackage, files: Mapping[str, ArchiveEntry], metadata: str, file: Path) -> None:
    base = base_name(package)
    entries = {f"{base}.{path}" if path.startswith("data/") else path: entry for path, entry in files.items()}
    info = f"{base}.dist-info"
    entries[f"{info}/METADATA"] = ArchiveEntry(metadata.encode())
    entries[f"{info}/WHEEL"] = ArchiveEntry(wheel_text().encode())
    write_wheel(file, entries, info)


class Surroundings:
    """The packages known to a build.

    Attributes:
        without_wheel: packages that no wheel may require, because theirs is not built.
    """

    def __init__(self, packages: Sequence[SourcePackage], folders: Sequence[Path] = ()) -> None:
        """Find the siblings of the packages, and the wheels in `folders` and in pip's and uv's folders."""
        self.without_wheel: set[str] = set()
        self._folders = {package.name: package.folder for package in packages}
        self._index = PackageIndex.from_environment()
        self._given = set(self._folders)
        for parent in dict.fromkeys(package.folder.parent for package in packages):
            for manifest in parent.glob(f"*/{MANIFEST}"):
                self._folders.setdefault(manifest.parent.name, manifest.parent)
        self._named = names_in([*folders, *_find_links(os.environ)])
        for package in packages:
            self._named |= _names_in_source_archive(package.folder)

    def folder(self, name: str) -> Path | None:
        """Return the folder of a package, or None."""
        folder = self._folders.get(name)
        if folder is None:
            found = self._index.get(name)
            folder = None if found is None else found.path
        return folder

    def dependencies_of(
        self, package: SourcePackage, project: Project | None, keys: Mapping[str, str]
    ) -> list[Dependency]:
        """Return the run-time dependencies of a package, sorted by name."""
        return dependencies_of(package, project, self._has_wheel, keys)

    def _has_wheel(self, name: str) -> bool:
        """Return whether a ROS package with this name is or could be distributed as a wheel."""
        if name in self.without_wheel:
            return False
        if name in self._given or normalized(PREFIX + name) in self._named:
            return True
        if is_shipped(name):
            return False
        installed = self._index.get(name)
        is_debians = installed is not None and is_share_folder(str(installed.path.parent))
        return name in self._folders or (installed is not None and not is_debians)


def _find_links(variables: Mapping[str, str]) -> list[Path]:
    """Return the folders of wheels that the variables of pip and uv name."""
    words = [*variables.get("PIP_FIND_LINKS", "").split(), *variables.get("UV_FIND_LINKS", "").split(",")]
    return [Path(path_of_url(unquote(word)) if word.startswith("file:") else word) for word in words if word]


def _names_in_source_archive(folder: Path) -> set[str]:
    """Return the distribution names of the ROS packages that the metadata of a source archive requires.

    The set is empty if `folder` is not an unpacked source archive.
    """
    try:
        text = read_text(folder / "PKG-INFO")
    except (OSError, UnicodeDecodeError):
        return set()
    required = HeaderParser().parsestr(text).get_all("Requires-Dist") or []
    return {
        item.split(">")[0].split("<")[0].split("=")[0].strip() for item in required if item.startswith(PREFIX)
    }
