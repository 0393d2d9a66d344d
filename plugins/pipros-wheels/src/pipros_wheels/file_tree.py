"""Collect the files for a wheel or source archive, from an install space or a package's folder."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

from pipros.basics.errors import PiprosError
from pipros_wheels.archive import ArchiveEntry
from pipros_workspace.catkin.installation import Installation
from pipros_workspace.catkin.project import PYTHON_DESTINATION, Project
from pipros_workspace.cmake.copying import paths_to_copy
from pipros_workspace.setup_py import PythonSetup

WHEEL_BYTES = 2 << 30
"""Maximum total size of the files in one package's wheel. Beyond it, no wheel is built for the package; the
message names its folder.
"""

_NOT_INSTALLED = frozenset(("__pycache__", "build", "dist"))


class WheelRefused(PiprosError):
    """A package cannot be built as a wheel."""


def check_sources(project: Project, setup: PythonSetup | None, package: Path, build: Path) -> None:
    """Check what a package installs: each file must be inside of the package, or made by its build.

    Args:
        setup: what the package's `setup.py` installs.
        build: the temporary folder of the build.

    Raises:
        WheelRefused: a file is outside, or the folders to copy are too large in total.
    """
    allowed = tuple(folder.resolve() for folder in (package, build))
    sources = [(item.place, item.source) for item in project.installations]
    sources += [(project.file, interface.path) for interface in project.interfaces]
    sources += [(project.file, os.path.join(package, file)) for file in project.config_files]
    sources += [(project.file, hook.source) for hook in project.hooks]
    sources += [(f"{package}/setup.py", path) for path in (setup.files if setup else ())]
    for place, path in sources:
        real = Path(os.path.realpath(path))
        if path and not any(real.is_relative_to(root) for root in allowed):
            raise WheelRefused(
                f"{place}: the package installs {path}, which is outside of the package; copy it into "
                "the package"
            )
    limit_bytes, total_bytes = WHEEL_BYTES, 0
    for item in project.installations:
        for file in paths_to_copy(item.copy) if item.copy is not None and item.copy.is_folder else ():
            total_bytes += file.lstat().st_size
            if total_bytes > limit_bytes:
                raise WheelRefused(f"{item.place}: the files exceed {limit_bytes} bytes; install fewer")


def check_targets(project: Project, prefix: Path) -> None:
    """Check that each file is installed below the prefix, and not through a link that is installed, too.

    Raises:
        WheelRefused: a path leads out of the prefix or through a link.
    """
    targets = [
        (item.place, path, made) for item in project.installations for path, made in _made(item, prefix)
    ]
    links = {made for _, path, made in targets if path.is_symlink()}
    for interface in project.interfaces:
        if interface.folder is not None:
            made = Path(os.path.normpath(prefix / "share" / project.name / interface.folder))
            targets.append((project.file, Path(interface.path), made))
    for place, path, made in targets:
        if not made.is_relative_to(prefix):
            raise WheelRefused(f"{place}: {path} would be installed as {made}, outside of the prefix")
        if not links.isdisjoint(made.parents):
            raise WheelRefused(f"{place}: {path} would be installed through a link, as {made}")


def replace_links(project: Project, prefix: Path, package: Path) -> None:
    """Replace installed links whose target is in the package but not installed by copies of the target."""
    for item in project.installations:
        for path, made in _made(item, prefix):
            if made.is_symlink() and not made.exists() and path.exists():
                real = path.resolve()
                if real.is_relative_to(package.resolve()) and not path.is_relative_to(real):
                    made.unlink()
                    (copy_whole if real.is_dir() else shutil.copy2)(real, made)


def _made(item: Installation, prefix: Path) -> Iterator[tuple[Path, Path]]:
    """Yield each file, folder and link that an installation copies, with the path of the copy."""
    if item.copy is None:
        return
    source, target = Path(item.copy.source), prefix / item.copy.target
    if not item.copy.is_folder:
        yield source, Path(os.path.normpath(target / (item.copy.rename or source.name)))
        return
    base = target if item.copy.source.endswith("/") else target / (item.copy.rename or source.name)
    for path in paths_to_copy(item.copy):
        yield path, Path(os.path.normpath(base / path.relative_to(source)))


def source_entries(folder: Path) -> dict[str, ArchiveEntry]:
    """Return the files of a source archive: the package's folder, without hidden files and build results.

    Raises:
        WheelRefused: a link leads out of the folder or forms a cycle.
    """
    files = _files_below(folder, (folder.resolve(),))
    return {
        file.relative_to(folder).as_posix(): ArchiveEntry(file, bool(file.stat().st_mode & 0o111))
        for file in files
        if not any(part.startswith(".") or part in _NOT_INSTALLED for part in file.relative_to(folder).parts)
    }


def copy_whole(source: Path, target: Path) -> None:
    """Copy a package's folder, except hidden files and build results. Existing files are not replaced."""
    for parent, folders, files in os.walk(source):
        folders[:] = [name for name in folders if name not in _NOT_INSTALLED and _is_shown(name)]
        below = target / os.path.relpath(parent, source)
        for name in (*files, *(name for name in folders if os.path.islink(os.path.join(parent, name)))):
            made = below / name
            if _is_shown(name) and not name.endswith(".pyc") and not os.path.lexists(made):
                below.mkdir(parents=True, exist_ok=True)
                shutil.copy2(os.path.join(parent, name), made, follow_symlinks=False)


