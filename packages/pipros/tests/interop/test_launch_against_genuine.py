"""roslaunch starts the same nodes, parameters, arguments and environments as genuine roslaunch."""

import json
import re
import shutil
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.env import DISTRIBUTION
from tests.support.environments import file_of_tests
from tests.support.processes import Process
from tests.support.ros import RosSystem, Side

GOLDEN = file_of_tests("golden/launch_language")

PROBE = """\
#!/usr/bin/env python3
import json, os, sys
seen = {name: value for name, value in os.environ.items() if name.startswith("ROS_") or name in "ABC"}
with open(os.environ["PROBE_FILE"] + "-" + sys.argv[1], "w") as file:
    json.dump({"argv": sys.argv[1:], "folder": os.getcwd(), "environment": seen}, file)
"""

EVERYTHING = """\
<launch>
  <arg name="who" default="world" doc="whom to greet"/>
  <arg name="fixed" value="$(arg who)!"/>
  <env name="A" value="outer"/>
  <remap from="chatter" to="/talk"/>
  <param name="text" value="$(arg fixed)"/>
  <param name="number" value="7"/>
  <param name="ratio" value="0.5"/>
  <param name="flag" value="true"/>
  <param name="as_text" value="7" type="str"/>
  <param name="from_file" textfile="$(dirname)/note.txt"/>
  <param name="printed" command="cat $(dirname)/number.txt"/>
  <param name="tree" type="yaml" value="{a: 1, b: [x, y]}"/>
  <rosparam command="load" file="$(dirname)/params.yaml" ns="loaded"/>
  <rosparam param="angles" subst_value="true">[deg(90), rad(pi/2), "$(arg who)"]</rosparam>
  <param name="~everybody" value="1"/>
  <group ns="inner" if="$(eval who == 'world')">
    <remap from="a" to="b"/>
    <env name="B" value="group"/>
    <rosparam>{deep: {er: [1, 2.5, true, text]}}</rosparam>
    <node pkg="probes" type="probe" name="one" args="one 'two words' $(arg who)" output="screen">
      <param name="own" value="1"/>
      <rosparam param="list">[1, 2]</rosparam>
      <remap from="~private" to="elsewhere"/>
      <env name="C" value="node"/>
    </node>
  </group>
  <node pkg="probes" type="probe" name="two" args="two" cwd="node" ns="/abs/olute" required="false"/>
  <node pkg="probes" type="probe" name="three" args="three $(find probes)/x"
        launch-prefix="env" clear_params="true"/>
  <node pkg="probes" type="probe" name="never" args="never" unless="1"/>
  <include file="$(find probes)/included.launch" ns="sub" pass_all_args="true">
    <arg name="more" value="m"/>
  </include>
  <test pkg="probes" type="probe" test-name="a_test" args="test"/>
</launch>
"""

INCLUDED = """\
<launch>
  <arg name="who"/><arg name="more" default="none"/>
  <node pkg="probes" type="probe" name="four" args="four $(arg who) $(arg more)">
    <param name="p" value="$(arg more)"/>
  </node>
</launch>
"""


@pytest.fixture
def package(ros: RosSystem) -> Path:
    folder = ros.home / "probes"
    folder.mkdir()
    (folder / "package.xml").write_text(
        '<package format="2"><name>probes</name><version>0.0.1</version><description>d</description>'
        '<maintainer email="a@example.org">A</maintainer><license>Apache-2.0</license></package>'
    )
    (folder / "probe").write_text(PROBE)
    (folder / "probe").chmod(0o755)
    (folder / "everything.launch").write_text(EVERYTHING)
    (folder / "included.launch").write_text(INCLUDED)
    (folder / "note.txt").write_text("a note\n")
    (folder / "number.txt").write_text("42\n")
    (folder / "params.yaml").write_text("x: 1\ny: {z: [1, 2]}\n")
    for side in (ros.genuine, ros.pipros):
        side.environment["ROS_PACKAGE_PATH"] = f"{folder}:{side.environment['ROS_PACKAGE_PATH']}"
        side.environment.update(DISTRIBUTION)  # as after sourcing setup.bash
    return folder


def inspect(side: Side, *arguments: str) -> list[str]:
    ended = side.run("roslaunch", *arguments, "probes", "everything.launch")
    assert ended.returncode == 0, ended.output
    return ended.stdout


@pytest.mark.parametrize("option", ["--nodes", "--ros-args", "--dump-params"])
def test_the_inspections_print_the_same(ros: RosSystem, package: Path, option: str) -> None:
    assert inspect(ros.pipros, option) == inspect(ros.genuine, option)


