"""Programs of a robot: descriptions and frames, maps, diagnostics, and jumps of simulated time."""

import re
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from nav_msgs.msg import OccupancyGrid
from rosgraph_msgs.msg import Clock

from actionlib.msg import TestActionGoal as Goal
from pipros.basics.extras import install_command
from pipros.msg import load_message_class
from pipros.msg.importing.hook import PackageFinder
from pipros.msg.time import Time
from pipros.packages import ImportablePackages
from tests.support.robot import make_robot_package
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

# A robot in xacro: loaded by a launch file, parsed by urdf_parser_py, its frames sent by two nodes.


ASK = """import rospy, tf2_ros
from urdf_parser_py.urdf import URDF
robot = URDF.from_parameter_server()
print(robot.name, robot.get_root(), [joint.name for joint in robot.joints if joint.type == "revolute"])
rospy.init_node("ask")
buffer = tf2_ros.Buffer()
listener = tf2_ros.TransformListener(buffer)
for frame in ("upper", "finger", "camera"):
    moved = buffer.lookup_transform("base", frame, rospy.Time(0), rospy.Duration(30)).transform
    print(frame, *("%.3f" % getattr(moved.translation, axis) for axis in "xyz"))
"""


@pytest.fixture
def package(ros: RosSystem) -> Path:
    package = make_robot_package(ros.home / "src")
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(package.parent)
    return package


def test_a_launched_robot_has_its_frames(ros: RosSystem, package: Path) -> None:
    (package / "launch" / "all.launch").write_text(
        """<launch><include file="$(find arm_description)/launch/arm.launch"/>
        <node pkg="joint_state_publisher" type="joint_state_publisher" name="joint_state_publisher"/>
        <node pkg="robot_state_publisher" type="state_publisher" name="frames"/></launch>"""
    )
    launch = ros.pipros.start("roslaunch", "-p", str(ros.port), "arm_description", "all.launch")
    ros.wait_for_publisher("/tf")
    (ros.home / "ask.py").write_text(ASK)

    asked = ros.pipros.run("python3", ros.home / "ask.py", timeout_s=60)
    launch.press_ctrl_c()
    launch.wait()

    assert asked.stdout == [
        "arm base ['shoulder', 'elbow']", "upper 0.000 0.000 1.500", "finger 0.707 0.000 1.207",
        "camera 0.100 0.200 0.300",
    ], asked.output  # fmt: skip
    assert "use robot_state_publisher instead" in launch.output


def test_rosrun_xacro_expands_and_names_packages_that_are_unknown(ros: RosSystem, package: Path) -> None:
    file = package / "urdf" / "arm.urdf.xacro"
    expanded = ros.pipros.run("rosrun", "xacro", "xacro", "--inorder", file, "length:=8")
    missing = ros.pipros.run("rosrun", "xacro", "xacro", "nothing.xacro")
    file.write_text(file.read_text().replace("find arm_description", "find leg_description"))
    failed = ros.pipros.run("rosrun", "xacro", "xacro", file)

    assert expanded.returncode == 0, expanded.output
    assert any('<origin rpy="0 0.7853' in line and 'xyz="0 0 4.0"' in line for line in expanded.stdout)
    assert (missing.returncode, "No such file or directory" in missing.output) == (2, True)
    assert "Traceback" not in missing.output
    assert failed.returncode != 0
    assert "there is no package leg_description. Is its folder on ROS_PACKAGE_PATH" in failed.output


@pytest.mark.parametrize("program", ["joint_state_publisher", "robot_state_publisher"])
@pytest.mark.parametrize(
    ("description", "complaint"),
    [
        (None, "robot_description"), ("<robot/>", "must have no parent"), ("<robot", "unclosed token"),
        ("<map/>", "robot_description"), ("[1]", "robot_description"),
    ],
)  # fmt: skip
def test_a_description_that_is_missing_or_wrong_is_named(ros, program, description, complaint: str) -> None:
    ros.serve_master()
    if description:
        ros.pipros.run("rosparam", "set", "robot_description", description)

    ended = ros.pipros.run("rosrun", program, program)

    assert ended.returncode == 1
    assert complaint in ended.output
    assert "Traceback" not in ended.output


