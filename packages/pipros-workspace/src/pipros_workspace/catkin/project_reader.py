"""Read a package's `CMakeLists.txt`.

As in CMake, the file is executed command by command. The commands that packages without compiled code need
have handlers, in the tables `…COMMANDS`. For other CMake commands, the file and line are recorded as a
reason to build the package with genuine catkin.
"""

from __future__ import annotations

import glob
import os
import platform
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from pipros.basics.env import DISTRIBUTION
from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_text
from pipros.basics.windows import ON_WINDOWS, relative_path, with_slashes
from pipros_workspace.catkin import package_commands, templates
from pipros_workspace.catkin.context import FindPackage, FoundPackage, Handler, ReadContext
from pipros_workspace.catkin.installation import read_installations
from pipros_workspace.catkin.names import CATKIN_COMMANDS, COMPONENT_COMMANDS
from pipros_workspace.catkin.project import (
    PYTHON_DESTINATION,
    Download,
    Interface,
    Project,
    TestEntry,
    installed_extras,
)
from pipros_workspace.cmake.language import Command
from pipros_workspace.cmake.names import BEYOND_COMMANDS, BUILTIN_COMMANDS
from pipros_workspace.cmake.scope import Scope
from pipros_workspace.cmake.words import sections

_CHECK_SWITCHES = {"IGNORE_UNSET_ARGS": "-i", "USE_TEST_DEPENDENCIES": "-t"}


def _ctest(context: ReadContext, command: Command, words: list[str]) -> None:
    _require_file(command, words)
    place = context.place(command)
    context.project.warnings.append(f"{place}: add_test() is for ctest; run_tests does not run it")


def _download(context: ReadContext, command: Command, words: list[str]) -> None:
    _require_file(command, words)
    context.project.downloads.append(_read_download(words, context.scope))


def _launch_file_check(context: ReadContext, command: Command, words: list[str]) -> None:
    path = _existing_file(context, command, words)
    options = tuple(_CHECK_SWITCHES[word] for word in words if word in _CHECK_SWITCHES)
    arguments = sections(words[1:], ("DEPENDENCIES",), tuple(_CHECK_SWITCHES))[""]
    test = TestEntry("roslaunch", path, (*options, *arguments), words[0], place=context.place(command))
    context.project.tests.append(test)


def _rostest(context: ReadContext, command: Command, words: list[str]) -> None:
    path = _existing_file(context, command, words)
    arguments = tuple(sections(words[1:], ("ARGS", "DEPENDENCIES", "WORKING_DIRECTORY"))["ARGS"])
    _add(context, command, "rostest", path, arguments=arguments)


def _compiled_rostest(context: ReadContext, command: Command, words: list[str]) -> None:
    _require_file(command, words)
    path = _existing_file(context, command, words[1:2] or [""])
    _add(context, command, "rostest", path, target=words[0])


def _compiled_test(context: ReadContext, command: Command, words: list[str]) -> None:
    _require_file(command, words)
    test = TestEntry("gtest", words[0], target=words[0], place=context.place(command))
    context.project.tests.append(test)


def _python_tests(context: ReadContext, command: Command, words: list[str]) -> None:
    _add(context, command, "python", _existing_file(context, command, words))


def _add(
    context: ReadContext,
    command: Command,
    kind: str,
    path: str,
    *,
    arguments: tuple[str, ...] = (),
    target: str = "",
) -> None:
    # Keep a folder's trailing slash.
    written = with_slashes(path).removeprefix(f"{with_slashes(context.project.folder)}/")
    test = TestEntry(kind, path, arguments, written, target, context.place(command))
    context.project.tests.append(test)


def _require_file(command: Command, words: Sequence[str]) -> None:
    if not words:
        raise ValueError(f"{command.name}() called without arguments")