def test_the_files_are_the_same(ros: RosSystem, package: Path) -> None:
    # genuine roslaunch prints these lines in an order that varies between runs
    assert sorted(inspect(ros.pipros, "--files")) == sorted(inspect(ros.genuine, "--files"))


@pytest.mark.parametrize("node", ["inner/one", "/abs/olute/two", "three", "sub/four"])
def test_the_command_lines_are_the_same(ros: RosSystem, package: Path, node: str) -> None:
    assert inspect(ros.pipros, f"--args={node}") == inspect(ros.genuine, f"--args={node}")


CORNERS = {
    "broken": "<launch><nonsense",
    "master": '<launch><master auto="start"/><node pkg="probes" type="x" name="n"/></launch>',
    "no_machine": '<launch><node pkg="probes" type="x" name="n" machine="nowhere"/></launch>',
    "two_finds": '<launch><param name="two" value="$(find probes)$(find probes)"/></launch>',
    "default": """<launch><param name="a" value="$(eval optenv('NOPE', 0))"/></launch>""",
    **{
        f"cwd_{folder}": f'<launch><node pkg="probes" type="x" name="n" cwd="{folder}"/></launch>'
        for folder in ("ros_home", "ROS_HOME", "node", "NODE")
    },
}

CORNER_CASES = [
    *((option, "master") for option in ("--nodes", "--dump-params", "--files", "--ros-args")),
    *((option, "no_machine") for option in ("--nodes", "--dump-params", "--files", "--ros-args")),
    *(("--nodes", f"cwd_{folder}") for folder in ("ros_home", "ROS_HOME", "node", "NODE")),
    *(("--dump-params", name) for name in ("two_finds", "default", "broken")),
]
"""Option and file."""


def test_unusual_files_are_inspected_alike(ros: RosSystem, package: Path) -> None:
    for name, text in CORNERS.items():
        (package / f"{name}.launch").write_text(text)
    for option, name in CORNER_CASES:
        genuine, ours = (
            outcome(side.run("roslaunch", option, package / f"{name}.launch"))
            for side in (ros.genuine, ros.pipros)
        )
        assert (option, name, ours) == (option, name, genuine)


def outcome(ended: Process) -> tuple[int | None, list[str], list[str]]:
    """Return the exit code, the findings and the errors."""
    found = [line for line in ended.stdout if line.startswith(("/", "{", "No arguments"))]
    complaints = (
        "Unable to load file", "ignoring defunct <master /> tag", "cwd must be one of 'ROS_HOME', 'node'.",
    )  # fmt: skip
    return ended.returncode, found, [complaint for complaint in complaints if complaint in ended.output]


def probed(ros: RosSystem, side: Side, label: str, core: Side) -> tuple[dict[str, Any], Any]:
    """Return the environment of each node, and the parameters, without paths of this run."""
    master = core.start_master()
    run = side.start("roslaunch", "probes", "everything.launch", PROBE_FILE=str(ros.home / label))
    assert run.wait() == 0, run.output
    parameters = ros.pipros.run("rosparam", "get", "/").stdout
    master.press_ctrl_c()
    master.wait()
    seen = {}
    for file in ros.home.glob(f"{label}-*"):
        text = re.sub(r"[0-9a-f]{8}-[0-9a-f-]{27}", "RUN", file.read_text())
        text = re.sub(r"roslaunch-[\w-]+?-\d+\.log", "LAUNCHER.log", text)
        what = json.loads(text)
        # pipros sets the variables of setup files; genuine ROS ran without one that sets its distribution.
        of_setup_files = ("ROS_DISTRO", "ROS_PYTHON_VERSION", "ROS_VERSION")
        for own in ("ROS_IP", "ROS_PACKAGE_PATH", *of_setup_files):
            what["environment"].pop(own, None)
        seen[file.name.partition("-")[2]] = what
    unstable = ("run_id", "roslaunch", "uris", "host_", "rosdistro", "rosversion")
    return seen, [line for line in parameters if not line.strip().startswith(unstable)]


def test_nodes_have_the_same_environment(ros: RosSystem, package: Path) -> None:
    genuine, genuine_parameters = probed(ros, ros.genuine, "genuine", ros.genuine)
    ours, our_parameters = probed(ros, ros.pipros, "ours", ros.pipros)
    assert sorted(genuine) == ["four", "one", "three", "two"]
    assert ours == genuine
    assert our_parameters == genuine_parameters


def test_pipros_launches_with_a_genuine_master_and_genuine_with_ours(ros: RosSystem, package: Path) -> None:
    mixed, parameters = probed(ros, ros.pipros, "mixed", ros.genuine)
    other, other_parameters = probed(ros, ros.genuine, "other", ros.pipros)
    assert mixed == other
    assert parameters == other_parameters


