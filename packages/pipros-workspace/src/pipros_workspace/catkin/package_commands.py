"""CMake commands that declare a package, its dependencies and its exports, and the command `message()`."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Mapping, Sequence

from pipros.basics.input_file import read_text
from pipros_workspace.catkin.context import FoundPackage, Handler, ReadContext
from pipros_workspace.catkin.names import CATKIN_VERSION, CORE_PACKAGES, INTERPRETED_PACKAGES
from pipros_workspace.catkin.project import AbsentPackage, EnvironmentHook
from pipros_workspace.catkin.templates import can_expand, expanded, extra_variables, needs_empy, write
from pipros_workspace.cmake.configure import configured
from pipros_workspace.cmake.language import Command
from pipros_workspace.cmake.message import MessageKind, read_message
from pipros_workspace.cmake.words import sections

_HARMLESS_PACKAGES = frozenset(
    ("Boost", "Threads", "PythonInterp", "PythonLibs", "Python", "Python2", "Python3", "Eigen3", "OpenCV")
)
"""Packages whose commands have no effect in a package without compiled code."""

_FOUND_VARIABLES: Mapping[str, Mapping[str, str]] = {
    "PythonInterp": {"PYTHONINTERP_FOUND": "1", "PYTHON_VERSION_MAJOR": "3"},
    "Python3": {"Python3_EXECUTABLE": sys.executable, "Python3_Interpreter_FOUND": "1"},
    "genmsg": {"GENMSG_LANGS_DESTINATION": "etc/ros/genmsg"},
    "Python": {"Python_EXECUTABLE": sys.executable, "Python_Interpreter_FOUND": "1"},
}
"""Variables that a found package or component sets in addition to `<name>_FOUND`."""


_COMPONENT_KEYWORDS = frozenset(("COMPONENTS", "OPTIONAL_COMPONENTS", "REQUIRED"))
_OTHER_KEYWORDS = frozenset(("CONFIG", "EXACT", "MODULE", "QUIET"))
_VERSION = re.compile(r"[0-9.]+((?<=[0-9.]\.\.\.)<[0-9.]+)?")


def _set_project(context: ReadContext, command: Command, words: list[str]) -> None:
    name = words[0] if words else ""
    values, project = context.scope.values, context.project
    if context.file == project.file:
        if name != project.name:
            raise context.error(
                command,
                f"The project is named [{name}], but package.xml names the package [{project.name}]",
            )
        values["CMAKE_PROJECT_NAME"] = "Project"  # set by the workspace's top-level file
    options = sections(words[1:], ("VERSION", "DESCRIPTION", "HOMEPAGE_URL", "LANGUAGES"))
    values["PROJECT_NAME"] = name
    for key, value in (
        ("SOURCE_DIR", values["CMAKE_CURRENT_SOURCE_DIR"]),
        ("BINARY_DIR", values["CMAKE_CURRENT_BINARY_DIR"]),
        ("VERSION", "".join(options["VERSION"])),
        ("DESCRIPTION", "".join(options["DESCRIPTION"])),
    ):
        values[f"PROJECT_{key}"] = values[f"{name}_{key}"] = value


def _find_package(context: ReadContext, command: Command, words: list[str]) -> None:
    if not words:
        raise ValueError("find_package() called with incorrect number of arguments")
    name, *rest = words
    values = context.scope.values
    if name == "catkin":
        values["catkin_VERSION"] = CATKIN_VERSION
        for component in _component_names(rest):
            _find_component(context, command, component, is_required="REQUIRED" in rest)
    else:
        context.components.add(name)
        if name == context.project.name and context.project.has_catkin_package:
            # CMake would find the configuration files that catkin_package() has just written
            context.run_extras(FoundPackage(context.version, context.project.cfg_extras))
            values[f"{name}_FOUND"] = "1"
            return
        package = None if name in _HARMLESS_PACKAGES else context.find_package(name)
        if package is not None:
            values[f"{name}_VERSION"] = package.version
        if name not in _HARMLESS_PACKAGES and name not in CORE_PACKAGES:
            context.has_foreign_packages = True
            _run_extras(context, name, package or FoundPackage())
    values.update(_FOUND_VARIABLES.get(name, {}))
    values[f"{name}_FOUND"] = "1"


def _component_names(words: Sequence[str]) -> list[str]:
    """Return the components that the arguments of `find_package()` name, including optional ones.

    Components may follow `REQUIRED` directly. If catkin is required, its optional components are required,
    too.
    """
    names: list[str] = []
    has_version = takes_names = False
    for word in words:
        if word in _COMPONENT_KEYWORDS:
            takes_names = True
        elif word in _OTHER_KEYWORDS or word.startswith("NO_"):
            takes_names = False
        elif not has_version and _VERSION.fullmatch(word):
            has_version = True
        elif takes_names:
            names.append(word)
        else:
            raise ValueError(f'find_package() called with invalid argument "{word}"')
    return names


def _find_component(context: ReadContext, command: Command, name: str, *, is_required: bool) -> None:
    package = context.find_package(name)
    if package is None and name not in CORE_PACKAGES:
        if not is_required:
            context.scope.values[f"{name}_FOUND"] = "0"
            return
        # CMake would stop here, but packages without compiled code can be built without this package.
        context.project.absent.append(
            AbsentPackage(
                name,
                str(
                    context.error(
                        command,
                        f'Could not find a package configuration file provided by "{name}" with any of the '
                        f"following names:\n\n    {name}Config.cmake\n    {name.lower()}-config.cmake\n\n"
                        f"  Package [{name}] was not found in this workspace, on ROS_PACKAGE_PATH, or among "
                        "the packages shipped with pipros.",
                    )
                ),
                context.place(command),
            )
        )
        context.has_foreign_packages = True  # the missing package may define commands
        context.scope.values[f"{name}_FOUND"] = "0"
        return
    context.components.add(name)
    context.project.components.append((name, command.line))
    context.scope.values.update({f"{name}_FOUND": "1", **_FOUND_VARIABLES.get(name, {})})
    if package is not None:
        context.scope.values[f"{name}_VERSION"] = package.version
        if name not in CORE_PACKAGES | INTERPRETED_PACKAGES:
            _run_extras(context, name, package)


def _run_extras(context: ReadContext, name: str, package: FoundPackage) -> None:
    if package.extras:
        first = min(package.extras, key=lambda file: "catkin_generated" in file)  # beside files it includes
        context.scope.values[f"{name}_DIR"] = os.path.dirname(first)
    context.run_extras(package)


def _catkin_package(context: ReadContext, command: Command, words: list[str]) -> None:
    project = context.project
    keys = ("INCLUDE_DIRS", "LIBRARIES", "CATKIN_DEPENDS", "DEPENDS", "CFG_EXTRAS", "EXPORTED_TARGETS")
    options = sections(words, keys, ("SKIP_CMAKE_CONFIG_GENERATION", "SKIP_PKG_CONFIG_GENERATION"))
    project.has_catkin_package = True
    context.scope.values[f"{project.name}_VERSION"] = context.version
    project.catkin_depends += [(name, command.line) for name in options["CATKIN_DEPENDS"]]
    source = context.scope.values["CMAKE_CURRENT_SOURCE_DIR"]
    for folder in options["INCLUDE_DIRS"]:
        if not os.path.isdir(os.path.join(source, folder)):
            raise context.error(
                command,
                f"catkin_package() include dir '{folder}' does not exist relative to '{project.folder}'",
            )
    for name in options["CFG_EXTRAS"]:
        path = os.path.join(source, "cmake", name)
        made = _extra(context, path, is_installed=False)
        if not made:
            raise context.error(command, f"catkin_package() could not find CFG_EXTRAS file: {path}")
        project.cfg_extras.append(made)
        if installed := _extra(context, path, is_installed=True):
            project.installed_extras[os.path.basename(path)] = installed


def _extra(context: ReadContext, path: str, *, is_installed: bool) -> str:
    """Return a CMake file of CFG_EXTRAS for the devel or the install space; empty if there is none.

    Templates are expanded in the scope of the package that has them, as in catkin.
    """
    space = "installspace" if is_installed else "develspace"
    target = os.path.join(context.project.binary, "catkin_generated", space, os.path.basename(path))
    for ending in ("", ".in", f".{space}.in", ".em", f".{space}.em"):
        source = path + ending
        if not os.path.isfile(source):
            continue
        if not ending:
            return source
        if ending.endswith(".in"):
            values = context.scope.values
            own = extra_variables(context, is_installed=is_installed)
            before = {name: values.get(name, "") for name in own}
            values.update(
                {
                    name: str(value).upper() if isinstance(value, bool) else value
                    for name, value in own.items()
                }
            )
            write(target, configured(read_text(source, errors="replace"), context.scope, at_only=True))
            values.update(before)
        elif can_expand():
            write(target, expanded(source, context, is_installed=is_installed))
        else:
            return "" if is_installed else source
        return target
    return ""


def _package_xml(context: ReadContext, _command: Command, _words: list[str]) -> None:
    context.scope.values[f"{context.project.name}_VERSION"] = context.version


def _python_setup(context: ReadContext, command: Command, words: list[str]) -> None:
    project = context.project
    if words:
        raise ValueError(f"catkin_python_setup() called with unused arguments: {';'.join(words)}")
    for is_too_late, name in (
        (project.generate_messages_line > 0, "generate_messages"),
        (project.has_reconfigure_options, "generate_dynamic_reconfigure_options"),
    ):
        if is_too_late:
            raise context.error(
                command,
                f"{name}() must be called after catkin_python_setup() in project '{project.name}'",
            )
    if not os.path.isfile(os.path.join(project.folder, "setup.py")):
        raise context.error(
            command, "catkin_python_setup() called without 'setup.py' in the package's folder"
        )
    project.has_python_setup = True


def _add_hooks(context: ReadContext, command: Command, words: list[str]) -> None:
    options = sections(words, ("SHELLS", "DIRECTORY"), ("SKIP_INSTALL",))
    folder = context.scope.in_source((options["DIRECTORY"] or ["env-hooks"])[0])
    for shell in options["SHELLS"]:
        base = os.path.join(folder, f"{''.join(options[''])}.{shell}")
        context.project.hooks.append(_hook(context, command, base))


def _hook(context: ReadContext, command: Command, base: str) -> EnvironmentHook:
    name = os.path.basename(base)
    if os.path.isfile(base):
        return EnvironmentHook(name, base)
    for ending in (".in", ".develspace.in", ".buildspace.in"):
        if os.path.isfile(base + ending):
            text = configured(read_text(base + ending, errors="replace"), context.scope, at_only=True)
            return EnvironmentHook(name, base + ending, text)
    for ending in (".develspace.em", ".buildspace.em", ".em"):
        if os.path.isfile(base + ending):
            return _hook_of_template(context, command, base, base + ending)
    raise context.error(command, f"catkin_add_env_hooks() could not find environment hook {base}")


def _hook_of_template(context: ReadContext, command: Command, base: str, template: str) -> EnvironmentHook:
    name = os.path.basename(base)
    if not can_expand():
        context.need_native_build(command, f"has the environment hook {template}, which {needs_empy()}")
        return EnvironmentHook(name, template, "")
    text = expanded(template, context)
    if os.path.isfile(f"{base}.installspace.em"):
        template = f"{base}.installspace.em"
    return EnvironmentHook(name, template, text, expanded(template, context, is_installed=True))


def _message(context: ReadContext, command: Command, words: list[str]) -> None:
    kind, text = read_message(words)
    if kind is MessageKind.ERROR:
        raise context.error(command, text)
    if kind is MessageKind.WARNING:
        context.project.warnings.append(f"{context.place(command)}: {text}")
    elif kind is not MessageKind.NOTHING:
        context.project.status_lines.append(f"-- {text}" if kind is MessageKind.STATUS else text)


COMMANDS: Mapping[str, Handler] = {
    "project": _set_project,
    "find_package": _find_package,
    "catkin_package": _catkin_package,
    "catkin_metapackage": _catkin_package,
    "catkin_package_xml": _package_xml,
    "catkin_python_setup": _python_setup,
    "catkin_add_env_hooks": _add_hooks,
    "message": _message,
}
