"""Write one package's files to the devel space and the install space."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from pipros.basics.errors import NotFound, PiprosError
from pipros.basics.input_file import read_text
from pipros.msg.language.definitions import Definitions
from pipros.msg.language.spec import DefinitionError
from pipros.msg.stubs import package_stubs
from pipros_libraries.reconfigure import cfg_file
from pipros_workspace.catkin.installation import install
from pipros_workspace.catkin.project import EXTRAS, PYTHON_DESTINATION, Project
from pipros_workspace.cmake.copying import PROGRAM_MODE, Copy, copy, copy_file
from pipros_workspace.hooks import HOOKS_FOLDER
from pipros_workspace.layout import WorkspaceFolders
from pipros_workspace.setup_files import write_if_changed
from pipros_workspace.setup_py import PythonSetup, read_setup_py

if TYPE_CHECKING:
    from pipros.basics.printable import Say


_RELAY = """\
#!/usr/bin/env python3
# Created by pipros's catkin_make. Runs the script in the source space.
import os
import runpy
import sys

script = {script!r}
sys.path[0] = os.path.dirname(script)
runpy.run_path(script, run_name="__main__")
"""

_RELAYED_MODULE = """\
# Created by pipros's catkin_make. Executes the module in the source space.
__file__ = {file!r}
with open(__file__, encoding="utf-8") as _source:
    exec(compile(_source.read(), __file__, "exec"))
"""

_ENTRY_POINT = """\
#!/usr/bin/env python3
# Created by pipros's catkin_make. Calls the function that setup.py names.
import importlib
import operator
import sys

sys.exit(operator.attrgetter({function!r})(importlib.import_module({module!r}))())
"""

MADE = '"""Made by catkin_make of pipros: the Python modules of the ROS package '
"""The beginning of each `__init__.py` that the build writes."""

_PACKAGE = (
    MADE
    + '''{name}.

The classes of its messages and services are made from their definitions when they are first used.
"""
'''
)

_FOLDER_PACKAGE = _PACKAGE + "\n__path__.insert(0, {folder!r})\n"

_RELAYED_PACKAGE = (
    _FOLDER_PACKAGE
    + """\
_init = __path__[0] + "/__init__.py"
with open(_init, encoding="utf-8") as _source:
    exec(compile(_source.read(), _init, "exec"))
"""
)


def python_setup(project: Project) -> PythonSetup | None:
    """Return what the package's `setup.py` installs, or None if the package has no Python setup.

    Raises:
        SetupPyError: the file fails.
    """
    return read_setup_py(project.folder) if project.has_python_setup else None


def python_sources(project: Project) -> list[str]:
    """Return the files that determine a package's Python modules in the devel space.

    This is only the package's `setup.py`, or nothing if the package has no Python setup.
    """
    setup = os.path.join(project.folder, "setup.py")
    return [setup] if project.has_python_setup else []


def write_devel_files(project: Project, layout: WorkspaceFolders, definitions: Definitions, say: Say) -> None:
    """Write the files of a package without compiled code to the devel space.

    Raises:
        SetupPyError: the package's `setup.py` fails.
        NotFound, BadConfigFile: a `.cfg` file does not exist or raises an error.
        OSError: the devel space cannot be written.
    """
    setup = python_setup(project)
    for file in project.config_files:
        # The module is generated on import. As in Noetic, run the file to report errors during the build.
        say(f"Generating dynamic reconfigure files from {file}")
        path = Path(project.folder, file)
        if not path.is_file():
            raise NotFound(f"{path} does not exist; {project.file} names it as a .cfg file")
        cfg_file.read(path)
    for line in _missing(setup):
        say(f"-- WARNING: {line}")
    _write_python_packages(project, setup, layout.devel, say)
    if project.interfaces:
        _write_stubs(project, definitions, layout.devel)
    _write_relays(project, setup, layout.devel)
    _write_hooks(project, layout.devel, is_installed=False)


def _missing(setup: PythonSetup | None) -> list[str]:
    """Return a line for each folder and file in `setup.py` that does not exist, and for what is left out.

    Raises:
        PiprosError: a script does not exist, which is an error in genuine catkin, too.
    """
    if setup is None:
        return []
    for script in setup.scripts:
        if not os.path.isfile(script):
            raise PiprosError(f"{script} does not exist; setup.py lists it in scripts")
    absent = [path for path in setup.files if not os.path.exists(path)]
    return [*(f"setup.py names {path}, which does not exist" for path in absent), *setup.left_out]


def write_over_genuine(project: Project, devel: Path) -> None:
    """Write the programs and environment hooks of a package that genuine catkin built.

    The programs replace those that catkin wrote, which run Python scripts with the ROS installation's
    interpreter.

    Raises:
        SetupPyError: the package's `setup.py` fails.
        OSError: the devel space cannot be written.
    """
    setup = python_setup(project)
    _write_relays(project, setup, devel)
    _write_hooks(project, devel, is_installed=False)


def _write_relays(project: Project, setup: PythonSetup | None, devel: Path) -> None:
    """Write programs that run a package's scripts in the source space."""
    relays: dict[Path, str] = {}
    for item in project.installations:
        if item.is_python and item.copy is not None and not os.path.isabs(item.copy.target):
            relays[devel / item.copy.target / os.path.basename(item.source)] = item.source
    for script in setup.scripts if setup else ():
        for folder in _script_folders(project, devel):
            relays[folder / os.path.basename(script)] = script
    for relay, script in relays.items():
        write_if_changed(relay, _RELAY.format(script=script))
        relay.chmod(0o755)
    if setup is not None:
        _write_entry_points(setup, devel)


