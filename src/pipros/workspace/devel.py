"""What one package puts into the devel space and the install space."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from pathlib import Path

from pipros.errors import NotFound
from pipros.msg.definitions import Definitions
from pipros.msg.spec import DefinitionError
from pipros.msg.stubs import package_stubs
from pipros.workspace.layout import Layout
from pipros.workspace.project import PYTHON_DESTINATION, Installation, Project
from pipros.workspace.setup_files import write_if_changed
from pipros.workspace.setup_py import PythonSetup, read_setup_py

Say = Callable[[str], None]

_RELAY = """\
#!/usr/bin/env python3
# Made by catkin_make of pipros: runs the script in the source space.
import os
import runpy
import sys

script = {script!r}
sys.path[0] = os.path.dirname(script)
runpy.run_path(script, run_name="__main__")
"""

_PACKAGE = '''\
"""Made by catkin_make of pipros: the Python modules of the ROS package {name}.

The classes of its messages and services are made from their definitions when they are first used.
"""
'''

_RELAYED_PACKAGE = (
    _PACKAGE
    + """
__path__.insert(0, {folder!r})
_init = __path__[0] + "/__init__.py"
with open(_init, encoding="utf-8") as _source:
    exec(compile(_source.read(), _init, "exec"))
"""
)


def python_sources(project: Project) -> list[str]:
    """Files that decide what the Python part of a package looks like."""
    setup = os.path.join(project.folder, "setup.py")
    return [setup] if project.has_python_setup else []


def write_devel_files(
    project: Project, layout: Layout, definitions: Definitions, say: Say, *, is_native: bool
) -> None:
    """Makes a package's part of the devel space.

    Args:
        is_native: whether genuine catkin makes the Python modules.

    Raises:
        SetupPyError: its `setup.py` fails.
        OSError: the devel space cannot be written.
    """
    setup = read_setup_py(project.folder) if project.has_python_setup else None
    if not is_native:
        _write_python_packages(project, setup, layout.devel, say)
        if project.interfaces:
            _write_stubs(project, definitions, layout.devel)
    relayed = [one.source for one in project.installations if one.is_python]
    relayed += list(setup.scripts) if setup else []
    for script in relayed:
        relay = layout.devel / "lib" / project.name / os.path.basename(script)
        write_if_changed(relay, _RELAY.format(script=script))
        relay.chmod(0o755)


def _write_python_packages(project: Project, setup: PythonSetup | None, devel: Path, say: Say) -> None:
    place = devel / PYTHON_DESTINATION
    packages = dict(setup.packages) if setup else {}
    if project.interfaces:
        for interface in project.interfaces:
            say(f"Generating Python from {interface.kind.upper()} {project.name}/{interface.name}")
        packages.setdefault(project.name, "")
    for name, folder in packages.items():
        if "." in name:
            continue  # it is found through the package that it is in
        init = place / name / "__init__.py"
        if folder and os.path.isfile(os.path.join(folder, "__init__.py")):
            write_if_changed(init, _RELAYED_PACKAGE.format(name=name, folder=folder))
        else:
            write_if_changed(init, _PACKAGE.format(name=name))
    if project.interfaces:
        say(f"Generating Python msg __init__.py for {project.name}")
        say(f"[100%] Built target {project.name}_generate_messages")


def _write_stubs(project: Project, definitions: Definitions, devel: Path) -> None:
    """Tells editors and type checkers what the classes look like that are made when they are imported."""
    try:
        stubs = package_stubs(project.name, definitions)
    except (DefinitionError, NotFound):
        return  # a file beside those that the package lists is broken
    for path, text in stubs.items():
        write_if_changed(devel / PYTHON_DESTINATION / project.name / path, text)


def install_package(project: Project, layout: Layout, say: Say) -> None:
    """Copies what a package installs.

    Raises:
        OSError: something to install is missing, or cannot be copied.
    """
    share = layout.install / "share" / project.name
    _copy(Path(project.folder) / "package.xml", share / "package.xml", say)
    for interface in project.interfaces:
        _copy(Path(interface.path), share / interface.kind / os.path.basename(interface.path), say)
    setup = read_setup_py(project.folder) if project.has_python_setup else None
    place = layout.install / PYTHON_DESTINATION
    for name, folder in (setup.packages if setup else {}).items():
        _copy_folder(Path(folder), place.joinpath(*name.split(".")), say)
    if project.interfaces and (setup is None or project.name not in setup.packages):
        write_if_changed(place / project.name / "__init__.py", _PACKAGE.format(name=project.name))
    for script in setup.scripts if setup else ():
        _copy(
            Path(script),
            layout.install / "lib" / project.name / os.path.basename(script),
            say,
            is_program=True,
        )
    for one in project.installations:
        _install_one(one, layout.install, say)


def _install_one(one: Installation, install: Path, say: Say) -> None:
    target = install / one.target
    source = Path(one.source)
    if one.kind == "folder":
        # As for cp: with a slash at its end, what is in the folder; without, the folder itself.
        _copy_folder(source, target if one.source.endswith("/") else target / source.name, say)
    else:
        _copy(source, target / source.name, say, is_program=one.kind == "program")


def _copy(source: Path, target: Path, say: Say, *, is_program: bool = False) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    if target.exists() and target.stat().st_mtime_ns == source.stat().st_mtime_ns:
        say(f"-- Up-to-date: {target}")
        return
    say(f"-- Installing: {target}")
    shutil.copy2(source, target)
    if is_program:
        target.chmod(0o755)


def _copy_folder(source: Path, target: Path, say: Say) -> None:
    for folder, folders, files in os.walk(source):
        folders[:] = [name for name in folders if not name.startswith(".") and name != "__pycache__"]
        below = target / os.path.relpath(folder, source)
        for name in files:
            _copy(Path(folder, name), Path(os.path.normpath(below / name)), say)
