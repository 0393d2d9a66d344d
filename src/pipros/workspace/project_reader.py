"""Reads a package's `CMakeLists.txt`: what the commands of CMake and catkin mean for it.

The file is carried out command by command, like CMake does it, as far as packages without compiled code need
it. What only the real CMake can do is noted with its place.
"""

from __future__ import annotations

import glob
import os
from collections.abc import Callable, Mapping, Sequence

from pipros.workspace import testing_commands
from pipros.workspace.cmake.configure import configured
from pipros.workspace.cmake.interpreter import Action, Interpreter
from pipros.workspace.cmake.language import CMakeError, Command
from pipros.workspace.cmake.messages import Kind, read_message
from pipros.workspace.cmake.names import (
    BEYOND_COMMANDS,
    BUILTIN_COMMANDS,
    CATKIN_COMMANDS,
    COMPONENT_COMMANDS,
    CORE_PACKAGES,
)
from pipros.workspace.cmake.scope import Scope, Unsupported
from pipros.workspace.cmake.words import sections
from pipros.workspace.cmake_packages import (
    FOUND_VARIABLES,
    HARMLESS_MODULES,
    HARMLESS_PACKAGES,
    usual_variables,
)
from pipros.workspace.installation import read_installations
from pipros.workspace.project import EnvironmentHook, Interface, NativeTarget, Project

FindExtras = Callable[[str], Sequence[str] | None]
"""The CMake files that a package has for those that find it; None when there is no such package."""


def read_project(
    folder: str,
    name: str,
    settings: Mapping[str, str],
    environment: Mapping[str, str],
    find_extras: FindExtras = lambda _name: (),
    version: str = "",
) -> Project:
    """Carries out the `CMakeLists.txt` of a package; programs are run and files written, as CMake does it.

    Args:
        name: the package's name in its manifest.
        settings: what `-D` gave on the command line, and the folders of the workspace.
        version: the package's version in its manifest.

    Raises:
        CMakeError: with file and line, for what CMake would refuse as well.
    """
    project = Project(name, folder, os.path.join(folder, "CMakeLists.txt"))
    return _Reader(project, settings, environment, find_extras, version).read()


