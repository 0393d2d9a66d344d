"""CMake commands that declare tests and their data files."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

from pipros.basics.windows import with_slashes
from pipros.cmake.language import Command
from pipros.cmake.scope import Scope
from pipros.cmake.words import sections
from pipros.workspace.catkin.context import Handler, ReadContext
from pipros.workspace.catkin.project import Download, TestEntry

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


COMMANDS: Mapping[str, Handler] = {
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
