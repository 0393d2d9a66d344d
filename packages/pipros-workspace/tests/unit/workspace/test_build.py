"""Workspaces built without CMake: created, refused and untouched files."""

import re
from pathlib import Path

import pytest

from pipros_workspace.build_result import BuildResult
from pipros_workspace.layout import WorkspaceError
from tests.support.workspaces import Workspace


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    return Workspace(tmp_path)


MESSAGES = (
    "find_package(catkin REQUIRED COMPONENTS rospy std_msgs message_generation)\n"
    "add_message_files(FILES Level.msg)\n"
    "generate_messages(DEPENDENCIES std_msgs)\n"
    "catkin_package(CATKIN_DEPENDS message_runtime)"
)


def test_an_empty_workspace_gets_its_setup_files(workspace: Workspace) -> None:
    assert workspace.build() == BuildResult()
    assert (workspace.layout.devel / ".catkin").read_text() == str(workspace.layout.source)
    for shell in ("sh", "bash", "zsh", "fish", "ps1"):
        assert (workspace.layout.devel / f"setup.{shell}").is_file()


def test_the_build_folder_is_left_out_of_crawls(workspace: Workspace) -> None:
    workspace.build()
    assert (workspace.layout.build / "CATKIN_IGNORE").is_file()


def test_a_package_with_a_message_is_built(workspace: Workspace) -> None:
    workspace.add("talkers", MESSAGES, "message_runtime", msg__Level_dot_msg="Header header\nstring level\n")
    result = workspace.build()
    assert (result.built, result.errors) == (["talkers"], [])
    assert workspace.lines[-3:] == [
        "Generating Python from MSG talkers/Level",
        "Generating Python msg __init__.py for talkers",
        "[100%] Built target talkers_generate_messages",
    ]
    assert "-- talkers: 1 messages, 0 services" in workspace.lines
    assert (workspace.layout.devel / "lib/python3/dist-packages/talkers/__init__.py").is_file()


def test_building_again_does_nothing_until_something_changes(workspace: Workspace) -> None:
    folder = workspace.add("talkers", MESSAGES, "message_runtime", msg__Level_dot_msg="string level\n")
    workspace.build()
    result = workspace.build()
    assert (result.built, result.unchanged) == ([], ["talkers"])
    (folder / "msg" / "Level.msg").write_text("string level\nint32 number\n")
    assert workspace.build().built == ["talkers"]


def test_packages_are_built_in_the_order_of_their_needs(workspace: Workspace) -> None:
    workspace.add("a", depends="c")
    workspace.add("b")
    workspace.add("c", depends="b")
    assert workspace.build().built == ["b", "c", "a"]


def test_scripts_are_relayed_to_from_the_devel_space(workspace: Workspace) -> None:
    folder = workspace.add(
        "talkers",
        "catkin_install_python(PROGRAMS scripts/talk.py DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})\n"
        "catkin_package()",
        scripts__talk_dot_py="print('hi')\n",
    )
    assert workspace.build().errors == []
    relay = workspace.layout.devel / "lib" / "talkers" / "talk.py"
    assert relay.stat().st_mode & 0o111
    assert str(folder / "scripts" / "talk.py") in relay.read_text()


SETUP_PY = """\
from distutils.core import setup
from catkin_pkg.python_setup import generate_distutils_setup
setup(**generate_distutils_setup(packages=["talkers"], package_dir={"": "src"}, scripts=["bin/tool"]))
"""


