"""catkin's tools have the exit codes, files and error texts of the genuine ones."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.support.ros import RosSystem, Side

MANIFEST = """\
<package format="2"><name>{name}</name><version>0.1.0</version><description>d</description>
<maintainer email="a@example.org">A</maintainer><license>BSD</license>
<buildtool_depend>catkin</buildtool_depend></package>
"""

CMAKE = """\
cmake_minimum_required(VERSION 3.0.2)
project(one)
find_package(catkin REQUIRED)
catkin_package()
"""

CREATE = [
    "a", "a rospy roscpp std_msgs", "a roscpp", "a --meta", "a -V 1.2.3 -D text -l MIT -a Ada -a Bob -m Carl",
    "a --boost-comps system thread", "a -s boost eigen", "a message_generation std_msgs", "a-b_c", "Bad-Name",
    "a rospy rospy", "a --rosdistro melodic", "", "a --nope", "a -V", "a -V bad", "a/b", "a a",
]  # fmt: skip

# Folder and command line; later ones use the files of earlier ones.
IN_A_WORKSPACE = [
    (".", "catkin_make"),
    (".", "catkin_make -j 4 VERBOSE=1 -k"),
    (".", "catkin_make --pkg nope"),
    (".", "catkin_make --only-pkg-with-deps nope other"),
    (".", "catkin_make -DCATKIN_WHITELIST_PACKAGES="),
    (".", "catkin_make -C nowhere"),
    ("src/one", "catkin_make"),
    (".", "catkin_make nonsense"),
    (".", "catkin_make one"),
    (".", "catkin_make tests run_tests"),
    (".", "catkin_make -DCATKIN_ENABLE_TESTING=0 run_tests"),
    (".", "catkin_make -DCATKIN_ENABLE_TESTING=1 clean_test_results"),
    (".", "catkin_make --source src --build other -DCATKIN_DEVEL_PREFIX=elsewhere install"),
    (".", "catkin_test_results"),
    (".", "catkin_test_results --all results"),
    (".", "catkin_test_results --verbose results"),
    (".", "catkin_test_results nowhere"),
    ("src", "catkin_init_workspace"),
    ("empty", "catkin_init_workspace"),
    (".", "catkin_init_workspace nowhere"),
]

RESULTS = {
    "a.xml": '<testsuite tests="3" errors="1" failures="1" skip="1"/>',
    "b.xml": '<testsuites><testsuite tests="2" errors="0" failures="0"/><testsuite tests="1"/></testsuites>',
    "c.xml": '<testsuites tests="1" errors="0" failures="0" disabled="2"/>',
    "d.xml": '<testsuite errors="1"/>',
    "e.xml": "<other/>",
}


def files_below(folder: Path) -> dict[str, str]:
    return {str(path.relative_to(folder)): path.read_text() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("words", CREATE)
def test_a_new_package_equals_that_of_genuine_catkin(ros: RosSystem, words: str, tmp_path: Path) -> None:
    made = []
    for name, side in (("genuine", ros.genuine), ("pipros", ros.pipros)):
        folder = tmp_path / name
        folder.mkdir()
        ended = side.processes.run(
            "catkin_create_pkg",
            *words.split(),
            cwd=folder,
            environment={"ROS_DISTRO": "noetic", "USER": "ada"},
        )
        said = [line.replace(str(folder), "HERE") for line in ended.stdout]
        made.append((ended.returncode, said, files_below(folder)))
    assert made[1] == made[0]


@pytest.mark.timeout(600)
def test_command_lines_end_as_they_do_in_genuine_catkin(ros: RosSystem, tmp_path: Path) -> None:
    assert carried_out(ros.pipros, tmp_path / "pipros") == carried_out(ros.genuine, tmp_path / "genuine")


def carried_out(side: Side, base: Path) -> list[tuple[str, int | None, list[str]]]:
    """Return each command line with its exit code and, if it failed, the error."""
    package = base / "src" / "one"
    for folder in (package, base / "empty", base / "results"):
        folder.mkdir(parents=True)
    (package / "package.xml").write_text(MANIFEST.format(name="one"))
    (package / "CMakeLists.txt").write_text(CMAKE)
    for name, content in RESULTS.items():
        (base / "results" / name).write_text(content)
    side.environment.pop("ROS_PACKAGE_PATH", None)
    ends = []
    for folder_name, line in IN_A_WORKSPACE:
        ended = side.processes.run(*line.split(), cwd=base / folder_name, timeout_s=120)
        said = ended.stdout if "results" in line and "make" not in line else []
        if ended.returncode:
            said = [*said, *ended.stderr]
        ends.append((line, ended.returncode, sorted(filter(None, (plain(text, base) for text in said)))))
    return ends


def plain(line: str, base: Path) -> str:
    """Return a line without colours and paths; empty for lines of only one side, and for options of make."""
    line = re.sub(r"\033\[\d+m", "", line).replace(str(base), "BASE")
    line = re.sub(r'Invoking "make (.*?)( -[jl]\d+)* ?" failed', r'Invoking "make \1" failed', line)
    return "" if line.startswith("Call catkin_make in") else line
