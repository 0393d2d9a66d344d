"""The properties of a package that `read_project` finds in its `CMakeLists.txt`, without a build."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipros.packages import shipped_folder
from pipros_workspace.catkin.context import FoundPackage
from pipros_workspace.catkin.project import Project
from pipros_workspace.catkin.project_reader import read_project
from pipros_workspace.cmake.language import CMakeError
from tests.support.debian_packages import FOUND_BY_CMAKE

FILES = (
    "msg/A.msg", "msg/B.msg", "srv/S.srv", "action/D.action", "test/x.test", "test/test_it.py",
    "launch/x.launch",
    "scripts/a.py", "include/p/x.h", "env-hooks/10.p.sh", "cmake/p.cmake",
)  # fmt: skip
FIND = "find_package(catkin REQUIRED message_generation rostest roslaunch)\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "p"
    for file in FILES:
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).touch()
    return folder


def read(folder: Path, text: str, packages: dict[str, FoundPackage] | None = None) -> Project:
    (folder / "CMakeLists.txt").write_text(text)
    known = {"rospy": FoundPackage("1.15.15"), **(packages or {})}
    return read_project(str(folder), "p", {}, {}, lambda name: known.get(name), "1.2.3")


@pytest.mark.parametrize("name", [*FOUND_BY_CMAKE, "rqt_gui_py"])
def test_every_ros_package_that_cmake_finds_on_debian_is_found(folder: Path, name: str) -> None:
    shipped = {name: FoundPackage()} if shipped_folder(name) else {}

    project = read(folder, f"find_package(catkin REQUIRED COMPONENTS {name})\ncatkin_package()", shipped)

    assert ([component for component, _ in project.components], project.needs_cmake) == ([name], [])


@pytest.mark.parametrize(("text", "interfaces"), [
    ("add_message_files(FILES A.msg B.msg)", ["msg A msg", "msg B msg"]),
    ("add_message_files()", ["msg A msg", "msg B msg"]),
    ("add_message_files(DIRECTORY msg FILES B.msg NOINSTALL)", ["msg B None"]),
    ("add_service_files(FILES S.srv)\nadd_message_files(FILES A.msg)", ["srv S srv", "msg A msg"]),
    ("add_action_files(DIRECTORY action)", ["action D action"]),
    ("set(M A.msg)\nadd_message_files(FILES ${M} ${NOPE})", ["msg A msg"]),
])  # fmt: skip
def test_interfaces(folder: Path, text: str, interfaces: list[str]) -> None:
    found = read(folder, FIND + text).interfaces
    assert [f"{interface.kind} {interface.name} {interface.folder}" for interface in found] == interfaces
    assert all(Path(interface.path).is_file() for interface in found)


@pytest.mark.parametrize(("text", "tests"), [
    ("add_rostest(test/x.test)", [("rostest", "test/x.test", ())]),
    ("add_rostest(test/x.test ARGS a:=1 DEPENDENCIES d)", [("rostest", "test/x.test", ("a:=1",))]),
    ("catkin_add_nosetests(test)", [("python", "test", ())]),
    ("catkin_add_nosetests(test/test_it.py)", [("python", "test/test_it.py", ())]),
    (
        "roslaunch_add_file_check(launch a:=1 IGNORE_UNSET_ARGS)",
        [("roslaunch", "launch", ("-i", "a:=1"))],
    ),
    ("add_rostest_gtest(mine test/x.test x.cpp)", [("rostest", "test/x.test", ())]),
    ("catkin_add_gtest(mine x.cpp)", [("gtest", "", ())]),
    ("if(NOT CATKIN_ENABLE_TESTING)\nadd_rostest(test/x.test)\nendif()", []),
])  # fmt: skip
def test_tests(folder: Path, text: str, tests: list[tuple[str, str, tuple[str, ...]]]) -> None:
    found = read(folder, FIND + text).tests
    assert [(test.kind, test.written, test.arguments) for test in found] == tests
    assert all(test.place == f"{folder / 'CMakeLists.txt'}:2" for test in found)


@pytest.mark.parametrize(("text", "sources"), [
    ("install(FILES a b DESTINATION d)", ["a", "b"]), ("install(DIRECTORY launch DESTINATION d)", ["launch"]),
    ("catkin_install_python(PROGRAMS scripts/a.py DESTINATION d)", ["scripts/a.py"]),
    ("install(TARGETS x RUNTIME DESTINATION d)", []), ('install(CODE "message(x)")', [""]),
    ("install(SCRIPT cmake/p.cmake)", ["cmake/p.cmake"]),
])  # fmt: skip
def test_installations(folder: Path, text: str, sources: list[str]) -> None:
    found = read(folder, text).installations
    assert [item.source.removeprefix(f"{folder.as_posix()}/") for item in found] == sources
    assert all(item.is_python == text.startswith("catkin_install") for item in found)


@pytest.mark.parametrize(("text", "reason"), [
    ("add_executable(x x.cpp)", "compiles [x]"), ("add_library(y SHARED y.cpp)", "compiles [y]"),
    ("try_run(A B . x.cpp)", "needs try_run(), which only CMake itself can execute"),
    ("add_custom_target(t ALL COMMAND a | b)", "needs the shell that [a | b] needs"),
    ("add_custom_target(t COMMAND $<TARGET_FILE:x>)", "needs the generator expression $<TARGET_FILE:x>"),
    (
        "find_package(Foreign)\nforeign_command()",
        "needs foreign_command(), which another package provides",
    ),
])  # fmt: skip
def test_targets_that_need_genuine_catkin_are_found_with_their_line(
    folder: Path, text: str, reason: str
) -> None:
    project = read(folder, text)
    (target,) = project.needs_cmake
    assert target.what.startswith(reason)
    assert (target.file, target.line) == (project.file, text.count("\n") + 1)


@pytest.mark.parametrize("text", [
    "include_directories(${catkin_INCLUDE_DIRS})\nadd_definitions(-DX)",
    "set_target_properties(x PROPERTIES A b)", "add_library(headers INTERFACE)", "add_library(x ALIAS y)",
    "find_package(catkin REQUIRED COMPONENTS nodelet)\nclass_loader_hide_library_symbols(x)",
    "find_package(Boost REQUIRED)\nfind_package(Python3)", "enable_testing()\ninclude(CTest)",
])  # fmt: skip
def test_commands_for_compilers_have_no_effect(folder: Path, text: str) -> None:
    assert read(folder, text).needs_cmake == []


@pytest.mark.parametrize(("text", "complaint", "line"), [
    ("project(other)", "The project is named [other], but package.xml names the package [p]", 1),
    ("add_message_files(FILES A.msg)", "It comes with message_generation", 1),
    (FIND + "add_message_files(FILES Nope.msg)", "was given a file that does not exist", 2),
    (FIND + "catkin_package()\ngenerate_messages()", "must be called before catkin_package()", 3),
    ("catkin_package(INCLUDE_DIRS nope)", "include dir 'nope' does not exist", 1),
    ("catkin_package(CFG_EXTRAS nope.cmake)", "could not find CFG_EXTRAS file", 1),
    ("catkin_python_setup()", "called without 'setup.py'", 1),
    ("catkin_add_env_hooks(99.nope SHELLS sh)", "could not find environment hook", 1),
    ("catkin_install_python(PROGRAMS nope.py DESTINATION d)", "cannot find the script", 1),
    ("install(FILES a)", "given no DESTINATION", 1), ("add_rostest(test/x.test)", "It comes with rostest", 1),
    (FIND + "add_rostest(nope.test)", "was given a file that does not exist", 2),
    ("\nadd_mesage_files()", "Did you mean add_message_files?", 2),
    ('message(FATAL_ERROR "a reason")', "a reason", 1),
])  # fmt: skip
def test_mistakes_have_their_line(folder: Path, text: str, complaint: str, line: int) -> None:
    with pytest.raises(CMakeError) as error:
        read(folder, text)
    assert complaint in str(error.value)
    assert f"{folder / 'CMakeLists.txt'}:{line} " in str(error.value)


def test_packages_give_their_extras_to_those_that_find_them(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "plain.cmake").write_text("set(FROM_PLAIN 1)\nfunction(own_command)\nendfunction()\n")
    (tmp_path / "made.cmake.in").write_text("set(FROM_MADE @PROJECT_NAME@)\n")
    packages = {
        "helper": FoundPackage("3.2.1", [str(tmp_path / "plain.cmake"), str(tmp_path / "made.cmake.in")])
    }
    project = read(
        folder,
        "project(p)\nfind_package(catkin REQUIRED helper)\nown_command()\n"
        'message(STATUS "${FROM_PLAIN} ${FROM_MADE} ${helper_VERSION}")',
        packages,
    )
    assert project.status_lines == ["-- 1 p 3.2.1"]


def test_messages_are_sorted_by_their_modes(folder: Path) -> None:
    project = read(
        folder,
        'message(STATUS "a" b)\nmessage("plain")\nmessage(WARNING "w")\nmessage(DEBUG "d")\n'
        'message(DEPRECATION "x")',
    )
    assert project.status_lines == ["-- ab", "plain"]
    assert project.warnings == [f"{folder / 'CMakeLists.txt'}:3: w", f"{folder / 'CMakeLists.txt'}:5: x"]


def test_output_before_an_error_is_kept(folder: Path) -> None:
    lines: list[str] = []
    (folder / "CMakeLists.txt").write_text('message(STATUS "so far")\nnonsense()')
    with pytest.raises(CMakeError):
        read_project(str(folder), "p", {}, {}, status_lines=lines)
    assert lines == ["-- so far"]


def test_hooks_and_extras_are_found_in_their_folders(folder: Path) -> None:
    (folder / "env-hooks" / "20.p.bash.in").write_text("export X=@PROJECT_NAME@\n")
    (folder / "cmake" / "q.cmake.in").touch()
    project = read(
        folder,
        "project(p)\ncatkin_add_env_hooks(10.p SHELLS sh)\ncatkin_add_env_hooks(20.p SHELLS bash)\n"
        "catkin_package(CFG_EXTRAS p.cmake q.cmake CATKIN_DEPENDS rospy)",
    )
    assert [(hook.name, hook.text) for hook in project.hooks] == [
        ("10.p.sh", None),
        ("20.p.bash", "export X=p\n"),
    ]
    assert [Path(path).name for path in project.cfg_extras] == ["p.cmake", "q.cmake.in"]
    assert project.catkin_depends == [("rospy", 4)]


def test_the_manifest_and_genmsg_set_variables(folder: Path) -> None:
    text = (
        "find_package(catkin REQUIRED COMPONENTS genmsg)\ncatkin_package_xml()\n"
        "install(FILES ${p_VERSION} DESTINATION ${GENMSG_LANGS_DESTINATION})"
    )

    (item,) = read(folder, text, {"genmsg": FoundPackage()}).installations

    assert item.copy is not None
    assert (item.copy.source, item.copy.target) == (f"{folder}/1.2.3", "etc/ros/genmsg")
