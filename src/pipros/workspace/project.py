"""What a package's `CMakeLists.txt` asks for: messages, scripts, installation, programs to compile, tests.

The file is carried out command by command, like CMake does it, but only as far as packages without
compiled code need it. What would need a compiler is noted with its place, for the real CMake to do.
"""

from __future__ import annotations

import glob
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from pipros.workspace.cmake import CMakeError, Command
from pipros.workspace.cmake_interpreter import Action, Interpreter
from pipros.workspace.cmake_names import BUILTIN_COMMANDS, CATKIN_COMMANDS, COMPONENT_COMMANDS

PYTHON_DESTINATION = "lib/python3/dist-packages"


@dataclass(frozen=True, slots=True)
class Interface:
    """A message, service or action file; `kind` is msg, srv or action."""

    kind: str
    name: str
    path: str


@dataclass(frozen=True, slots=True)
class Installation:
    """Something that `install` copies; `kind` is program, file or folder, `target` a folder to put it in.

    Attributes:
        is_python: a script of `catkin_install_python`, which the devel space relays to.
    """

    kind: str
    source: str
    target: str
    is_python: bool = False


@dataclass(frozen=True, slots=True)
class NativeTarget:
    """Something that only the real CMake can make."""

    command: str
    name: str
    line: int


@dataclass(frozen=True, slots=True)
class TestEntry:
    """A test that `run_tests` runs.

    Attributes:
        kind: `rostest` for a launch file with tests, `roslaunch` for a launch file or folder to be checked,
            `python` for a file or folder of unit tests.
        arguments: of the launch file; options and variables for a check.
    """

    kind: str
    path: str
    arguments: tuple[str, ...] = ()


@dataclass(slots=True)
class Project:
    """A package as its `CMakeLists.txt` has it."""

    name: str
    folder: str
    file: str
    components: list[tuple[str, int]] = field(default_factory=list)
    interfaces: list[Interface] = field(default_factory=list)
    generate_messages_line: int = 0
    message_dependencies: list[str] = field(default_factory=list)
    catkin_depends: list[tuple[str, int]] = field(default_factory=list)
    has_catkin_package: bool = False
    has_python_setup: bool = False
    installations: list[Installation] = field(default_factory=list)
    native_targets: list[NativeTarget] = field(default_factory=list)
    tests: list[TestEntry] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def read_project(
    folder: str, name: str, variables: Mapping[str, str], environment: Mapping[str, str]
) -> Project:
    """Carries out the `CMakeLists.txt` of a package.

    Args:
        name: the package's name in its manifest.
        variables: what `-D` gave on the command line, and the folders of the workspace.

    Raises:
        CMakeError: with file and line, for what CMake would refuse as well.
    """
    file = os.path.join(folder, "CMakeLists.txt")
    project = Project(name, folder, file)
    settings = {
        "CATKIN_ENABLE_TESTING": "ON",
        "CATKIN_PACKAGE_BIN_DESTINATION": f"lib/{name}",
        "CATKIN_PACKAGE_LIB_DESTINATION": "lib",
        "CATKIN_PACKAGE_SHARE_DESTINATION": f"share/{name}",
        "CATKIN_PACKAGE_INCLUDE_DESTINATION": f"include/{name}",
        "CATKIN_PACKAGE_PYTHON_DESTINATION": f"{PYTHON_DESTINATION}/{name}",
        "CATKIN_PACKAGE_ETC_DESTINATION": f"etc/{name}",
        "CATKIN_GLOBAL_BIN_DESTINATION": "bin",
        "CATKIN_GLOBAL_LIB_DESTINATION": "lib",
        "CATKIN_GLOBAL_SHARE_DESTINATION": "share",
        "CATKIN_GLOBAL_INCLUDE_DESTINATION": "include",
        "CATKIN_GLOBAL_PYTHON_DESTINATION": PYTHON_DESTINATION,
        "CATKIN_GLOBAL_ETC_DESTINATION": "etc",
        "UNIX": "1",
        **variables,
    }
    _Reader(project, settings, environment).read()
    return project