def _script_folders(project: Project, prefix: Path) -> tuple[Path, Path]:
    """Return the folders of scripts in `setup.py`: genuine catkin's, and that of `rosrun`."""
    return prefix / "bin", prefix / "lib" / project.name


def _write_entry_points(setup: PythonSetup, prefix: Path) -> None:
    for name, target in setup.entry_points.items():
        module, _, function = target.partition(":")
        write_if_changed(prefix / "bin" / name, _ENTRY_POINT.format(module=module, function=function))
        (prefix / "bin" / name).chmod(0o755)


def _write_hooks(project: Project, prefix: Path, *, is_installed: bool) -> None:
    """Write a package's environment hooks to the folder that the setup files read."""
    for hook in project.hooks:
        try:
            text = read_text(hook.source) if hook.text is None else hook.text
        except UnicodeDecodeError as error:
            raise PiprosError(f"{hook.source}: an environment hook must be UTF-8: {error}") from error
        if is_installed and hook.installed is not None:
            text = hook.installed
        write_if_changed(prefix / HOOKS_FOLDER / hook.name, text)


def _write_python_packages(project: Project, setup: PythonSetup | None, devel: Path, say: Say) -> None:
    modules = devel / PYTHON_DESTINATION
    packages = dict(setup.packages) if setup else {}
    if project.interfaces:
        for interface in project.interfaces:
            say(f"Generating Python from {interface.kind.upper()} {project.name}/{interface.name}")
    if project.interfaces or project.config_files:
        packages.setdefault(project.name, "")
    for name, folder in packages.items():
        if "." in name:
            continue  # Python finds subpackages through their parent package
        template = _PACKAGE
        if folder and os.path.isdir(folder):
            has_init = os.path.isfile(os.path.join(folder, "__init__.py"))
            template = _RELAYED_PACKAGE if has_init else _FOLDER_PACKAGE
        write_if_changed(modules / name / "__init__.py", template.format(name=name, folder=folder))
    for name, file in setup.modules.items() if setup else ():
        write_if_changed(
            modules.joinpath(*name.split(".")).with_suffix(".py"), _RELAYED_MODULE.format(file=file)
        )
    if project.interfaces:
        say(f"Generating Python msg __init__.py for {project.name}")
        say(f"[100%] Built target {project.name}_generate_messages")


def _write_stubs(project: Project, definitions: Definitions, prefix: Path) -> None:
    """Write type stubs for editors, because message classes are only generated on import."""
    try:
        stubs = package_stubs(project.name, definitions, has_module=True)
    except (DefinitionError, NotFound):
        return  # the package does not list the invalid file, so the build ignores it
    for path, text in stubs.items():
        write_if_changed(prefix / PYTHON_DESTINATION / project.name / path, text)


def install_package(
    project: Project,
    layout: WorkspaceFolders,
    definitions: Definitions,
    settings: Mapping[str, str],
    say: Say,
    setup: PythonSetup | None,
) -> None:
    """Copy the files that a package installs, and write type stubs for its messages.

    The build of a package's wheel also calls this function, so the wheel contains the same files.

    Args:
        settings: CMake variables for `install(CODE)` and `install(SCRIPT)`.
        setup: the package's `setup.py`, which `python_setup` reads.

    Raises:
        PiprosError, OSError: a file is missing, or cannot be copied.
    """
    share = layout.install / "share" / project.name
    copy_file(Path(project.folder) / "package.xml", share / "package.xml", say)
    for interface in project.interfaces:
        if interface.folder is not None:
            copy_file(Path(interface.path), share / interface.folder / os.path.basename(interface.path), say)
    for file in project.config_files:
        copy_file(Path(project.folder, file), share / "cfg" / os.path.basename(file), say)
    for name, extra in project.installed_extras.items():
        copy_file(Path(extra), share / "cmake" / name, say)
    if project.installed_extras:
        write_if_changed(share / EXTRAS, "".join(f"{name}\n" for name in project.installed_extras))
    modules = layout.install / PYTHON_DESTINATION
    if setup is not None:
        _install_setup(project, setup, layout.install, say)
    has_modules = bool(project.interfaces or project.config_files)
    if has_modules and (setup is None or project.name not in setup.packages):
        write_if_changed(modules / project.name / "__init__.py", _PACKAGE.format(name=project.name))
    if project.interfaces:
        _write_stubs(project, definitions, layout.install)
    _write_hooks(project, layout.install, is_installed=True)
    for item in project.installations:
        install(item, layout.install, settings, say)


def _install_setup(project: Project, setup: PythonSetup, prefix: Path, say: Say) -> None:
    """Copy the packages, modules, scripts and data files that `setup.py` names."""
    for line in _missing(setup):
        say(f"-- WARNING: {line}")
    modules = prefix / PYTHON_DESTINATION
    for name, folder in setup.packages.items():
        below = os.path.join(*name.split("."))
        copy(Copy(f"{folder}/", below, is_folder=True, keeps_permissions=True), modules, say)
    for name, file in setup.modules.items():
        if os.path.isfile(file):
            copy_file(Path(file), modules.joinpath(*name.split(".")).with_suffix(".py"), say)
    for below, file in setup.data_files:
        target = Path(os.path.normpath(prefix / below))
        if not target.is_relative_to(prefix):
            say(f"-- WARNING: setup.py: {file} is left out: {below} is outside of the installation")
        elif os.path.isfile(file):
            copy_file(Path(file), target / os.path.basename(file), say)
    for script in setup.scripts:
        for target in _script_folders(project, prefix):
            copy_file(Path(script), target / os.path.basename(script), say, mode=PROGRAM_MODE)
    _write_entry_points(setup, prefix)
