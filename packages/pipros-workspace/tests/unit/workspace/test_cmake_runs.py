import os
import sys
from pathlib import Path

import pytest

from pipros_workspace.catkin.project import Project
from pipros_workspace.catkin.project import TestEntry as Entry
from pipros_workspace.client_library import beside_ros2, is_ros1_script, without_libraries
from pipros_workspace.cmake_runs import NativeBuildFailed, configure, make_all
from pipros_workspace.make_targets import is_wanted, label, names, results_label

PRINTS = "#!/bin/sh\ncat <<'END'\n{text}\nEND\nexit 1\n"
PROCESSING = "-- +++ processing catkin package: '{name}'\n"


def script(path: Path, content: str) -> Path:
    path.write_text(content)
    path.chmod(0o755)
    return path


@pytest.mark.needs("first lines")
@pytest.mark.parametrize(("printed", "failed"), [
    ("CMake Error at b/CMakeLists.txt:4 (find_package):\n  No x.\n\n  More.", {"b": ["No x."]}),
    ("CMake Error at /usr/share/catkin/cmake/all.cmake:8 (message):\n  No y.", {"a": ["No y."]}),
    ("-- Configuring done\nCMake Error in b/CMakeLists.txt:\n  No z.\n", {"b": ["No z."]}),
    (
        "CMake Error at a/CMakeLists.txt:1 (f):\n  one\n\nCMake Error at a/CMakeLists.txt:2 (f):\n  two\n"
        + PROCESSING.format(name="b")
        + "CMake Error at /x.cmake:1 (message):\n  three\n",
        {"a": ["one"], "b": ["three"]},
    ),
])  # fmt: skip
def test_the_rejected_packages_are_found_with_the_reason(
    tmp_path: Path, printed: str, failed: dict[str, list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    text = PROCESSING.format(name="b") + PROCESSING.format(name="a") + printed
    cmake = script(tmp_path / "cmake", PRINTS.format(text=text))

    found = configure([str(cmake)], tmp_path, {}, {name: tmp_path / name for name in ("a", "b")})

    reasons = {name: [line.strip() for line in reason.splitlines()[1:]] for name, reason in found.items()}
    assert reasons == failed
    assert printed in capsys.readouterr().out


@pytest.mark.needs("first lines")
@pytest.mark.parametrize("printed", [
    'CMake Error: Cannot determine link language for target "b_node".',
    "CMake Error: CMake can not determine linker language for target: b_node",
    'CMake Error: Variables are set to NOTFOUND:\nX\n    linked by target "b_node" in directory /b',
    'CMake Error: Cannot determine link language for target "main".',
])  # fmt: skip
def test_a_target_that_cannot_be_generated_rejects_the_package_that_adds_it(
    tmp_path: Path, printed: str
) -> None:
    folders = {name: tmp_path / name for name in ("a", "b")}
    for name, folder in folders.items():
        folder.mkdir()
        (folder / "CMakeLists.txt").write_text(
            f"add_executable(${{PROJECT_NAME}}_node {name}.py)\nadd_library( main_{name}\n  x.cpp)\n"
        )
    with (folders["b"] / "CMakeLists.txt").open("a") as file:
        file.write("ADD_EXECUTABLE(main main.py)\n")
    text = f"-- Configuring done\n{printed}\n-- Generating done"
    cmake = script(tmp_path / "cmake", PRINTS.format(text=text))

    (name,) = found = configure([str(cmake)], tmp_path, {}, folders)

    assert name == "b"
    assert found[name].strip() in printed


@pytest.mark.needs("first lines")
@pytest.mark.parametrize("printed", ["", "CMake Error at CMakeLists.txt:4 (cmake_minimum_required):\n  Old."])
def test_a_failure_without_a_culprit_is_an_error(tmp_path: Path, printed: str) -> None:
    cmake = script(tmp_path / "cmake", PRINTS.format(text=printed))
    with pytest.raises(NativeBuildFailed, match=r"cmake\" failed; the reason is printed above"):
        configure([str(cmake)], tmp_path, {}, {"a": tmp_path / "a"})


def test_incomplete_packages_are_named_with_the_compilers_error(tmp_path: Path) -> None:
    bin_folder = tmp_path / "bin"
    bin_folder.mkdir()
    script(
        bin_folder / "make",
        "#!/bin/sh\ncase $PWD in */good) exit 0 ;; esac\necho 'a.cpp:1:1: error: no'\nexit 2\n",
    )
    for name in ("good", "bad"):
        (tmp_path / name).mkdir()
    variables = {"PATH": f"{bin_folder}:/bin"}

    assert make_all(["-j1"], tmp_path, variables, ["good", "bad"]) == {"bad": "a.cpp:1:1: error: no"}
    with pytest.raises(NativeBuildFailed):
        make_all(["-j1"], tmp_path, variables, ["good"])


ROSTEST = Entry("rostest", "/src/p/test/x.test", (), "test/x.test")


@pytest.mark.parametrize(("test", "name", "results"), [
    (ROSTEST, "test_x.test", "test_x"),
    (Entry("rostest", "", ("a:=1", "b:=c/d"), "test/x.test"), "x__a_1__b_c_d.test", "x__a_1__b_c_d"),
    (Entry("rostest", "", ("a:=0.5",), "x.test"), "x__a_0.5.test", "x__a_0"),
    (Entry("roslaunch", "", ("-i", "a:=1"), "launch/x.launch"), "x__a_1.launch", "x__a_1"),
    (Entry("roslaunch", "", ("-i",), "launch"), "launch", "launch"),
    (Entry("python", "", (), "test/sub/test_it.py"), "test.sub.test_it.py", "test"),
    (Entry("gtest", "my_test", target="my_test"), "my_test", "my_test"),
])  # fmt: skip
def test_tests_have_the_names_of_catkin(test: Entry, name: str, results: str) -> None:
    assert (label(test), results_label(test)) == (name, results)


@pytest.mark.parametrize(("targets", "wanted"), [
    (["run_tests"], True), (["test"], True), (["run_tests_p"], True), (["run_tests_p_rostest"], True),
    (["run_tests_p_rostest_test_x.test"], True), (["run_tests_other"], False),
    (["run_tests_p_nosetests"], False), (["all", "install"], False), ([], False),
])  # fmt: skip
def test_a_target_selects_its_tests(targets: list[str], wanted: bool) -> None:
    assert is_wanted(ROSTEST, "p", targets) is wanted


def test_all_targets_are_known() -> None:
    project = Project("p", "/src/p", "/src/p/CMakeLists.txt", tests=[ROSTEST], targets={"docs"})
    known = set(names({"p": project}))
    assert {"all", "install", "p", "docs", "run_tests_p", "clean_test_results_p"} <= known
    assert {"run_tests_p_rostest", "run_tests_p_rostest_test_x.test"} <= known


# Scripts of ROS 1 and ROS 2, and the variables that ROS 2's wheels set.


GUARD = "_ROS_WHEELS_BOOTSTRAP_COMPLETE"


@pytest.mark.parametrize(("text", "is_ros1"), [
    ("import rospy\n", True), ("import os, rospy as ros\n", True),
    ("    from rospy.topics import Publisher\n", True),
    ("import rclpy\nfrom rclpy.node import Node\n", False), ("import sys, rclpy.qos\n", False),
    ("import rospy\nimport rclpy\n", False),
    ("import rospy_helpers\n# import rclpy\n", False),
    ("text = 'from rclpy'\n", False), ("\udcff\n", False),
])  # fmt: skip
def test_scripts_of_ros1_import_rospy_and_not_rclpy(tmp_path: Path, text: str, is_ros1: bool) -> None:
    script = tmp_path / "node.py"
    script.write_bytes(text.encode("utf-8", "surrogateescape"))
    assert is_ros1_script(script) is is_ros1


def test_a_script_that_cannot_be_read_is_not_of_ros1(tmp_path: Path) -> None:
    assert not is_ros1_script(tmp_path)
    assert not is_ros1_script(tmp_path / "gone")


def test_libraries_of_this_environment_are_removed_and_others_stay() -> None:
    own = f"{sys.prefix}/lib"
    assert without_libraries({GUARD: "1", "LD_LIBRARY_PATH": own, "A": "b"}) == {"A": "b"}
    both = {GUARD: "1", "LD_LIBRARY_PATH": os.pathsep.join((own, "/opt/lib"))}
    assert without_libraries(both) == {"LD_LIBRARY_PATH": "/opt/lib"}
    assert without_libraries({"LD_LIBRARY_PATH": own}) == {"LD_LIBRARY_PATH": own}


def test_only_scripts_of_rospy_in_this_environment_get_the_names_of_ros1(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    script = tmp_path / "node.py"
    script.write_text("import rospy\n")
    variables = {GUARD: "1", "LD_LIBRARY_PATH": f"{sys.prefix}/lib"}
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    assert beside_ros2(script, sys.executable, variables) == variables
    monkeypatch.setenv("AMENT_PREFIX_PATH", "/opt/ros/jazzy")
    assert beside_ros2(script, sys.executable, variables) == {"PIPROS_MESSAGES": "ros1", **variables}
    chosen = {**variables, "PIPROS_MESSAGES": "ros2"}
    assert beside_ros2(script, sys.executable, chosen) == chosen
    assert beside_ros2(script, "/usr/bin/python3", variables) == {}
    assert beside_ros2(script, None, variables) == {}
