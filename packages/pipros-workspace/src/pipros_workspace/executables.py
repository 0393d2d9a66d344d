"""Find programs by package and name, for rosrun, roslaunch and rostest.

Built programs (`devel/lib/<package>`) and those that pip installed (`lib/<package>`) take precedence over
those in the package's folder. A name such as `talker.py` matches at any depth; a name such as
`scripts/talker.py` must match the end of the path. If a package lacks a program, for example because its C++
code is not compiled, the program is looked up in pipros's or Debian's package of the same name.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from pipros.basics.errors import NotFound
from pipros.basics.input_file import read_file
from pipros.basics.similar_names import similar_names
from pipros.basics.windows import ON_WINDOWS
from pipros.packages import installed_packages, shipped_folder, system_packages
from pipros_workspace.index import Package, PackageIndex
from pipros_workspace.overlays import BuiltWorkspace, built_workspaces

# Windows has no executable bit; these suffixes may be omitted from a name. The first existing file wins.
_WINDOWS_SUFFIXES = ("", ".exe", ".bat", ".cmd", ".py")


class Executables(NamedTuple):
    """The programs in a package that match a name.

    Attributes:
        runnable: executable files in order of preference, built programs first.
        unusable: matching paths that are not files or not executable.
        searched: the folder of built programs if there is one, pipros's or Debian's folder if a program was
            found only there, and the package's folder.
    """

    runnable: tuple[Path, ...]
    unusable: tuple[Path, ...]
    searched: tuple[Path, ...]

    @property
    def relay(self) -> Path | None:
        """The built program if the only other candidate is the source script that it runs; otherwise None."""
        if len(self.runnable) != 2:
            return None
        built, source = self.runnable
        *builds, package = self.searched
        is_relay = any(_is_below(built, folder) for folder in builds) and _is_below(source, package)
        return built if is_relay else None


def package_of_programs(index: PackageIndex, name: str) -> Package:
    """Return the package called `name`, even if Debian installed only its programs, without a manifest.

    Raises:
        NotFound: the package does not exist; the message lists the searched folders.
    """
    try:
        return index.find(name)
    except NotFound:
        if not system_packages.has_program_folder(name):
            raise
        return Package(name, Path(system_packages.PROGRAM_FOLDER, name))


def find_executables(
    package: Package, name: str, workspaces: Sequence[BuiltWorkspace] | None = None
) -> Executables:
    """Return the programs called `name` in `package`.

    `workspaces` are the built workspaces to search, by default the workspaces in `CMAKE_PREFIX_PATH`. Only
    the first workspace that has programs for this package is used. If the package has no file called `name`,
    the package of the same name that is shipped with pipros is searched. If no program is found, Debian's
    package is searched.
    """
    if workspaces is None:
        workspaces = built_workspaces()
    builds = _build_folders(package, workspaces)
    searched = [*[folder for folder in builds if folder.is_dir()][:1], package.path]
    runnable: dict[str, Path] = {}
    unusable: list[Path] = []
    for folder in searched:
        for path in _named(folder, name):
            if not _is_executable(path):
                unusable.append(path)
            else:
                runnable.setdefault(os.path.realpath(path), path)
    shipped = _shipped(package.name)
    # a folder, for example one with header files, may have the name of the program
    is_there = bool(runnable) or any(path.is_file() for path in unusable)
    if not is_there and shipped and (found := [*filter(_is_executable, _named(shipped, name))]):
        runnable = {str(path): path for path in found}
        searched.insert(-1, shipped)
    if not runnable and (installed := system_packages.program(package.name, name)):
        runnable[installed] = Path(installed)
        searched.insert(-1, Path(installed).parent)
    return Executables(tuple(runnable.values()), tuple(unusable), tuple(searched))


def list_executables(package: Package, workspaces: Sequence[BuiltWorkspace] | None = None) -> list[str]:
    """Return the sorted names of all programs in a package, for completion and suggestions."""
    if workspaces is None:
        workspaces = built_workspaces()
    shipped = _shipped(package.name)
    folders = [*_build_folders(package, workspaces), package.path, *([shipped] if shipped else [])]
    installed = map(os.path.basename, system_packages.programs(package.name))
    return sorted({*_programs(folders), *installed})


def hint_about(package: Package, name: str, found: Executables) -> str:
    """Return where a program is that cannot be run, or a question that suggests similar ones; or nothing."""
    if found.unusable:
        return f"There is {found.unusable[0]}"
    return similar_names(name, list_executables(package))


def why_not_built(package: Package, name: str) -> str | None:
    """Return where `CMakeLists.txt` compiles a missing program, and what to do; None if it does not."""
    file = package.path / "CMakeLists.txt"
    try:
        text = read_file(file).decode("utf-8", "replace").replace("${PROJECT_NAME}", package.name)
    except OSError:
        return None
    found = re.search(
        rf"^[ \t]*add_executable\s*\(\s*{re.escape(name)}\s", text, re.MULTILINE | re.IGNORECASE
    )
    if found is None:
        return None
    line = text.count("\n", 0, found.start()) + 1
    return (
        f"{file}:{line}: {name} is compiled from C++, and is not built. Run catkin_make in the workspace, "
        "which needs CMake, a compiler and genuine catkin for it, and source its setup file."
    )


def shipped_programs(package: str) -> list[str]:
    """Return the sorted names of the programs that pipros ships in a package of that name."""
    shipped = _shipped(package)
    return sorted(_programs([shipped])) if shipped else []


def _shipped(package: str) -> Path | None:
    folder = shipped_folder(package)
    return None if folder is None else Path(folder).resolve()


def _programs(folders: Iterable[Path]) -> set[str]:
    files = (Path(parent, name) for folder in folders for parent, name in _walk(folder))
    return {path.name for path in files if _is_executable(path)}


def _build_folders(package: Package, workspaces: Sequence[BuiltWorkspace]) -> list[Path]:
    installed = installed_packages.programs_folder(str(package.path))
    if installed is not None:
        return [Path(installed)]
    return [workspace.executables_of(package.name) for workspace in workspaces]


def _named(folder: Path, name: str) -> Iterator[Path]:
    wanted = Path(name).parts
    if not wanted or Path(name).is_absolute():
        return
    suffixes = _WINDOWS_SUFFIXES if ON_WINDOWS else ("",)
    bases = {wanted[-1] + suffix: rank for rank, suffix in enumerate(suffixes)}
    found: dict[str, int] = {}  # the best suffix in each folder
    for parent, base in _walk(folder, with_folders=True):
        if base in bases and _ends_with(parent, wanted[:-1]):
            found[parent] = min(bases[base], found.get(parent, len(bases)))
    for parent, rank in found.items():
        yield Path(parent, wanted[-1] + suffixes[rank])


def _walk(folder: Path, *, with_folders: bool = False) -> Iterator[tuple[str, str]]:
    """Yield the folder and name of each entry below a folder, sorted. Hidden folders are skipped. Links are
    followed, and each folder is visited once.
    """
    visited: set[str] = set()
    for parent, folders, files in os.walk(folder, followlinks=True):
        real = os.path.realpath(parent)
        if real in visited:
            folders.clear()
            continue
        visited.add(real)
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(files + folders if with_folders else files):
            yield parent, name


def _is_executable(path: Path) -> bool:
    if not path.is_file():
        return False
    return path.suffix.lower() in _WINDOWS_SUFFIXES if ON_WINDOWS else os.access(path, os.X_OK)


def _ends_with(folder: str, parts: tuple[str, ...]) -> bool:
    return not parts or Path(folder).parts[-len(parts) :] == parts


def _is_below(path: Path, folder: Path) -> bool:
    return path.is_relative_to(folder)
