"""Collect the files of a package's wheel: those that `catkin_make install` would install.

The code of `catkin_make` writes the install space to a temporary folder. The Python modules in this folder
are placed at the top level of the wheel, and all other files below `.data`, from where pip copies them to the
environment's prefix.
"""

from __future__ import annotations

import ast
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from filecmp import cmp
from pathlib import Path
from typing import TYPE_CHECKING
from warnings import catch_warnings, simplefilter

from pipros.basics.input_file import read_file, read_text
from pipros.basics.syntax_trees import SYNTAX_TREES
from pipros.msg.language.definition_files import DefinitionFiles
from pipros.msg.language.definitions import Definitions
from pipros.packages.installed_packages import EDITABLE, MODULES
from pipros_libraries.reconfigure import cfg_file
from pipros_wheels.archive import ArchiveEntry
from pipros_wheels.dependencies import is_shipped
from pipros_wheels.file_tree import (
    WheelRefused,
    check_sources,
    check_targets,
    collected,
    copy_whole,
    replace_links,
)
from pipros_wheels.names import ON_PYPI, own_modules
from pipros_wheels.package_reading import FindFolder, settings_of
from pipros_workspace.catkin.installation import Installation
from pipros_workspace.catkin.project import PYTHON_DESTINATION, Project
from pipros_workspace.catkin.step_runner import StepRunner
from pipros_workspace.devel import MADE, install_package, python_setup
from pipros_workspace.layout import SourcePackage, WorkspaceFolders

if TYPE_CHECKING:
    from pipros.basics.printable import Say


_WARNING = "-- WARNING: "
_PYTHON = re.compile(
    rb"\A#![ \t]*(/\S*/)?(env[ \t]+(-S[ \t]+)?)?python(3[0-9.]*)?([ \t][^\r\n]*)?(?=\r?\n|\Z)"
)
_USUAL_FOLDERS = ("config", "launch", "maps", "meshes", "nodes", "param", "params", "rviz", "scripts", "urdf")


class ProvidedByPipros(WheelRefused):
    """pipros itself installs the package, and its Python modules would overwrite those of pipros."""


@dataclass(slots=True)
class PackageFiles:
    """The files of a wheel, except `.dist-info`.

    Attributes:
        entries: the files by path. The paths of files below `.data` begin with `data`.
        notes: lines that name the parts that were left out, or the reasons why the folder was added as a
            whole.
    """

    entries: dict[str, ArchiveEntry] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def package_files(
    package: SourcePackage,
    project: Project,
    folder: Path,
    find_folder: FindFolder,
    say: Say,
    *,
    is_strict: bool = False,
    is_whole: bool = False,
) -> PackageFiles:
    """Install a package below the temporary `folder`, and return the files for its wheel.

    The result refers to files in `folder`, so the folder must exist until the wheel has been written.

    Args:
        is_strict: whether compiled targets are an error.
        is_whole: whether to add the whole package folder.

    Raises:
        WheelRefused: the package cannot be a wheel, or has compiled targets and `is_strict` is true.
        PiprosError, OSError: a file is missing or invalid, or a command of the package failed.
    """
    result = PackageFiles()
    _note_compiled(package, project, result, is_strict=is_strict)
    for file in project.config_files:
        cfg_file.read(Path(project.folder, file))  # report errors during the build
    prefix = folder / "install"
    layout = WorkspaceFolders(folder, package.folder, folder / "build", folder / "devel", prefix)
    _leave_out(project, prefix, result)
    StepRunner(project.steps, project.binary, os.environ, say).run_wanted(
        item.source for item in project.installations
    )
    setup = python_setup(project)
    check_sources(project, setup, package.folder, folder)
    check_targets(project, prefix)
    definitions = Definitions(DefinitionFiles(find_folder))
    install_package(project, layout, definitions, settings_of(folder), _warnings(result), setup)
    replace_links(project, prefix, package.folder)
    has_installed = any(item.copy is not None for item in project.installations)
    unfollowed = [reason for reason in project.needs_cmake if not reason.target]
    if unfollowed or is_whole or not has_installed:
        for reason in unfollowed:
            result.notes.append(
                f"{reason.file}:{reason.line}: the package {reason.what}, so its folder is added as a whole"
            )
        if not unfollowed and not is_whole and _has_more_than_messages(package.folder):
            verb = "installs no files" if os.path.exists(project.file) else "does not exist"
            result.notes.append(f"{project.file} {verb}, so the folder is added as a whole")
        copy_whole(package.folder, prefix / "share" / package.name)
        modules = package.folder / "src" / package.name
        if not project.has_python_setup and (modules / "__init__.py").is_file():
            # pipros can import these modules without a build; the generated package must not hide them
            target = prefix / PYTHON_DESTINATION / package.name
            (target / "__init__.py").unlink(missing_ok=True)
            copy_whole(modules, target)
    else:
        _note_missing(package, prefix, result)
    result.entries |= collected(prefix, package.folder)
    _remove_second_copies(result.entries)
    _remove_modules_of_others(package.name, result)
    _note_python2(result)
    _use_interpreter(result.entries)
    for module in sorted(_top_modules(result.entries)):
        result.entries[f"data/data/share/{MODULES}/{module}"] = ArchiveEntry(f"{package.name}\n".encode())
    return result


def _warnings(result: PackageFiles) -> Say:
    def say(line: str) -> None:
        if line.startswith(_WARNING):
            result.notes.append(line.removeprefix(_WARNING))

    return say


def editable_files(package: SourcePackage) -> PackageFiles:
    """Return the only file of an editable wheel, which contains the path of the package's folder."""
    pointer = ArchiveEntry(f"{package.folder.resolve()}\n".encode())
    return PackageFiles({f"data/data/share/{EDITABLE}/{package.name}": pointer})