def _existing_file(context: ReadContext, command: Command, words: Sequence[str]) -> str:
    _require_file(command, words)
    path = os.path.join(context.scope.values["CMAKE_CURRENT_SOURCE_DIR"], words[0])
    if not os.path.exists(path):
        raise ValueError(f"{command.name}() was given a file that does not exist: {path}")
    return path


def _read_download(words: Sequence[str], scope: Scope) -> Download:
    options = sections(words, ("DESTINATION", "FILENAME", "MD5"), ("EXCLUDE_FROM_ALL",))
    if len(options[""]) < 2:
        raise ValueError("a download needs a target and a URL")
    url = options[""][1]
    folder = scope.in_binary((options["DESTINATION"] or ["."])[0])
    name = (options["FILENAME"] or [url.rpartition("/")[2]])[0]
    return Download(url, os.path.join(folder, name), "".join(options["MD5"]))


TESTING_COMMANDS: Mapping[str, Handler] = {
    "add_rostest": _rostest,
    "add_rostest_gmock": _compiled_rostest,
    "add_rostest_gtest": _compiled_rostest,
    "add_test": _ctest,
    "catkin_add_gmock": _compiled_test,
    "catkin_add_gtest": _compiled_test,
    "catkin_add_nosetests": _python_tests,
    "catkin_download": _download,
    "catkin_download_test_data": _download,
    "roslaunch_add_file_check": _launch_file_check,
}


def _compiled_target(context: ReadContext, command: Command, words: list[str]) -> None:
    if words:
        context.project.targets.add(words[0])
    if not {"IMPORTED", "INTERFACE", "ALIAS"} & set(words[1:3]):
        target = words[0] if words else command.written_name
        context.need_native_build(command, f"compiles [{target}]", target)


def _custom_target(context: ReadContext, command: Command, words: list[str]) -> None:
    context.project.steps.add_target(words, context.scope, context.file, command.line)
    context.project.targets.add(words[0])


def _custom_command(context: ReadContext, command: Command, words: list[str]) -> None:
    context.project.steps.add_command(words, context.scope, context.file, command.line)


def _dependencies(context: ReadContext, _command: Command, words: list[str]) -> None:
    context.project.steps.add_dependencies(words)


TARGET_COMMANDS: Mapping[str, Handler] = {
    "add_executable": _compiled_target,
    "add_library": _compiled_target,
    "add_custom_target": _custom_target,
    "add_custom_command": _custom_command,
    "add_dependencies": _dependencies,
}


_KINDS = {"add_message_files": "msg", "add_service_files": "srv", "add_action_files": "action"}
_LANGUAGES = ("", "_py", "_cpp", "_lisp", "_eus", "_nodejs")


def _add_files(context: ReadContext, command: Command, words: list[str]) -> None:
    kind = _KINDS[command.name]
    options = sections(words, ("DIRECTORY", "FILES", "BASE_DIR"), ("NOINSTALL",))
    directory = (options["DIRECTORY"] or [kind])[0]
    folder = context.scope.in_source(directory)
    files = options["FILES"]
    if "FILES" not in words:
        files = sorted(glob.glob(f"*.{kind}", root_dir=folder))
    for file in files:
        path = os.path.join(folder, file)
        if not os.path.isfile(path):
            raise context.error(command, f"{command.name}() was given a file that does not exist: {path}")
        name = os.path.splitext(os.path.basename(file))[0]
        installed = None if "NOINSTALL" in words else directory
        context.project.interfaces.append(Interface(kind, name, path, installed))


def _generate_messages(context: ReadContext, command: Command, words: list[str]) -> None:
    project = context.project
    options = sections(words, ("DEPENDENCIES", "LANGS"))
    if project.has_catkin_package:
        raise context.error(command, "generate_messages() must be called before catkin_package()")
    project.generate_messages_line = command.line
    project.message_dependencies += options["DEPENDENCIES"]
    project.targets.update(f"{project.name}_generate_messages{language}" for language in _LANGUAGES)


