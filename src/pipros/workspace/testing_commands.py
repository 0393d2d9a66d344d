"""The commands by which a `CMakeLists.txt` lists tests."""

from __future__ import annotations

import os
from collections.abc import Sequence

from pipros.workspace.cmake.scope import Scope
from pipros.workspace.cmake.words import sections
from pipros.workspace.project import Download, Project, TestEntry

NAMES = (
    "add_rostest",
    "add_rostest_gmock",
    "add_rostest_gtest",
    "add_test",
    "catkin_add_gmock",
    "catkin_add_gtest",
    "catkin_add_nosetests",
    "catkin_download",
    "catkin_download_test_data",
    "roslaunch_add_file_check",
)

_CHECK_SWITCHES = {"IGNORE_UNSET_ARGS": "-i", "USE_TEST_DEPENDENCIES": "-t"}


def carry_out(name: str, words: Sequence[str], project: Project, scope: Scope, place: str) -> None:
    """Adds to a project what one of the commands above lists.

    Args:
        place: file and line, for messages.

    Raises:
        ValueError: the words make no sense, or name a file that does not exist.
    """
    if not words:
        raise ValueError(f"{name}() called without a file")
    source = scope.values["CMAKE_CURRENT_SOURCE_DIR"]
    if name == "add_test":
        project.notes.append(f"{place}: add_test() is for ctest; run_tests does not run it")
    elif name in ("catkin_download", "catkin_download_test_data"):
        project.downloads.append(_download(words, scope))
    elif name == "roslaunch_add_file_check":
        options = tuple(_CHECK_SWITCHES[word] for word in words if word in _CHECK_SWITCHES)
        arguments = sections(words[1:], ("DEPENDENCIES",), tuple(_CHECK_SWITCHES))[""]
        path = _existing(os.path.join(source, words[0]), "roslaunch_add_file_check")
        project.tests.append(TestEntry("roslaunch", path, (*options, *arguments), words[0], place=place))
    elif name == "add_rostest":
        options_of = sections(words[1:], ("ARGS", "DEPENDENCIES", "WORKING_DIRECTORY"))
        path = _existing(os.path.join(source, words[0]), "add_rostest")
        project.tests.append(
            TestEntry("rostest", path, tuple(options_of["ARGS"]), _within(path, project), place=place)
        )
    elif name in ("add_rostest_gtest", "add_rostest_gmock"):
        target, file = words[:2] if len(words) > 1 else (words[0], "")
        path = _existing(os.path.join(source, file), name)
        project.tests.append(
            TestEntry("rostest", path, (), _within(path, project), target=target, place=place)
        )
    elif name in ("catkin_add_gtest", "catkin_add_gmock"):
        project.tests.append(TestEntry("gtest", words[0], target=words[0], place=place))
    else:
        path = _existing(os.path.join(source, words[0]), "catkin_add_nosetests")
        project.tests.append(TestEntry("python", path, written=_within(path, project), place=place))


def _existing(path: str, command: str) -> str:
    if not os.path.exists(path):
        raise ValueError(f"{command}() was given a file that does not exist: {path}")
    return path


def _within(path: str, project: Project) -> str:
    """The path below the package's folder, with a slash at its end when it has one."""
    return path.removeprefix(project.folder + os.sep)


def _download(words: Sequence[str], scope: Scope) -> Download:
    options = sections(words, ("DESTINATION", "FILENAME", "MD5"), ("EXCLUDE_FROM_ALL",))
    if len(options[""]) < 2:
        raise ValueError("a download needs a target and a URL")
    url = options[""][1]
    folder = scope.in_binary((options["DESTINATION"] or ["."])[0])
    name = (options["FILENAME"] or [url.rpartition("/")[2]])[0]
    return Download(url, os.path.join(folder, name), "".join(options["MD5"]))