def _note_compiled(
    package: SourcePackage, project: Project, result: PackageFiles, *, is_strict: bool
) -> None:
    compiled = [reason for reason in project.needs_cmake if reason.target]
    if not compiled:
        return
    names = ", ".join(f"{reason.target} ({reason.file}:{reason.line})" for reason in compiled)
    if is_strict:
        raise WheelRefused(f"{package.name} compiles {names}; pipros's wheels contain no compiled code")
    result.notes.append(f"left out, because they are compiled: {names}")


def _leave_out(project: Project, prefix: Path, result: PackageFiles) -> None:
    """Drop the files that a wheel cannot install, and add notes: files outside the prefix, compiled files."""
    kept = []
    for item in project.installations:
        target = os.path.normpath(prefix / item.copy.target) if item.copy is not None else str(prefix)
        if not Path(target).is_relative_to(prefix):
            result.notes.append(f"left out: {item.source}, installed outside of the prefix, to {target}")
        elif project.needs_cmake and _is_missing(item, project):
            result.notes.append(f"left out: {item.source}, which a compiler creates")
        else:
            kept.append(item)
    project.installations[:] = kept


def _is_missing(item: Installation, project: Project) -> bool:
    is_file = item.copy is not None and not item.copy.is_folder
    return is_file and not os.path.lexists(item.source) and item.source not in project.steps.rules


def _has_more_than_messages(folder: Path) -> bool:
    known = {"CMakeLists.txt", "package.xml", "msg", "srv", "action", "README.md", "CHANGELOG.rst", "LICENSE"}
    return any(not entry.name.startswith(".") and entry.name not in known for entry in folder.iterdir())


def _note_missing(package: SourcePackage, prefix: Path, result: PackageFiles) -> None:
    """Add notes about folders that users expect in a wheel but that `CMakeLists.txt` does not install."""
    installed = {file.name for file in prefix.rglob("*") if not file.is_dir()}
    for name in _USUAL_FOLDERS:
        files = [file for file in (package.folder / name).rglob("*") if file.is_file()]
        if files and not any(file.name in installed for file in files):
            result.notes.append(
                f"{package.folder / name} is not in the wheel, because CMakeLists.txt does not install it; "
                "--whole adds the package's folder as a whole"
            )


def _note_python2(result: PackageFiles) -> None:
    """Add a note that names the modules that are not Python 3."""
    found = []
    for path, entry in sorted(result.entries.items()):
        if not path.endswith(".py"):
            continue
        data = entry.content if isinstance(entry.content, bytes) else read_file(entry.content)
        try:
            with SYNTAX_TREES, catch_warnings():
                simplefilter("ignore")
                ast.parse(data)
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            found.append(f"{path.removeprefix('data/data/')}:{getattr(error, 'lineno', None) or 1}")
    if found:
        more = f" and {len(found) - 5} more" if len(found) > 5 else ""
        result.notes.append(
            f"not valid in Python 3, as if written for Python 2: {', '.join(found[:5])}{more}"
        )


def _use_interpreter(entries: dict[str, ArchiveEntry]) -> None:
    """Let pip start Python programs with the environment's interpreter, for which their first line asks."""
    for path, entry in entries.items():
        if path.startswith("data/scripts/"):
            data = entry.content if isinstance(entry.content, bytes) else read_file(entry.content)
            changed = _PYTHON.sub(b"#!python", data, count=1)
            entries[path] = replace(entry, content=changed)


def _top_modules(entries: Mapping[str, ArchiveEntry]) -> set[str]:
    return {path.partition("/")[0].removesuffix(".py") for path in entries if not path.startswith("data/")}


def _remove_second_copies(entries: dict[str, ArchiveEntry]) -> None:
    """Remove modules below `data` that the wheel also contains at its top level."""
    for path, entry in list(entries.items()):
        if path.startswith("data/") and path.endswith(".py") and not entry.is_program:
            parts = path.split("/")
            ends = ("/".join(parts[start:]) for start in range(1, len(parts)))
            if any(end in entries and _have_same_bytes(entry, entries[end]) for end in ends):
                del entries[path]


def _have_same_bytes(one: ArchiveEntry, other: ArchiveEntry) -> bool:
    both = one.content, other.content
    return isinstance(both[0], Path) and isinstance(both[1], Path) and cmp(both[0], both[1], shallow=False)


def _is_made(entry: ArchiveEntry) -> bool:
    """Return whether a file is the `__init__.py` that the installation generates for packages without one."""
    return isinstance(entry.content, Path) and read_text(entry.content, errors="replace").startswith(MADE)


def _remove_modules_of_others(package: str, result: PackageFiles) -> None:
    """Remove modules that would overwrite pipros's modules or those of a required PyPI project."""
    owners = dict.fromkeys(own_modules(), "pipros itself")
    if package in ON_PYPI:
        module, project = ON_PYPI[package]
        owners[module] = f"the PyPI project {project}"
    for name in sorted(_top_modules(result.entries) & owners.keys()):
        files = [path for path in result.entries if path.startswith((f"{name}/", f"{name}.py"))]
        has_code = any(path.endswith(".py") and not _is_made(result.entries[path]) for path in files)
        if has_code and is_shipped(package) and package not in ON_PYPI:
            raise ProvidedByPipros(
                f"not built, because pipros itself installs this package, and its Python module {name}: a "
                "wheel without the module would mix the two. Rename both to use another version"
            )
        for path in files:
            del result.entries[path]
        if has_code:
            result.notes.append(f"left out: the Python module {name}, which {owners[name]} installs")
