"""Goals between pipros and genuine ROS have the same outcome in either direction."""

import json
import os
import subprocess
from pathlib import Path

import pytest

from pipros.msg.language.parse import parse_action
from pipros_libraries.actions.client_goal import TRANSITIONS
from pipros_workspace.index import SHARED_PACKAGES
from tests.support.environments import CPP_ONLY, genuine_environment
from tests.support.ros import RosSystem
from tests.support.roscpp import compile_program
from tests.support.same_results import printed

PROGRAMS = Path(__file__).parent / "programs"

TABLE = """
import json
from actionlib.action_client import _transitions
print(json.dumps([[state, status, list(way) if isinstance(way, tuple) else [way]]
                  for state, ways in _transitions.items() for status, way in ways.items()]))
"""


def test_the_table_of_clients_is_that_of_genuine() -> None:
    genuine = printed("/usr/bin/python3", "-c", TABLE)

    # -1: no change, -2: impossible; DONE has no transitions, so it is not in our table.
    theirs = {
        (state, status): [number for number in way if number != -1]
        for state, status, way in json.loads(genuine)
        if way != [-2] and state != 7
    }
    ours = {
        (int(s), int(t)): [int(x) for x in way] for s, ways in TRANSITIONS.items() for t, way in ways.items()
    }
    assert ours == theirs


@pytest.mark.parametrize(
    ("server", "client"),
    [("pipros", "genuine"), ("genuine", "pipros"), ("pipros", "pipros"), ("roscpp", "pipros")],
)
def test_goals_have_the_same_outcome(plain_ros: RosSystem, server: str, client: str) -> None:
    plain_ros.serve_master()
    sides = {"pipros": plain_ros.pipros, "genuine": plain_ros.genuine}
    if server == "roscpp":
        serving = plain_ros.genuine.start(compile_program(PROGRAMS / "goals.cpp", "actionlib"), "server")
    else:
        serving = sides[server].start("python3", PROGRAMS / "serve_goals.py")

    ended = sides[client].run("python3", PROGRAMS / "send_goals.py", timeout_s=120)
    serving.press_ctrl_c()

    lines = ended.stdout
    assert lines == [
        "True", "3 5 reached", "[('done', 'SUCCEEDED', 7)]", "101 False", "True 2 -1 asked to end", "2",
        "3 8", "4 Exception in execute callback: by the goal", "4", "True",
        "['WAITING_FOR_RESULT', 'DONE'] REJECTED -2", "not below zero",
        "['WAITING_FOR_RESULT', 'DONE'] ABORTED -3", "never", "True 2",
    ], ended.output  # fmt: skip


def test_goals_of_a_client_in_cpp_end_as_they_should(plain_ros: RosSystem) -> None:
    plain_ros.serve_master()
    plain_ros.pipros.start("python3", PROGRAMS / "serve_goals.py")

    ended = plain_ros.genuine.run(
        compile_program(PROGRAMS / "goals.cpp", "actionlib"), "client", timeout_s=120
    )

    assert ended.stdout == [
        "1", "SUCCEEDED 5 reached", "ABORTED 0 Exception in execute callback: by the goal", "101", "1",
        "PREEMPTED -1 asked to end", "SUCCEEDED 8 reached",
    ], ended.output  # fmt: skip


@pytest.mark.parametrize("side", ["pipros", "genuine"])
def test_goals_removed_from_the_status_list_are_lost(plain_ros: RosSystem, side: str) -> None:
    plain_ros.serve_master()
    sides = {"pipros": plain_ros.pipros, "genuine": plain_ros.genuine}

    ended = sides[side].run("python3", PROGRAMS / "lose_goals.py", timeout_s=120)

    lines = [line for line in ended.stdout if not line.startswith("[ERROR]")]
    assert lines == [
        "[]", "True", "['StatusTracker'] True", "delete LOST", "['StatusTracker'] True", "clear LOST",
        "['StatusTracker'] True", "replace LOST", "[]",
    ], ended.output  # fmt: skip