@pytest.mark.parametrize("module", ["xacro", "urdf_parser_py"])
def test_a_missing_library_is_named_with_its_extra(module: str) -> None:
    packages = ImportablePackages()

    spec = PackageFinder(packages.find, packages.find_module).find_spec(module)

    with pytest.raises(ModuleNotFoundError, match=f"{module} is not .*{re.escape(install_command('urdf'))}"):
        spec.loader.exec_module(ModuleType(module))


def test_a_publish_frequency_beyond_reason_is_limited(ros: RosSystem) -> None:
    """Check that the program prints the period of its timer."""
    ros.serve_master()
    ros.pipros.run(
        *("rosparam", "set", "robot_description"),
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="fixed">'
        '<parent link="a"/><child link="b"/></joint></robot>',
    )
    (ros.home / "node.py").write_text(
        "import sys, rospy, robot_state_publisher\n"
        "rospy.Timer = lambda period, *_, **__: print('period', period.to_nsec(), flush=True)\n"
        "sys.exit(robot_state_publisher.main())\n"
    )
    node = ros.pipros.start(
        "python3", "node.py", "_publish_frequency:=1000000000000.0", "_use_tf_static:=false"
    )
    node.wait_for("period 1000000$")
    node.press_ctrl_c(code=0)


# map_server and map_saver: a map is served, requested, replaced and saved.


YAML = """image: {name}.pgm
resolution: 0.5
origin: [1.0, 2.0, 1.5707963]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""
MAP_ASK = """import rospy
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import GetMap, LoadMap
rospy.init_node("ask")
grid = rospy.wait_for_message("map", OccupancyGrid, timeout=30)
info = rospy.wait_for_message("map_metadata", MapMetaData, timeout=30)
print(grid.header.frame_id, info.width, info.height, info.resolution, list(grid.data), info == grid.info)
print("%.3f %.3f" % (info.origin.position.y, info.origin.orientation.z))
rospy.wait_for_service("static_map", 30)
print(rospy.ServiceProxy("static_map", GetMap)().map == grid)
change = rospy.ServiceProxy("change_map", LoadMap)
print([change(name).result for name in ("other.yaml", "nowhere.yaml", "bad.yaml", "broken.yaml")])
print(list(rospy.wait_for_message("map", OccupancyGrid, timeout=30).data))
"""


def write_map(folder: Path, name: str, pixels: bytes) -> None:
    (folder / f"{name}.yaml").write_text(YAML.format(name=name))
    (folder / f"{name}.pgm").write_bytes(b"P5\n%d 1\n255\n" % len(pixels) + pixels)


def test_a_map_is_served_and_saved(ros: RosSystem) -> None:
    write_map(ros.home, "map", b"\x00\xcd\xff")
    write_map(ros.home, "other", b"\xff")
    write_map(ros.home, "broken", b"")
    (ros.home / "bad.yaml").write_text("image: map.pgm")
    (ros.home / "ask.py").write_text(MAP_ASK)
    ros.serve_master()
    server = ros.pipros.start("rosrun", "map_server", "map_server", "map.yaml", "_frame_id:=floor")
    server.wait_for(r"Read a 3 X 1 map @ 0.500 m/cell")
    saved = ros.pipros.run("rosrun", "map_server", "map_saver", "-f", "saved", "--occ", "80", "--free", "20")
    asked = ros.pipros.run("python3", "ask.py", timeout_s=60)
    server.press_ctrl_c()
    server.wait()

    assert asked.stdout == [
        "floor 3 1 0.5 [100, -1, 0] True", "2.000 0.707", "True", "[0, 255, 255, 255]", "[0]",
    ], asked.output  # fmt: skip
    assert saved.returncode == 0, saved.output
    assert (ros.home / "saved.pgm").read_bytes().endswith(b"\n3 1\n255\n\x00\xcd\xfe")
    assert (
        (ros.home / "saved.yaml")
        .read_text()
        .startswith(
            "image: saved.pgm\nresolution: 0.500000\norigin: [1.000000, 2.000000, 1.570796]\nnegate: 0\n"
        )
    )


@pytest.mark.parametrize(
    ("program", "arguments", "complaint"),
    [
        ("map_server", "", "USAGE: map_server <map.yaml>"),
        ("map_server", "nowhere.yaml", "Map_server could not open"),
        ("map_server", "nowhere.pgm 0", "resolution must be a finite number > 0 (m/pixel), got 0"),
        ("map_saver", "-f", "Usage:"),
        ("map_saver", "--occ 0", "threshold_occupied must be between 1 and 100, got 0"),
        ("map_saver", "--free x", "threshold_free must be between 0 and 100, got x"),
        ("map_saver", "--free 80", "threshold_free must be smaller than threshold_occupied"),
    ],
)
def test_wrong_arguments_are_explained(ros: RosSystem, program: str, arguments: str, complaint: str) -> None:
    ros.serve_master()
    ended = ros.pipros.run("rosrun", "map_server", program, *arguments.split())

    assert ended.returncode != 0
    assert complaint in ended.output


@pytest.mark.parametrize(("size", "cells"), [((2, 2), 3), ((2**32 - 1, 2**32 - 1), 0), ((1, 1), 2)])
def test_a_map_with_a_wrong_number_of_cells_is_not_saved(ros, size: tuple[int, int], cells: int) -> None:
    ros.serve_master()
    saver = ros.pipros.start("rosrun", "map_server", "map_saver", "-f", "saved")
    with ros.node("broken") as node:
        grid = OccupancyGrid(data=[0] * cells)
        grid.info.width, grid.info.height = size
        node.advertise("/map", OccupancyGrid, latch=True).publish(grid)
        assert saver.wait() == 1, saver.output
    assert f"the map must have {size[0]} X {size[1]} cells, got {cells}" in saver.output
    assert list(ros.home.glob("saved*")) == []


# The diagnostic aggregator as a node: parameters, topics, and analyzers added by another node.


LAUNCH = """<launch>
  <node pkg="diagnostic_aggregator" type="aggregator_node" name="aggregator" output="screen">
    <param name="pub_rate" value="50"/>
    <rosparam>
      analyzers:
        good: {type: diagnostic_aggregator/GenericAnalyzer, path: Good, startswith: good, timeout: 0}
        bad: {type: my_pkg/MyAnalyzer, path: Bad}
    </rosparam>
  </node>