def _is_shown(name: str) -> bool:
    return not name.startswith(".") and not name.endswith(".egg-info")


def collected(prefix: Path, source: Path) -> dict[str, ArchiveEntry]:
    """Return the files below the prefix, by their path in a wheel.

    A link is replaced by its target, which must be inside the prefix or the package.

    Args:
        source: the package's folder.

    Raises:
        WheelRefused: a link leads out of both folders or forms a cycle, the files are too large in total, or
            a file has an unsupported name.
    """
    entries: dict[str, ArchiveEntry] = {}
    limit_bytes, total_bytes = WHEEL_BYTES, 0
    for file in _files_below(prefix, (prefix.resolve(), source.resolve())):
        path = file.relative_to(prefix).as_posix()
        status = file.stat()
        total_bytes += status.st_size
        if total_bytes > limit_bytes:
            raise WheelRefused(f"{source}: the files exceed {limit_bytes} bytes; install fewer")
        place = _place_of(path)
        if any(sign in place for sign in "\r\n\0\\"):
            raise WheelRefused(f"{source}: a wheel cannot contain the file name {place!r}")
        entries[place] = ArchiveEntry(file, bool(status.st_mode & 0o111))
    return entries


def _files_below(folder: Path, allowed: tuple[Path, ...]) -> Iterator[Path]:
    for entry in sorted(folder.iterdir()):
        if entry.is_symlink():
            real = Path(os.path.realpath(entry))
            if not real.exists() or not any(real.is_relative_to(root) for root in allowed):
                raise WheelRefused(
                    f"{entry.name} is a link to {os.readlink(entry)}, which is not installed with it; "
                    "wheels cannot contain links: install the file itself"
                )
            if real.is_dir() and entry.is_relative_to(real):
                raise WheelRefused(f"{entry.name} is a link to a folder that contains it")
        if entry.is_dir():
            if entry.name != "__pycache__":
                yield from _files_below(entry, allowed)
        elif entry.is_file():
            yield entry


def _place_of(path: str) -> str:
    """Return the path in a wheel for a file with the given path in the install space."""
    if path.startswith(f"{PYTHON_DESTINATION}/"):
        return path.removeprefix(f"{PYTHON_DESTINATION}/")
    if path.startswith("bin/") and path.count("/") == 1:
        return f"data/scripts/{path.removeprefix('bin/')}"
    return f"data/data/{path}"