# Genuine catkin builds packages of actions with the `actionlib_msgs` of pipros.
EXTRAS = SHARED_PACKAGES / "actionlib_msgs" / "cmake" / "actionlib_msgs-extras.cmake"

MANIFEST = """<package format="2"><name>charging</name><version>1.0.0</version><description>d</description>
<maintainer email="m@example.org">m</maintainer><license>none</license>
<buildtool_depend>catkin</buildtool_depend><depend>actionlib_msgs</depend><depend>std_msgs</depend>
<depend>roscpp</depend></package>"""
CMAKE = """cmake_minimum_required(VERSION 3.0.2)
project(charging)
find_package(catkin REQUIRED COMPONENTS actionlib_msgs roscpp std_msgs)
add_action_files(FILES Charge.action)
generate_messages(DEPENDENCIES actionlib_msgs std_msgs)
catkin_package(CATKIN_DEPENDS actionlib_msgs)
include_directories(${catkin_INCLUDE_DIRS})
add_executable(charger charger.cpp)
target_link_libraries(charger ${catkin_LIBRARIES})
add_dependencies(charger ${${PROJECT_NAME}_EXPORTED_TARGETS} ${catkin_EXPORTED_TARGETS})
install(TARGETS charger RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
"""
ACTION = "# far\nfloat32 level\nstring NOTE=a; [b] # \\ ${c}\n---\nstd_msgs/String said\n---\nfloat32 got\n"
CHARGER = """#include <charging/ChargeAction.h>
#include <ros/ros.h>
int main(int argc, char** argv) {
  ros::init(argc, argv, "charger");
  ros::NodeHandle node;
  ros::Publisher results = node.advertise<charging::ChargeActionResult>("charge/result", 1, true);
  typedef charging::ChargeActionGoal Goal;
  boost::function<void(const Goal&)> charge = [&](const Goal& goal) {
    charging::ChargeActionResult result;
    result.status.goal_id = goal.goal_id;
    result.status.status = actionlib_msgs::GoalStatus::SUCCEEDED;
    result.result.said.data = "charged to " + std::to_string(int(goal.goal.level));
    results.publish(result);
  };
  ros::Subscriber goals = node.subscribe<Goal>("charge/goal", 1, charge);
  ros::spin();
}
"""
CLIENT = """import rospy
from charging.msg import ChargeActionGoal, ChargeActionResult
rospy.init_node("client")
goals = rospy.Publisher("charge/goal", ChargeActionGoal, latch=True, queue_size=1)
goal = ChargeActionGoal()
goal.goal_id.id = "first"
goal.goal.level = 80
goals.publish(goal)
result = rospy.wait_for_message("charge/result", ChargeActionResult, timeout=60)
print(result.status.goal_id.id, result.status.status, result.result.said.data)
"""


def build(workspace: Path, *targets: str) -> str:
    """Return the output of genuine catkin_make, which must succeed."""
    built = subprocess.run(
        ["catkin_make", "-C", str(workspace), *targets],
        env=genuine_environment(workspace, "http://127.0.0.1:1") | {"CMAKE_PREFIX_PATH": "/usr"} | CPP_ONLY,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False,
    )  # fmt: skip
    assert built.returncode == 0, built.stdout
    return built.stdout