</launch>"""


def test_an_aggregator_accepts_analyzers_of_other_nodes(ros: RosSystem) -> None:
    ros.serve_master()
    launch = ros.home / "aggregator.launch"
    launch.write_text(LAUNCH)
    launched = ros.pipros.start("roslaunch", launch)
    states: list[int] = []
    reports: list[dict[str, Any]] = [{}]

    def keep(array: Any) -> None:
        reports.append({status.name: status for status in array.status})

    with ros.node("probe") as node:
        node.subscribe("/diagnostics_agg", DiagnosticArray, keep)
        node.subscribe(
            "/diagnostics_toplevel_state", DiagnosticStatus, lambda state: states.append(state.level)
        )
        publisher = node.advertise("/diagnostics", DiagnosticArray, latch=True)
        array = DiagnosticArray(
            status=[DiagnosticStatus(0, name, "m", "hw", []) for name in ("good: 1", "lent")]
        )
        array.header.stamp.secs = 1

        def report_of(*names: str) -> dict[str, Any]:
            publisher.publish(array)
            newest = reports[-1]
            return newest if set(newest) == set(names) else {}

        before = ["/Good", "/Good/good: 1", "/bad", "/Other", "/Other/lent"]
        report = wait_until(lambda: report_of(*before), 60, lambda: f"{list(reports[-1])} {launched.output}")
        good, bad = report["/Good/good: 1"], report["/bad"]
        assert (good.level, good.message, good.hardware_id) == (0, "m", "hw")
        assert (bad.level, bad.message) == (2, "Pluginlib exception loading analyzer")
        assert bad.values[0].value.startswith("unknown analyzer type my_pkg/MyAnalyzer")
        wait_until(lambda: states and states[-1] == 2, 60, "the level of everything")
        launched.wait_for("the analyzer /bad is ignored")

        told = ros.pipros.run("rosrun", "rosdiagnostic", "rosdiagnostic", "-l", "warning", "-d")
        assert told.returncode == 0, told.output
        assert "Error    /bad: Pluginlib exception loading analyzer" in told.stdout
        assert any("unknown analyzer type my_pkg/MyAnalyzer" in line for line in told.stdout)
        assert not any("/Good" in line for line in told.stdout)
        told = ros.pipros.run("rosrun", "rosdiagnostic", "rosdiagnostic", "-t", "/nothing", "-w", "0.1")
        assert (told.returncode, "no message on /nothing within 0.1 s" in told.output) == (1, True)

        node.master.set_param(
            "/lender/analyzers", {"a": {"type": "GenericAnalyzer", "path": "L", "name": "lent"}}
        )
        file = ros.home / "analyzers.yaml"
        file.write_text("analyzers: {a: {type: GenericAnalyzer, path: F, name: lent}}\n")
        of_file = ros.pipros.start("rosrun", "diagnostic_aggregator", "add_analyzers", file, "-t", "30")
        wait_until(
            lambda: report_of("/Good", "/Good/good: 1", "/bad", "/F", "/F/lent"), 60, lambda: str(reports[-1])
        )
        assert node.master.has_param("/add_analyzers/analyzers/a/type")
        of_file.press_ctrl_c(code=0)
        wait_until(lambda: report_of(*before), 60, lambda: str(reports[-1]))

        lender = ros.pipros.start("rosrun", "diagnostic_aggregator", "add_analyzers", "__name:=lender")
        lender.wait_for("the analyzers were added")
        lent = ("/Good", "/Good/good: 1", "/bad", "/L", "/L/lent")
        wait_until(lambda: report_of(*lent), 60, lambda: str(reports[-1]))
        lender.press_ctrl_c(code=0)
        wait_until(lambda: report_of(*before), 60, lambda: f"{list(reports[-1])} {launched.output}")

        refused = ros.pipros.run("rosrun", "diagnostic_aggregator", "add_analyzers", "__name:=poor")
        assert (refused.returncode, "/poor/analyzers is not set" in refused.output) == (1, True)
        node.master.set_param("/wrong/analyzers", {"a": {"type": "my_pkg/MyAnalyzer", "path": "L"}})
        refused = ros.pipros.run("rosrun", "diagnostic_aggregator", "add_analyzers", "__name:=wrong")
        assert (refused.returncode, "unknown analyzer type my_pkg" in refused.output) == (1, True)


# Programs with a loop, an action server or an updater go on after simulated time has moved back.


PROGRAMS = {
    "/tf": ("tf", "static_transform_publisher", *["0", "0", "0", "0", "0", "0", "a", "b", "100"]),
    "/diagnostics_agg": ("diagnostic_aggregator", "aggregator_node"),
}
SCRIPT = """
import actionlib, diagnostic_updater, rospy
from actionlib.msg import TestAction
rospy.init_node("served")
server = actionlib.SimpleActionServer("act", TestAction, lambda goal: server.set_succeeded(), False)
server.start()
updater = diagnostic_updater.Updater()
rospy.Timer(rospy.Duration(0.1), lambda _: updater.update())
rospy.spin()
"""


def test_programs_go_on(ros: RosSystem) -> None:
    ros.serve_master()
    received: dict[str, int] = {}
    ended: list[str] = []
    with ros.node("probe") as node:
        node.master.set_param("/use_sim_time", True)
        clock, goals = node.advertise("/clock", Clock), node.advertise("/act/goal", Goal)

        def count(topic: str) -> None:
            received[topic] = received.get(topic, 0) + 1

        kinds = ("tf2_msgs/TFMessage", "diagnostic_msgs/DiagnosticArray", "diagnostic_msgs/DiagnosticArray")
        topics = (*PROGRAMS, "/diagnostics")
        for topic, kind in zip(topics, kinds, strict=True):
            node.subscribe(topic, load_message_class(kind), lambda _, topic=topic: count(topic))
        result: Any = load_message_class("actionlib/TestActionResult")
        node.subscribe("/act/result", result, lambda each: ended.append(each.status.goal_id.id))
        started = [ros.pipros.start_node(*each) for each in PROGRAMS.values()]
        started.append(ros.pipros.start(sys.executable, "-c", SCRIPT))
        for begin_s in (1000, 100):
            received.clear()
            now_s = float(begin_s)

            def is_done(name: str) -> bool:
                """Let time pass, and send a goal until it has ended."""
                nonlocal now_s
                now_s += 0.1
                clock.publish(Clock(Time.from_sec(now_s)))
                made = Goal()
                made.goal_id.id, made.goal_id.stamp = name, Time.from_sec(now_s)
                goals.publish(made)
                return name in ended and all(received.get(topic, 0) > 1 for topic in topics)

            wait_until(
                lambda name=f"goal {begin_s}": is_done(name), 60,
                lambda: f"{received} {ended} {[each.output for each in started]}",
            )  # fmt: skip