def test_the_golden_outcomes_are_those_of_the_genuine_loader(ros: RosSystem) -> None:
    folder = ros.home / "cases"
    shutil.copytree(GOLDEN / "files", folder)
    script = Path(__file__).parent / "programs" / "genuine_launch_loader.py"
    ended = ros.genuine.run(
        "python3", script, GOLDEN / "cases.txt", folder, ROS_PACKAGE_PATH="/usr/share", timeout_s=120
    )
    anonymous = re.compile(r"_\w+_\d+_\d{6,}")
    captured = [anonymous.sub("_", line) for line in ended.stdout]
    golden = [anonymous.sub("_", line) for line in (GOLDEN / "genuine.jsonl").read_text().splitlines()]
    assert [json.loads(line) for line in captured] == [json.loads(line) for line in golden]


CPP = """\
#include <ros/ros.h>
#include <words/Word.h>
int main(int argc, char** argv) {
  ros::init(argc, argv, "cpp_talker");
  ros::NodeHandle node;
  ros::Publisher publisher = node.advertise<words::Word>("words", 1, true);
  words::Word word;
  word.word = "from C++";
  publisher.publish(word);
  ros::spin();
}
"""


def add_package(source: Path, name: str, depends: str, cmake: str) -> Path:
    folder = source / name
    folder.mkdir(parents=True)
    needed = "".join(f"<depend>{item}</depend>" for item in depends.split())
    (folder / "package.xml").write_text(
        f'<package format="2"><name>{name}</name><version>0.0.1</version><description>d</description>'
        '<maintainer email="a@example.org">A</maintainer><license>Apache-2.0</license>'
        f"<buildtool_depend>catkin</buildtool_depend>{needed}</package>"
    )
    (folder / "CMakeLists.txt").write_text(
        f"cmake_minimum_required(VERSION 3.0.2)\nproject({name})\n{cmake}\n"
    )
    return folder


def add_words(source: Path) -> None:
    """Add a package with one message."""
    words = add_package(
        source,
        "words",
        "message_generation message_runtime",
        "find_package(catkin REQUIRED COMPONENTS message_generation)\nadd_message_files(FILES Word.msg)\n"
        "generate_messages()\ncatkin_package(CATKIN_DEPENDS message_runtime)",
    )
    (words / "msg").mkdir()
    (words / "msg" / "Word.msg").write_text("string word\n")


def test_genuine_catkin_builds_a_workspace_that_we_built_before(ros: RosSystem) -> None:
    base = ros.home / "both_ws"
    add_words(base / "src")
    assert ros.pipros.run("catkin_make", "-C", base, ROS_PACKAGE_PATH="").returncode == 0
    for _ in range(2):
        made = ros.genuine.run("catkin_make", "-C", base, ROS_PACKAGE_PATH="", timeout_s=150)
        assert made.returncode == 0, made.output
    asked = f". {base}/devel/setup.bash; which rosmsg; rosmsg show words/Word"
    assert ros.genuine.run("bash", "-c", asked).stdout[:2] == ["/usr/bin/rosmsg", "string word"]
    assert ros.pipros.run("catkin_make", "-C", base, ROS_PACKAGE_PATH="").returncode == 0


def test_a_workspace_with_cpp_is_built_by_genuine_catkin_through_ours(ros: RosSystem) -> None:
    base = ros.home / "mixed_ws"
    add_words(base / "src")
    talker = add_package(
        base / "src",
        "cpp_words",
        "roscpp words",
        "find_package(catkin REQUIRED COMPONENTS roscpp words)\ncatkin_package()\n"
        "include_directories(${catkin_INCLUDE_DIRS})\nadd_executable(talker talker.cpp)\n"
        "add_dependencies(talker ${catkin_EXPORTED_TARGETS})\n"
        "target_link_libraries(talker ${catkin_LIBRARIES})",
    )
    (talker / "talker.cpp").write_text(CPP)
    path = f"{ros.pipros.environment['PATH']}:/usr/bin:/bin"

    made = ros.pipros.run("catkin_make", "-C", base, PATH=path, ROS_PACKAGE_PATH="", timeout_s=150)

    assert made.returncode == 0, made.output
    ros.serve_master()
    listen = (
        f". {base}/devel/setup.bash; rosrun cpp_words talker & "
        'python3 -c \'import rospy, words.msg; rospy.init_node("l"); '
        'print(rospy.wait_for_message("words", words.msg.Word, 60).word)\'; kill %1; wait'
    )
    heard = ros.pipros.run("bash", "-c", listen, ROS_PACKAGE_PATH="", timeout_s=90)
    assert "from C++" in heard.stdout, heard.output