def test_a_package_of_actions_is_compiled_and_serves_a_python_node(ros: RosSystem, tmp_path: Path) -> None:
    workspace = tmp_path / "catkin_ws"
    package = workspace / "src" / "charging"
    (package / "action").mkdir(parents=True)
    (workspace / "src" / "actionlib_msgs").symlink_to(SHARED_PACKAGES / "actionlib_msgs")
    (package / "package.xml").write_text(MANIFEST)
    (package / "CMakeLists.txt").write_text(CMAKE)
    (package / "charger.cpp").write_text(CHARGER)
    action = package / "action" / "Charge.action"
    action.write_text(ACTION)

    said = build(workspace, "install")

    assert "charging: the messages of the action Charge are in " in said
    messages = workspace / "devel" / "share" / "charging" / "msg"
    assert written(messages) == expected("charging/Charge", ACTION)
    installed = workspace / "install" / "share"
    assert (installed / "charging" / "action" / "Charge.action").read_text() == ACTION
    assert written(installed / "charging" / "msg") == expected("charging/Charge", ACTION)
    assert (installed / "actionlib_msgs" / "cmake" / EXTRAS.name).read_text() == EXTRAS.read_text()

    client = workspace / "client.py"
    client.write_text(CLIENT)
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(workspace / "src")
    ros.pipros.environment["CMAKE_PREFIX_PATH"] = f"{workspace / 'devel'}{os.pathsep}/usr"
    ros.serve_master()
    charger = ros.pipros.start("rosrun", "charging", "charger")
    asked = ros.pipros.run("python3", client, timeout_s=90)
    assert asked.stdout == ["first 3 charged to 80"], asked.output
    charger.press_ctrl_c()
    assert charger.wait() == 0

    unchanged = (messages / "ChargeActionGoal.msg").stat().st_mtime_ns
    action.write_text(f"{ACTION}float32 left\n")
    build(workspace, "charging_generate_messages_cpp")
    assert "left" in (workspace / "devel/include/charging/ChargeFeedback.h").read_text()
    assert (messages / "ChargeActionGoal.msg").stat().st_mtime_ns == unchanged


def written(folder: Path) -> dict[str, str]:
    return {file.stem: file.read_text() for file in folder.glob("*.msg")}


def expected(type_name: str, text: str) -> dict[str, str]:
    return {spec.name: spec.text for spec in parse_action(text, type_name).messages}


@pytest.mark.parametrize(
    "text",
    [
        "---\n---", "---\n---\n", "int8 a\n---\nint8 b\n---\nint8 c",
        "int8 a\r\n--- and more\r\nint8 b\r\n----\r\nint8 c\r\n", "\n\n---\n\n---\n\n",
        'string A=";[\\"]${A}@B@$ENV{HOME} \\\n---\nstring B=[;\n--- [\nstring C=]é\\\n',
        "int8 a # ---\n ---\n---\n---\nint8 b",
    ],
)  # fmt: skip
def test_the_messages_of_an_action_equal_those_of_the_python_code(tmp_path: Path, text: str) -> None:
    ended = expand(tmp_path, text)

    assert ended.returncode == 0, ended.stderr
    plain = text.replace("\r\n", "\n").replace("\n ---", "\n # ---")  # neither a separator nor a field
    assert written(tmp_path / "msg").keys() == expected("a/Do", plain).keys()
    for name, definition in expected("a/Do", plain).items():
        assert (tmp_path / "msg" / f"{name}.msg").read_text().replace("\n ---", "\n # ---") == definition


@pytest.mark.parametrize("text", ["", "int8 a\n---\nint8 b\n", "---\n---\n---\n"])
def test_an_action_with_other_than_three_parts_is_refused(tmp_path: Path, text: str) -> None:
    ended = expand(tmp_path, text)

    assert ended.returncode != 0
    message = " ".join(ended.stderr.split())
    assert f"{tmp_path}/Do.action: expected a goal, a result and a feedback" in message.replace("- ", "-")


def expand(folder: Path, text: str) -> subprocess.CompletedProcess[str]:
    """Call the function behind `add_action_files` alone."""
    (folder / "Do.action").write_bytes(text.encode())
    (folder / "genmsgConfig.cmake").touch()
    script = folder / "expand.cmake"
    script.write_text(
        f'set(genmsg_DIR "{folder}")\ninclude("{EXTRAS}")\n'
        f'_actionlib_msgs_expand("{folder}/Do.action" "{folder}/msg" names)\n'
    )
    return subprocess.run(["/usr/bin/cmake", "-P", script], capture_output=True, text=True, check=False)