class _Reader:
    """What the commands of CMake and catkin mean for a package; it is collected in the project."""

    def __init__(self, project: Project, variables: dict[str, str], environment: Mapping[str, str]) -> None:
        self._project = project
        self._components: set[str] = set()
        self._has_foreign_packages = False
        actions: dict[str, Action] = {
            "project": self._set_project,
            "find_package": self._find_package,
            "add_message_files": self._add_interfaces,
            "add_service_files": self._add_interfaces,
            "add_action_files": self._add_interfaces,
            "generate_messages": self._generate_messages,
            "catkin_package": self._catkin_package,
            "catkin_metapackage": self._catkin_package,
            "catkin_python_setup": self._python_setup,
            "install": self._install,
            "catkin_install_python": self._install,
            "add_executable": self._native_target,
            "add_library": self._native_target,
            "add_rostest": self._add_test,
            "catkin_add_nosetests": self._add_test,
            "roslaunch_add_file_check": self._add_check,
            "message": self._message,
        }
        self._interpreter = Interpreter(
            variables, environment, actions, self._check_is_known, project.notes.append
        )
        self._variables = variables

    def read(self) -> None:
        self._interpreter.run_file(self._project.file)

    def _check_is_known(self, command: Command) -> None:
        name = command.name
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
        if self._has_foreign_packages:
            self._project.native_targets.append(NativeTarget(command.written_name, "", command.line))
            return
        from difflib import get_close_matches

        near = get_close_matches(name, [*BUILTIN_COMMANDS, *CATKIN_COMMANDS], n=1, cutoff=0.8)
        hint = f"\n  Did you mean {near[0]}?" if near else ""
        raise self._error(command, f'Unknown CMake command "{command.written_name}".{hint}')

    def _set_project(self, command: Command, words: list[str]) -> None:
        name = words[0] if words else ""
        if name != self._project.name:
            raise self._error(
                command,
                f"The project is named [{name}], but package.xml names the package [{self._project.name}]",
            )
        self._variables["PROJECT_NAME"] = self._variables["CMAKE_PROJECT_NAME"] = name
        for variable in ("PROJECT_SOURCE_DIR", "CMAKE_SOURCE_DIR", f"{name}_SOURCE_DIR"):
            self._variables[variable] = self._variables["CMAKE_CURRENT_SOURCE_DIR"]

    def _find_package(self, command: Command, words: list[str]) -> None:
        if not words:
            raise self._error(command, "find_package() called with incorrect number of arguments")
        if words[0] != "catkin":
            self._components.add(words[0])
            self._variables[f"{words[0]}_FOUND"] = "1"
            self._has_foreign_packages = self._has_foreign_packages or words[0] not in _HARMLESS_PACKAGES
            return
        self._variables["catkin_FOUND"] = "1"
        if "COMPONENTS" in words:
            names = words[words.index("COMPONENTS") + 1 :]
            self._components.update(names)
            self._project.components += [(name, command.line) for name in names]

    def _add_interfaces(self, command: Command, words: list[str]) -> None:
        kind = {"add_message_files": "msg", "add_service_files": "srv"}.get(command.name, "action")
        options = _sections(words, ("DIRECTORY", "FILES", "BASE_DIR"), ("NOINSTALL",))
        folder = (options["DIRECTORY"] or [kind])[0]
        place = os.path.join(self._variables["CMAKE_CURRENT_SOURCE_DIR"], folder)
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
        options = _sections(words, ("DEPENDENCIES", "LANGS"))
        if self._project.has_catkin_package:
            raise self._error(command, "generate_messages() must be called before catkin_package()")
        self._project.generate_messages_line = command.line
        self._project.message_dependencies += options["DEPENDENCIES"]

    def _catkin_package(self, command: Command, words: list[str]) -> None:
        keys = ("INCLUDE_DIRS", "LIBRARIES", "CATKIN_DEPENDS", "DEPENDS", "CFG_EXTRAS", "EXPORTED_TARGETS")
        options = _sections(words, keys, ("SKIP_CMAKE_CONFIG_GENERATION", "SKIP_PKG_CONFIG_GENERATION"))
        self._project.has_catkin_package = True
        self._project.catkin_depends += [(name, command.line) for name in options["CATKIN_DEPENDS"]]
        for folder in options["INCLUDE_DIRS"]:
            if not os.path.isdir(os.path.join(self._variables["CMAKE_CURRENT_SOURCE_DIR"], folder)):
                raise self._error(
                    command,
                    f"catkin_package() include dir '{folder}' does not exist relative to "
                    f"'{self._project.folder}'",
                )

    def _python_setup(self, command: Command, _words: list[str]) -> None:
        if not os.path.isfile(os.path.join(self._project.folder, "setup.py")):
            raise self._error(
                command, "catkin_python_setup() called without 'setup.py' in the package's folder"
            )
        if self._project.has_catkin_package:
            raise self._error(command, "catkin_python_setup() must be called before catkin_package()")
        self._project.has_python_setup = True

    def _install(self, command: Command, words: list[str]) -> None:
        keys = ("PROGRAMS", "FILES", "DIRECTORY", "TARGETS", "DESTINATION", "RENAME", "CODE", "SCRIPT",
                "PATTERN", "PERMISSIONS", "COMPONENT", "ARCHIVE", "LIBRARY", "RUNTIME", "EXPORT")  # fmt: skip
        options = _sections(words, keys, ("OPTIONAL", "USE_SOURCE_PERMISSIONS", "FILES_MATCHING"))
        target = (options["DESTINATION"] or [""])[0]
        is_python = command.name == "catkin_install_python"
        for key, kind in (("PROGRAMS", "program"), ("FILES", "file"), ("DIRECTORY", "folder")):
            for word in options[key]:
                source = os.path.join(self._variables["CMAKE_CURRENT_SOURCE_DIR"], word)
                if is_python and not os.path.isfile(source):
                    raise self._error(command, f"catkin_install_python() cannot find the script {source}")
                self._project.installations.append(Installation(kind, source, target, is_python))

    def _native_target(self, command: Command, words: list[str]) -> None:
        if not {"IMPORTED", "INTERFACE", "ALIAS"} & set(words[1:3]):
            name = words[0] if words else ""
            self._project.native_targets.append(NativeTarget(command.written_name, name, command.line))

    def _add_test(self, command: Command, words: list[str]) -> None:
        if not words:
            raise self._error(command, f"{command.name}() called without a file")
        kind = "rostest" if "rostest" in command.name else "python"
        options = _sections(words[1:], ("ARGS", "DEPENDENCIES", "WORKING_DIRECTORY"))
        path = os.path.join(self._variables["CMAKE_CURRENT_SOURCE_DIR"], words[0])
        self._project.tests.append(TestEntry(kind, path, tuple(options["ARGS"])))

    def _add_check(self, command: Command, words: list[str]) -> None:
        if not words:
            raise self._error(command, f"{command.name}() called without a file")
        switches = {"IGNORE_UNSET_ARGS": "-i", "USE_TEST_DEPENDENCIES": "-t"}
        options = tuple(switches[word] for word in words if word in switches)
        variables = _sections(words[1:], ("DEPENDENCIES",), tuple(switches))[""]
        path = os.path.join(self._variables["CMAKE_CURRENT_SOURCE_DIR"], words[0])
        self._project.tests.append(TestEntry("roslaunch", path, (*options, *variables)))

    def _message(self, command: Command, words: list[str]) -> None:
        if words[:1] in (["FATAL_ERROR"], ["SEND_ERROR"]):
            raise self._error(command, " ".join(words[1:]))

    def _error(self, command: Command, reason: str) -> CMakeError:
        return self._interpreter.error(command, reason)


# Packages that bring no commands which a package without compiled code would call.
_HARMLESS_PACKAGES = frozenset(
    (
        "rostest",
        "roslaunch",
        "roslint",
        "rosunit",
        "Boost",
        "Threads",
        "PythonInterp",
        "PythonLibs",
        "Eigen3",
        "OpenCV",
    )
)


def _sections(
    words: Sequence[str], keys: Sequence[str], switches: Sequence[str] = ()
) -> dict[str, list[str]]:
    """The words sorted by the keyword that stands before them; those before the first one are below ''."""
    found: dict[str, list[str]] = {key: [] for key in ("", *keys)}
    current = ""
    for word in words:
        if word in switches:
            continue
        if word in found:
            current = word
        else:
            found[current].append(word)
    return found