def test_the_modules_of_a_setup_py_are_importable(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    workspace.add(
        "talkers",
        "catkin_python_setup()\ncatkin_package()",
        setup_dot_py=SETUP_PY,
        src__talkers____init___dot_py="",
        bin__tool="#!/usr/bin/env python3\n",
    )
    source = workspace.base / "src/talkers/src/talkers"
    (source / "__init__.py").write_text("answer = 42\n")
    assert workspace.build().errors == []
    assert (workspace.layout.devel / "lib/talkers/tool").is_file()
    init = workspace.layout.devel / "lib/python3/dist-packages/talkers/__init__.py"
    names: dict[str, object] = {"__path__": []}
    exec(init.read_text(), names)  # noqa: S102  # what an import would do
    assert names["answer"] == 42
    assert names["__path__"] == [str(source)]


@pytest.mark.parametrize(("cmake", "depends", "message", "complaint"), [
    ("generate_message()", "", "string x", r"CMakeLists.txt:3 \(generate_message\):\n  Unknown CMake"),
    ("generate_message()", "", "string x", "Did you mean generate_messages?"),
    ("add_message_files(FILES Level.msg)", "", "string x", "add message_generation to find_package"),
    (
        MESSAGES.replace("Level", "Nope"),
        "message_runtime",
        "string x",
        "a file that does not exist: .*Nope",
    ),
    (MESSAGES, "", "string x", "must therefore be listed as a run dependency in the package.xml"),
    (MESSAGES, "message_runtime", "strin x", r"Level.msg:1: there is no message type \[talkers/strin\]"),
    (
        MESSAGES,
        "message_runtime",
        "string x\nNope y",
        r"Level.msg:2: there is no message type \[talkers/Nope\]",
    ),
    (
        MESSAGES.replace("DEPENDENCIES std_msgs", ""),
        "message_runtime",
        "geometry_msgs/Point p",
        r"Did you forget to specify generate_messages\(DEPENDENCIES geometry_msgs\)",
    ),
    ("find_package(catkin REQUIRED rospi)\nadd_executable(a b.cpp)", "", "", 'provided by "rospi"'),
    ("catkin_python_setup()", "", "", "without 'setup.py'"),
    ("catkin_package(", "", "", r"CMakeLists.txt:3 \(catkin_package\):\n  Parse error"),
    ('message(FATAL_ERROR "no way")', "", "", "no way"),
])  # fmt: skip
def test_mistakes_are_reported_with_file_and_line(
    workspace: Workspace, cmake: str, depends: str, message: str, complaint: str
) -> None:
    workspace.add("talkers", cmake, depends, msg__Level_dot_msg=message)
    result = workspace.build()
    assert len(result.errors) == 1
    assert result.errors[0].startswith("talkers: ")
    assert re.search(complaint, result.errors[0])


def test_a_project_of_another_name_is_refused(workspace: Workspace) -> None:
    folder = workspace.add("talkers")
    (folder / "CMakeLists.txt").write_text("project(talker)\n")
    assert "package.xml names the package [talkers]" in workspace.build().errors[0]


def test_a_broken_manifest_is_reported_and_the_rest_is_built(workspace: Workspace) -> None:
    broken = workspace.add("broken")
    (broken / "package.xml").write_text("<package>\n<name>broken</nam>\n</package>")
    workspace.add("fine")
    result = workspace.build()
    assert result.built == ["fine"]
    assert result.errors == [f"{broken}/package.xml:2:15: invalid XML: mismatched tag"]


def test_a_hook_that_is_not_text_is_reported_and_the_rest_is_built(workspace: Workspace) -> None:
    talkers = workspace.add("talkers", "catkin_add_env_hooks(10.p SHELLS sh DIRECTORY .)\ncatkin_package()")
    hook = talkers / "10.p.sh"
    hook.write_bytes(b"export A=\xff\n")
    workspace.add("fine")
    result = workspace.build()
    assert result.built == ["fine"]
    assert [error.partition(" UTF-8")[0] for error in result.errors] == [
        f"talkers: {hook}: an environment hook must be"
    ]


def test_an_incomplete_manifest_is_reported(workspace: Workspace) -> None:
    folder = workspace.add("broken")
    (folder / "package.xml").write_text('<package format="2"><name>broken</name></package>')
    (error,) = workspace.build().errors
    assert error.startswith(f"{folder}/package.xml:1: ")
    assert "version" in error


def test_a_failed_package_skips_only_its_dependents(workspace: Workspace) -> None:
    workspace.add("bad", "nonsense()")
    workspace.add("user", depends="bad")
    workspace.add("other")
    result = workspace.build()
    assert (result.built, result.skipped) == (["other"], {"user": "bad"})


def test_the_previous_build_stays_usable_when_a_build_fails(workspace: Workspace) -> None:
    folder = workspace.add("talkers", MESSAGES, "message_runtime", msg__Level_dot_msg="string level\n")
    workspace.build()
    (folder / "CMakeLists.txt").write_text("nonsense()\n")
    assert workspace.build().errors
    assert (workspace.layout.devel / "lib/python3/dist-packages/talkers/__init__.py").is_file()


def test_two_packages_of_one_name_skip_only_their_dependents(workspace: Workspace) -> None:
    first = workspace.add("one")
    second = workspace.add("two")
    (second / "package.xml").write_text((first / "package.xml").read_text())
    workspace.add("user", depends="one")
    workspace.add("other")
    result = workspace.build()
    assert (result.built, result.skipped) == (["other"], {"user": "one"})
    assert "Multiple packages found with the same name 'one'" in "".join(result.errors)


def test_packages_that_need_each_other_skip_only_their_dependents(workspace: Workspace) -> None:
    workspace.add("a", depends="b")
    workspace.add("b", depends="a")
    workspace.add("c", depends="a")
    workspace.add("other")
    result = workspace.build()
    assert result.built == ["other"]
    assert "the packages a, b depend on each other" in result.errors[0]
    assert result.errors[1] == "c: it is left out, because it needs a package in this cycle"


def test_a_wanted_package_that_is_left_out_raises_with_the_reason(workspace: Workspace) -> None:
    workspace.add("a", depends="b")
    workspace.add("b", depends="a")
    with pytest.raises(WorkspaceError, match=r"not found in the workspace\n.*the packages a, b depend"):
        workspace.build(only=frozenset({"a"}))


def test_compiled_code_without_cmake_names_package_target_and_what_to_install(workspace: Workspace) -> None:
    folder = workspace.add("cpp", "add_executable(talker talker.cpp)\ncatkin_package()")
    workspace.add("fine")
    result = workspace.build()
    assert "fine" in result.built
    (error,) = result.errors
    assert f"{folder / 'CMakeLists.txt'}:3: the package [cpp] compiles [talker]" in error
    assert "Install CMake" in error


def test_only_the_packages_wanted_are_built(workspace: Workspace) -> None:
    workspace.add("a", depends="b")
    workspace.add("b")
    workspace.add("c")
    assert workspace.build(only=frozenset({"a"})).built == ["b", "a"]
    assert workspace.build(left_out=frozenset({"c"})).built == []


def test_cmake_code_is_executed(workspace: Workspace) -> None:
    workspace.add(
        "talkers",
        "find_package(catkin REQUIRED COMPONENTS message_generation)\n"
        "set(NAMES A B)\nlist(APPEND NAMES C)\n"
        "function(declare name)\n  add_message_files(FILES ${name}.msg)\nendfunction()\n"
        "foreach(name ${NAMES})\n  if(NOT name STREQUAL B)\n    declare(${name})\n  endif()\nendforeach()\n"
        "if(CATKIN_ENABLE_TESTING AND NOPE)\n  nonsense()\nelseif(TRUE)\n  include(extra.cmake)\nelse()\n"
        "  more_nonsense()\nendif()\n"
        "generate_messages()\ncatkin_package()",
        msg__A_dot_msg="string a\n",
        msg__B_dot_msg="broken\n",
        msg__C_dot_msg="string c\n",
        extra_dot_cmake="message(STATUS here)\n",
    )
    result = workspace.build()
    assert result.errors == []
    assert [interface.name for interface in result.projects["talkers"].interfaces] == ["A", "C"]


def test_install_copies_what_is_to_be_installed(workspace: Workspace) -> None:
    workspace.add(
        "talkers",
        MESSAGES + "\n"
        "catkin_install_python(PROGRAMS scripts/talk.py DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})\n"
        "install(FILES notes.txt DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})\n"
        "install(DIRECTORY launch DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})\n"
        "install(DIRECTORY launch/ DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION}/flat)\n",
        "message_runtime",
        msg__Level_dot_msg="string level\n",
        scripts__talk_dot_py="#!/usr/bin/env python3\n",
        notes_dot_txt="n",
        launch__x_dot_launch="<launch/>",
    )
    assert workspace.build(installs=True).errors == []
    install = workspace.layout.install
    made = {str(path.relative_to(install)) for path in install.rglob("*") if path.is_file()}
    assert {
        "share/talkers/package.xml", "share/talkers/msg/Level.msg", "share/talkers/notes.txt",
        "share/talkers/launch/x.launch", "share/talkers/flat/x.launch", "lib/talkers/talk.py",
        "lib/python3/dist-packages/talkers/__init__.py", ".catkin", "setup.bash",
    } <= made  # fmt: skip
    assert (install / "lib/talkers/talk.py").stat().st_mode & 0o111
    assert (install / ".catkin").read_text() == ""


def test_a_missing_cmake_is_reported_once(workspace: Workspace) -> None:
    workspace.add("native", "add_executable(program main.cpp)")
    result = workspace.build()
    assert "compiles [program], but cmake" in result.errors[0]  # which catkin_make lists at its end
    assert "cmake is not in PATH" not in workspace.output


@pytest.mark.parametrize("keyword", ["COMPONENTS", "OPTIONAL_COMPONENTS"])
def test_an_absent_package_is_a_warning_if_nothing_is_compiled(workspace: Workspace, keyword: str) -> None:
    find = f"find_package(catkin REQUIRED {keyword} rospy move_base_node)\n"
    workspace.add("talkers", find + "catkin_package()")

    result = workspace.build()

    assert (result.built, result.errors) == (["talkers"], [])
    (absent,) = result.projects["talkers"].absent
    assert absent.name == "move_base_node"
    assert any("move_base_node" in line and "WARNING" in line for line in workspace.lines)


def test_compiled_code_that_pipros_ships_in_python_names_the_programs_that_run(workspace: Workspace) -> None:
    workspace.add("joy", "add_executable(joy_node joy.cpp)\ncatkin_package()")
    (error,) = workspace.build().errors
    assert error.endswith("Until then, these run from pipros: joy_node")


def test_a_library_that_is_missing_stops_only_the_compiled_part(workspace: Workspace) -> None:
    """As in rosbag_storage, roslz4 and cv_bridge, on whose messages and modules Python packages depend."""
    workspace.add(
        "storage",
        "find_package(catkin REQUIRED COMPONENTS message_generation)\n"
        "find_path(LIBRARY library.h PATHS /nowhere NO_DEFAULT_PATH)\n"
        'if(NOT LIBRARY)\n  message(FATAL_ERROR "no library")\nendif()\n'
        "if(${LIBRARY_VERSION} VERSION_LESS 1.11)\nendif()\n"
        "add_message_files(FILES Level.msg)\ngenerate_messages()\n"
        "catkin_package(CATKIN_DEPENDS message_runtime)\nadd_subdirectory(cpp)",
        "message_runtime",
        msg__Level_dot_msg="string level\n",
        cpp__CMakeLists_dot_txt="add_library(storage storage.cpp)\n",
    )
    workspace.add("python", depends="storage")

    result = workspace.build()

    (error,) = result.errors
    assert "the package [storage] compiles [storage], but cmake" in error
    assert "python" in result.built
    assert (workspace.layout.devel / "lib/python3/dist-packages/storage/__init__.py").is_file()


def test_an_error_in_a_package_that_compiles_nothing_stops_it(workspace: Workspace) -> None:
    workspace.add(
        "p", 'if(NO)\n  add_library(p p.cpp)\nendif()\nmessage(FATAL_ERROR "broken")\ncatkin_package()'
    )
    (error,) = workspace.build().errors
    assert error.endswith("CMakeLists.txt:6 (message):\n  broken")


@pytest.mark.parametrize("condition", ["", ' condition="$ROS_VERSION == 2"'])
def test_a_package_for_ros_2_says_so(workspace: Workspace, condition: str) -> None:
    folder = workspace.add("angles")
    manifest = folder / "package.xml"
    export = f"<export><build_type{condition}>ament_cmake</build_type></export></package>"
    text = manifest.read_text().replace("</package>", export).replace('format="2"', 'format="3"')
    manifest.write_text(text)

    result = workspace.build()

    if condition:
        assert (result.built, result.errors) == (["angles"], [])
    else:
        (error,) = result.errors
        assert error.startswith(f"angles: {manifest}: the package is for ROS 2 (build type ament_cmake)")