def _dynamic_reconfigure(context: ReadContext, _command: Command, words: list[str]) -> None:
    project = context.project
    files = (context.scope.in_source(word) for word in words)
    project.config_files += [relative_path(file, project.folder) for file in files]
    project.has_reconfigure_options = True
    project.targets.add(f"{project.name}_gencfg")


INTERFACE_COMMANDS: Mapping[str, Handler] = {
    **dict.fromkeys(_KINDS, _add_files),
    "generate_messages": _generate_messages,
    "generate_dynamic_reconfigure_options": _dynamic_reconfigure,
}


def _install(context: ReadContext, command: Command, words: list[str]) -> None:
    is_python = command.name == "catkin_install_python"
    project = context.project
    found = read_installations(words, context.scope, is_python=is_python, place=context.place(command))
    for item in found:
        is_made = item.source in project.steps.rules or item.source.startswith(project.binary)
        if is_python and not is_made and not os.path.isfile(item.source):
            raise context.error(command, f"catkin_install_python() cannot find the script {item.source}")
    project.installations += found


INSTALL_COMMANDS: Mapping[str, Handler] = {"install": _install, "catkin_install_python": _install}


_HANDLERS: Mapping[str, Handler] = {
    **package_commands.COMMANDS,
    **INTERFACE_COMMANDS,
    **INSTALL_COMMANDS,
    **TARGET_COMMANDS,
    **TESTING_COMMANDS,
    **templates.COMMANDS,
}


def read_project(
    folder: str,
    name: str,
    settings: Mapping[str, str],
    environment: Mapping[str, str],
    find_package: FindPackage = lambda _name: FoundPackage(),
    version: str = "",
    status_lines: list[str] | None = None,
) -> Project:
    """Execute a package's `CMakeLists.txt`. Like CMake, this runs programs and writes files.

    Args:
        name: the package's name in its manifest.
        settings: `-D` settings from the command line, and the workspace's folders.
        environment: the values of `$ENV{NAME}`; `ROS_DISTRO` and similar variables default to Noetic's
            values.
        find_package: function that finds the packages that the file needs.
        version: the package's version in its manifest.
        status_lines: receives the output of `message()`, even if an error follows.

    Raises:
        CMakeError: the file is invalid, or reports an error; the message names the file and line.
    """
    project = Project(name, folder, os.path.join(folder, "CMakeLists.txt"))
    if status_lines is not None:
        project.status_lines = status_lines
    variables = {name: with_slashes(value) for name, value in package_variables(name, folder).items()}
    settings = {
        name: with_slashes(value) if os.path.isabs(value) else value for name, value in settings.items()
    }
    unset = {name: value for name, value in variables.items() if name not in settings}
    environment = {**DISTRIBUTION, **environment}
    scope = Scope(unset, {"CATKIN_ENABLE_TESTING": "ON", **settings}, environment)
    scope.cache.setdefault("CMAKE_CURRENT_BINARY_DIR", with_slashes(os.path.join(folder, "build")))
    project.binary = scope.values["CMAKE_CURRENT_BINARY_DIR"]
    ReadContext(project, version, scope, find_package, _HANDLERS, _check_known).run()
    return project


def extras_in(
    folder: Path, name: str, settings: Mapping[str, str], environment: Mapping[str, str], find: FindPackage
) -> list[str]:
    """Return the CMake files that packages run which find the package in `folder`.

    If it is a source folder, such as one of an underlay, its `CMakeLists.txt` is executed to know them; see
    `read_project`. A file that is invalid has none.
    """
    found = installed_extras(folder)
    with suppress(PiprosError, OSError):
        if not found and "CFG_EXTRAS" in read_text(folder / "CMakeLists.txt", errors="replace"):
            return read_project(str(folder), name, settings, environment, find).cfg_extras
    return found