class _Reader:
    """What the commands mean for a package; it is collected in the project."""

    def __init__(
        self,
        project: Project,
        settings: Mapping[str, str],
        environment: Mapping[str, str],
        find_extras: FindExtras,
        version: str,
    ) -> None:
        self._project = project
        self._version = version
        self._find_extras = find_extras
        self._components: set[str] = set()
        self._has_foreign_packages = False
        variables = usual_variables(project.name, project.folder)
        usual = {name: value for name, value in variables.items() if name not in settings}
        scope = Scope(usual, {"CATKIN_ENABLE_TESTING": "ON", **settings}, environment)
        scope.cache.setdefault("CMAKE_CURRENT_BINARY_DIR", os.path.join(project.folder, "build"))
        project.binary = scope.values["CMAKE_CURRENT_BINARY_DIR"]
        actions: dict[str, Action] = {
            "project": self._set_project,
            "find_package": self._find_package,
            "include_module": self._include_module,
            "add_message_files": self._add_interfaces,
            "add_service_files": self._add_interfaces,
            "add_action_files": self._add_interfaces,
            "generate_messages": self._generate_messages,
            "catkin_package": self._catkin_package,
            "catkin_metapackage": self._catkin_package,
            "catkin_python_setup": self._python_setup,
            "catkin_add_env_hooks": self._add_hooks,
            "install": self._install,
            "catkin_install_python": self._install,
            "add_executable": self._native_target,
            "add_library": self._native_target,
            "add_custom_target": self._custom,
            "add_custom_command": self._custom,
            "add_dependencies": self._custom,
            "generate_dynamic_reconfigure_options": self._dynamic_reconfigure,
            "message": self._message,
            **dict.fromkeys(testing_commands.NAMES, self._test),
        }
        self._interpreter = Interpreter(
            scope,
            actions,
            check=self._check_is_known,
            beyond=self._note_beyond,
            targets=project.targets,
        )
        self._values = scope.values

    def read(self) -> Project:
        self._interpreter.run_file(self._project.file)
        return self._project

    def _check_is_known(self, command: Command) -> None:
        name = command.name
        if name in BEYOND_COMMANDS:
            self._note_beyond(command, f"{command.written_name}()")
        if name in BUILTIN_COMMANDS or name in CATKIN_COMMANDS:
            needed = COMPONENT_COMMANDS.get(name)
            if needed is None or self._components.intersection(needed):
                return
            wanted = needed[0]
            raise self._error(
                command,
                f'Unknown CMake command "{command.written_name}".\n  It comes with {wanted}: '
                f"add {wanted} to find_package(catkin REQUIRED COMPONENTS …) and to package.xml",
            )
        from difflib import get_close_matches

        near = get_close_matches(name, [*BUILTIN_COMMANDS, *CATKIN_COMMANDS], n=1, cutoff=0.8)
        if self._has_foreign_packages and not near:
            self._note_beyond(command, f"{command.written_name}(), which another package brings")
            return
        hint = f"\n  Did you mean {near[0]}?" if near else ""
        raise self._error(command, f'Unknown CMake command "{command.written_name}".{hint}')

    def _note_beyond(self, command: Command, what: str) -> None:
        self._note_native(command, f"needs {what}, which only CMake itself carries out")

    def _note_native(self, command: Command, what: str) -> None:
        self._project.native_targets.append(NativeTarget(what, self._interpreter.file, command.line))

    def _set_project(self, command: Command, words: list[str]) -> None:
        name = words[0] if words else ""
        values = self._values
        if self._interpreter.file == self._project.file:
            if name != self._project.name:
                raise self._error(
                    command,
                    f"The project is named [{name}], but package.xml names the package "
                    f"[{self._project.name}]",
                )
            values["CMAKE_PROJECT_NAME"] = "Project"  # that of the workspace
        options = sections(words[1:], ("VERSION", "DESCRIPTION", "HOMEPAGE_URL", "LANGUAGES"))
        values["PROJECT_NAME"] = name
        for key, value in (
            ("SOURCE_DIR", values["CMAKE_CURRENT_SOURCE_DIR"]),
            ("BINARY_DIR", values["CMAKE_CURRENT_BINARY_DIR"]),
            ("VERSION", "".join(options["VERSION"])),
            ("DESCRIPTION", "".join(options["DESCRIPTION"])),
        ):
            values[f"PROJECT_{key}"] = values[f"{name}_{key}"] = value

    def _find_package(self, command: Command, words: list[str]) -> None:
        if not words:
            raise self._error(command, "find_package() called with incorrect number of arguments")
        name, *rest = words
        if name == "catkin":
            names = sections(rest, ("COMPONENTS", "OPTIONAL_COMPONENTS"), ("REQUIRED", "QUIET"))
            for component in names["COMPONENTS"]:
                self._find_component(command, component)
        else:
            self._components.add(name)
            if name not in HARMLESS_PACKAGES and name not in CORE_PACKAGES:
                self._has_foreign_packages = True
                self._run_extras(name)
        for variable, value in FOUND_VARIABLES.get(name, {}).items():
            self._values[variable] = value
        self._values[f"{name}_FOUND"] = "1"

    def _find_component(self, command: Command, name: str) -> None:
        self._components.add(name)
        self._project.components.append((name, command.line))
        self._values[f"{name}_FOUND"] = "1"
        if name not in CORE_PACKAGES and not self._run_extras(name):
            raise self._error(
                command,
                f'Could not find a package configuration file provided by "{name}" with any of the following '
                f"names:\n\n    {name}Config.cmake\n    {name.lower()}-config.cmake\n\n"
                f"  There is no package [{name}] in this workspace, on ROS_PACKAGE_PATH, or with pipros.",
            )

    def _run_extras(self, name: str) -> bool:
        """Carries out what a package has for those that find it; False when there is no such package."""
        files = self._find_extras(name)
        for file in files or ():
            if file.endswith(".em"):
                self._has_foreign_packages = True
            elif file.endswith(".in"):
                with open(file, encoding="utf-8", errors="replace") as opened:
                    text = configured(opened.read(), self._interpreter.scope, at_only=True)
                self._interpreter.run_text(text, file)
            else:
                self._interpreter.run_file(file)
        return files is not None

    def _include_module(self, _command: Command, words: list[str]) -> None:
        if words[0] not in HARMLESS_MODULES:
            self._has_foreign_packages = True

    def _add_interfaces(self, command: Command, words: list[str]) -> None:
        kind = {"add_message_files": "msg", "add_service_files": "srv"}.get(command.name, "action")
        options = sections(words, ("DIRECTORY", "FILES", "BASE_DIR"), ("NOINSTALL",))
        folder = (options["DIRECTORY"] or [kind])[0]
        place = os.path.join(self._values["CMAKE_CURRENT_SOURCE_DIR"], folder)
        files = options["FILES"]
        if "FILES" not in words:
            files = sorted(os.path.basename(path) for path in glob.glob(os.path.join(place, f"*.{kind}")))
        for file in files:
            path = os.path.join(place, file)
            if not os.path.isfile(path):
                raise self._error(command, f"{command.name}() was given a file that does not exist: {path}")
            name = os.path.splitext(os.path.basename(file))[0]
            self._project.interfaces.append(Interface(kind, name, path))

    def _generate_messages(self, command: Command, words: list[str]) -> None:
        options = sections(words, ("DEPENDENCIES", "LANGS"))
        if self._project.has_catkin_package:
            raise self._error(command, "generate_messages() must be called before catkin_package()")
        self._project.generate_messages_line = command.line
        self._project.message_dependencies += options["DEPENDENCIES"]
        for ending in ("", "_py", "_cpp", "_lisp", "_eus", "_nodejs"):
            self._project.targets.add(f"{self._project.name}_generate_messages{ending}")

    def _catkin_package(self, command: Command, words: list[str]) -> None:
        keys = ("INCLUDE_DIRS", "LIBRARIES", "CATKIN_DEPENDS", "DEPENDS", "CFG_EXTRAS", "EXPORTED_TARGETS")
        options = sections(words, keys, ("SKIP_CMAKE_CONFIG_GENERATION", "SKIP_PKG_CONFIG_GENERATION"))
        self._project.has_catkin_package = True
        self._values[f"{self._project.name}_VERSION"] = self._version
        self._project.catkin_depends += [(name, command.line) for name in options["CATKIN_DEPENDS"]]
        source = self._values["CMAKE_CURRENT_SOURCE_DIR"]
        for folder in options["INCLUDE_DIRS"]:
            if not os.path.isdir(os.path.join(source, folder)):
                raise self._error(
                    command,
                    f"catkin_package() include dir '{folder}' does not exist relative to "
                    f"'{self._project.folder}'",
                )
        for name in options["CFG_EXTRAS"]:
            self._project.extras.append(self._extra(command, os.path.join(source, "cmake", name)))

    def _extra(self, command: Command, path: str) -> str:
        for candidate in (path, f"{path}.in", f"{path}.develspace.in", f"{path}.em", f"{path}.develspace.em"):
            if os.path.isfile(candidate):
                return candidate
        raise self._error(command, f"catkin_package() could not find CFG_EXTRAS file: {path}")

    def _python_setup(self, command: Command, _words: list[str]) -> None:
        if not os.path.isfile(os.path.join(self._project.folder, "setup.py")):
            raise self._error(
                command, "catkin_python_setup() called without 'setup.py' in the package's folder"
            )
        if self._project.has_catkin_package:
            raise self._error(command, "catkin_python_setup() must be called before catkin_package()")
        self._project.has_python_setup = True

    def _add_hooks(self, command: Command, words: list[str]) -> None:
        options = sections(words, ("SHELLS", "DIRECTORY"), ("SKIP_INSTALL",))
        folder = self._interpreter.scope.in_source((options["DIRECTORY"] or ["env-hooks"])[0])
        for shell in options["SHELLS"]:
            base = os.path.join(folder, f"{''.join(options[''])}.{shell}")
            self._project.hooks.append(self._hook(command, base))

    def _hook(self, command: Command, base: str) -> EnvironmentHook:
        name = os.path.basename(base)
        if os.path.isfile(base):
            return EnvironmentHook(name, base)
        for ending in (".in", ".develspace.in", ".buildspace.in"):
            if os.path.isfile(base + ending):
                with open(base + ending, encoding="utf-8", errors="replace") as file:
                    text = configured(file.read(), self._interpreter.scope, at_only=True)
                return EnvironmentHook(name, base + ending, text)
        if any(os.path.isfile(base + ending) for ending in (".em", ".develspace.em", ".buildspace.em")):
            self._note_beyond(command, f"the template {base}.em")
            return EnvironmentHook(name, base, "")
        raise self._error(command, f"catkin_add_env_hooks() could not find environment hook {base}")

    def _install(self, command: Command, words: list[str]) -> None:
        is_python = command.name == "catkin_install_python"
        try:
            found = read_installations(words, self._interpreter.scope.in_source, is_python=is_python)
        except ValueError as error:
            raise self._error(command, str(error)) from None
        for one in found:
            is_made = one.source in self._project.steps.rules or one.source.startswith(self._project.binary)
            if is_python and not is_made and not os.path.isfile(one.source):
                raise self._error(command, f"catkin_install_python() cannot find the script {one.source}")
        self._project.installations += found

    def _native_target(self, command: Command, words: list[str]) -> None:
        if words:
            self._project.targets.add(words[0])
        if not {"IMPORTED", "INTERFACE", "ALIAS"} & set(words[1:3]):
            self._note_native(command, f"compiles [{words[0] if words else command.written_name}]")

    def _custom(self, command: Command, words: list[str]) -> None:
        steps, scope = self._project.steps, self._interpreter.scope
        place = self._interpreter.file, command.line
        try:
            if command.name == "add_custom_target":
                steps.add_target(words, scope, *place)
                self._project.targets.add(words[0])
            elif command.name == "add_custom_command":
                steps.add_command(words, scope, *place)
            else:
                steps.add_dependencies(words)
        except Unsupported as error:
            self._note_beyond(command, str(error))
        except ValueError as error:
            raise self._error(command, str(error)) from None

    def _dynamic_reconfigure(self, command: Command, words: list[str]) -> None:
        self._note_native(
            command, f"makes code of [{' '.join(words)}], for which pipros has no dynamic_reconfigure"
        )

    def _test(self, command: Command, words: list[str]) -> None:
        try:
            place = f"{self._interpreter.file}:{command.line}"
            testing_commands.carry_out(command.name, words, self._project, self._interpreter.scope, place)
        except ValueError as error:
            raise self._error(command, str(error)) from None

    def _message(self, command: Command, words: list[str]) -> None:
        kind, text = read_message(words)
        if kind is Kind.ERROR:
            raise self._error(command, text)
        if kind is Kind.WARNING:
            self._project.notes.append(f"{self._interpreter.file}:{command.line}: {text}")
        elif kind is not Kind.NOTHING:
            self._project.remarks.append(f"-- {text}" if kind is Kind.STATUS else text)

    def _error(self, command: Command, reason: str) -> CMakeError:
        return self._interpreter.error(command, reason)