def _check_known(context: ReadContext, command: Command, _words: list[str]) -> None:
    """Reject unknown commands, and record commands that only CMake can run."""
    name = command.name
    if name in BEYOND_COMMANDS:
        context.need_cmake(command, f"{command.written_name}()")
    if name in BUILTIN_COMMANDS or name in CATKIN_COMMANDS:
        needed = COMPONENT_COMMANDS.get(name)
        if needed is None or context.components.intersection(needed):
            return
        wanted = needed[0]
        raise context.error(
            command,
            f'Unknown CMake command "{command.written_name}".\n  It comes with {wanted}: '
            f"add {wanted} to find_package(catkin REQUIRED COMPONENTS …) and to package.xml",
        )
    from difflib import get_close_matches

    for file in context.project.cfg_extras:
        if not context.empy_hint and name in read_text(file, errors="replace").lower():
            # CMake runs these extras only in packages that find this one.
            context.need_cmake(
                command,
                f"{command.written_name}(), which the package's own {os.path.basename(file)} defines: call "
                f"find_package({context.project.name}) after catkin_package()",
            )
            return
    near = get_close_matches(name, [*BUILTIN_COMMANDS, *CATKIN_COMMANDS], n=1, cutoff=0.8)
    is_typo = bool(near) and not name.endswith(f"_{near[0]}")  # unlike cs_install(), of catkin_simple
    if context.has_foreign_packages and not is_typo:
        context.need_cmake(
            command, f"{command.written_name}(), which another package provides{context.empy_hint}"
        )
        return
    hint = f"\n  Did you mean {near[0]}?" if near else ""
    raise context.error(command, f'Unknown CMake command "{command.written_name}".{hint}')


def package_variables(name: str, folder: str) -> dict[str, str]:
    """Return the variables for a package. Compiler variables are omitted, so they expand to empty strings."""
    system = {"darwin": "Darwin", "win32": "Windows"}.get(sys.platform, "Linux")
    return {
        "CATKIN_PACKAGE_BIN_DESTINATION": f"lib/{name}",
        "CATKIN_PACKAGE_LIB_DESTINATION": "lib",
        "CATKIN_PACKAGE_LIBEXEC_DESTINATION": f"lib/{name}",
        "CATKIN_PACKAGE_SHARE_DESTINATION": f"share/{name}",
        "CATKIN_PACKAGE_INCLUDE_DESTINATION": f"include/{name}",
        "CATKIN_PACKAGE_PYTHON_DESTINATION": f"{PYTHON_DESTINATION}/{name}",
        "CATKIN_PACKAGE_ETC_DESTINATION": f"etc/{name}",
        "CATKIN_GLOBAL_BIN_DESTINATION": "bin",
        "CATKIN_GLOBAL_LIB_DESTINATION": "lib",
        "CATKIN_GLOBAL_LIBEXEC_DESTINATION": "lib",
        "CATKIN_GLOBAL_SHARE_DESTINATION": "share",
        "CATKIN_GLOBAL_INCLUDE_DESTINATION": "include",
        "CATKIN_GLOBAL_PYTHON_DESTINATION": PYTHON_DESTINATION,
        "CATKIN_GLOBAL_ETC_DESTINATION": "etc",
        "PYTHON_INSTALL_DIR": PYTHON_DESTINATION,
        "PYTHON_EXECUTABLE": sys.executable,
        "CMAKE_SOURCE_DIR": folder,
        "CMAKE_CURRENT_SOURCE_DIR": folder,
        "CMAKE_SYSTEM_NAME": system,
        "CMAKE_SYSTEM_PROCESSOR": platform.machine(),
        "CMAKE_HOST_SYSTEM_NAME": system,
        "CMAKE_HOST_SYSTEM_PROCESSOR": platform.machine(),
        "CMAKE_VERSION": "3.16.3",
        "CMAKE_INSTALL_BINDIR": "bin",
        "CMAKE_INSTALL_LIBDIR": "lib",
        "CMAKE_INSTALL_DATADIR": "share",
        "CMAKE_INSTALL_SYSCONFDIR": "etc",
        ("WIN32" if ON_WINDOWS else "UNIX"): "1",
    }
