"""What launch files in the shapes of public ones expect from the robot, and what cannot be found out."""

import math
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from pipros_simulation.launch_sets.expected_robot import Expected, expected_robot
from pipros_simulation.launch_sets.wrapper import wrapper_text
from pipros_tools.launch.load_context import CommandFailed, LoadContext, NotRun
from pipros_tools.launch.model import Launch
from pipros_tools.launch.xml import load
from tests.support.environments import file_of_tests

LAUNCH_FILES = file_of_tests("support/launch_sets")


def launch(text: str, tmp_path: Path) -> Launch:
    (tmp_path / "a.launch").write_text(f"<launch>{text}</launch>")
    return load([str(tmp_path / "a.launch")])


def expected(name: str) -> Expected:
    context = LoadContext.of_process()

    def run(command: str) -> str:
        try:
            return context.run_command(command)
        except CommandFailed as error:
            return NotRun(error)

    return expected_robot(
        load([str(LAUNCH_FILES / f"{name}.launch")], context=context._replace(run_command=run))
    )


def test_a_robot_description_has_the_frames_and_the_laser() -> None:
    found = expected("burger")

    wanted = {
        "base_frame": "base_footprint", "scan_frame": "lidar", "publish_static_tf": False,
        "wheel_joints": ["wheel_on_the_left", "wheel_on_the_right"],
        "robots": [{"x": 2.9, "y": 1.0, "yaw": 1.2}],
    }  # fmt: skip
    assert {key: found.params.get(key) for key in wanted} == wanted
    assert "laser" not in found.params
    assert found.unknown == []


def test_controllers_a_filter_and_a_static_transform() -> None:
    found = expected("clearpath")

    assert found.topics == {"scan": "/front/scan", "imu": "/imu/data"}
    wanted = {
        "controllers": "/", "publish_tf": False, "scan_frame": "front_laser",
        "laser": {"x": 0.3, "y": 0.0, "z": 0.25, "yaw": 0.0},
    }  # fmt: skip
    assert {key: found.params.get(key) for key in wanted} == wanted
    start = found.params["robots"][0]  # amcl's default pose is outside of the apartment
    assert found.overrides == {f"/amcl/initial_pose_{a}": start[b] for a, b in zip("xya", start, strict=True)}
    assert found.unknown == []


def test_the_laser_is_at_a_height_that_the_costmaps_keep() -> None:
    found = expected("kobuki")

    assert found.topics == {"scan": "/scan", "odom": "/odom", "cmd_vel": "/mobile_base/commands/velocity"}
    assert (found.params["laser"], found.params["robot"]["radius"]) == ({"z": 0.3}, 0.18)
    assert found.unknown == [
        "who publishes /mobile_base/sensors/bumper_pointcloud (cloud); the simulated robot does not"
    ]


def test_slashes_in_frames_are_left_out() -> None:
    found = expected("slam")

    assert found.topics["scan"] == "/base_scan"
    assert (found.params["base_frame"], found.params["odom_frame"]) == ("base_footprint", "odom")
    assert found.unknown == ["the map: no map_server is started; the room that is built in is used"]


def test_a_robot_in_a_namespace_keeps_its_names() -> None:
    found = expected("in_a_group")

    assert found.topics == {
        "scan": "/robot1/laser/scan_raw",  # that of the filter
        "odom": "/robot1/odom",
        "cmd_vel": "/robot1/cmd_vel",
        "/tf": "/robot1/tf",
        "/tf_static": "/robot1/tf_static",
    }
    frames = ["robot1/odom", "robot1/base_link", "robot1/base_scan"]
    assert [found.params[f"{key}_frame"] for key in ("odom", "base", "scan")] == frames
    assert found.params["robot"]["max_linear"] == pytest.approx(1.2)


def test_everything_that_was_not_found_out_is_named() -> None:
    text = "\n".join(expected("two_lasers").unknown)

    for part in (
        "/robot_description: its command fails",
        "a second scan topic, /b_scan",
        "odom_frame: the nodes name odom_comb, odom; odom_comb is used",
        "the robot's radius",
        "the map: /missing/map.yaml does not exist",
        "/merger (ira_laser_tools/laserscan_multi_merger), /back_laser (urg_node/urg_node)",
        "tf_prefix has no effect",
    ):
        assert part in text


MOVE_BASE = """<node pkg="move_base" type="move_base" name="move_base"/>"""
ODOM = """<node pkg="move_base" type="move_base" name="move_base">
    <param name="global_costmap/global_frame" value="odom"/></node>"""
AMCL = """<node pkg="amcl" type="amcl" name="amcl"/>"""
FIXED = (
    """<node pkg="tf" type="static_transform_publisher" name="fixed" args="0 0 0 0 0 0 /map /odom 100"/>"""
)


@pytest.mark.parametrize(("nodes", "is_missing"), [
    (MOVE_BASE, True), (MOVE_BASE + AMCL, False), (MOVE_BASE + FIXED, False), (ODOM, False)
])  # fmt: skip
def test_the_frame_of_the_map_must_have_a_publisher(nodes: str, is_missing: bool, tmp_path: Path) -> None:
    found = "\n".join(expected_robot(launch(nodes, tmp_path)).unknown)
    assert ("who publishes map to odom" in found) == is_missing


@pytest.mark.parametrize(("planner", "parameters", "drive"), [
    ("teb_local_planner/TebLocalPlannerROS", {"min_turning_radius": 0.8, "max_vel_y": 0.0}, "ackermann"),
    ("mpc_local_planner/Mpc", {"car/wheelbase": 0.8, "car/max_steering_angle": math.pi / 4}, "ackermann"),
    ("dwa_local_planner/DWAPlannerROS", {"max_vel_y": 0.2}, "omni"),
    ("base_local_planner/TrajectoryPlannerROS", {"holonomic_robot": "true"}, "omni"),
    ("base_local_planner/TrajectoryPlannerROS", {"max_vel_x": 0.2}, None),
])  # fmt: skip
def test_the_local_planner_says_how_the_base_drives(
    planner: str, parameters: dict[str, Any], drive: str | None, tmp_path: Path
) -> None:
    below = planner.rpartition("/")[2]
    inside = "".join(f'<param name="{below}/{name}" value="{each}"/>' for name, each in parameters.items())
    node = f"""<node pkg="move_base" type="move_base" name="move_base">
        <param name="base_local_planner" value="{planner}"/>{inside}</node>"""
    robot = expected_robot(launch(node, tmp_path)).params.get("robot", {})
    assert robot.get("drive") == drive
    assert robot.get("min_turning_radius") == (0.8 if drive == "ackermann" else None)


def test_a_multiplexer_of_kobuki_reads_its_inputs_from_a_file(tmp_path: Path) -> None:
    (tmp_path / "mux.yaml").write_text("subscribers: [{topic: input/navi}]\npublisher: output\n")
    mux = f"""
      <node pkg="nodelet" type="nodelet" name="cmd_vel_mux" args="load yocs_cmd_vel_mux/CmdVelMuxNodelet m">
        <param name="yaml_cfg_file" value="{tmp_path / "mux.yaml"}"/>
        <remap from="cmd_vel_mux/output" to="mobile_base/commands/velocity"/>
      </node>
      <node pkg="move_base" type="move_base" name="move_base">
        <remap from="cmd_vel" to="cmd_vel_mux/input/navi"/>
      </node>
      <node pkg="topic_tools" type="relay" name="relay" args="odom_raw odom"/>"""

    found = expected_robot(launch(mux, tmp_path))

    assert found.topics["cmd_vel"] == "/mobile_base/commands/velocity"
    assert "what topic_tools relays from /odom_raw" in found.unknown


def test_invalid_footprints_filters_and_controllers_are_left_out(tmp_path: Path) -> None:
    text = """
      <node pkg="move_base" type="move_base" name="move_base">
        <rosparam>{footprint: "[[1, 2], [3", global_costmap: {footprint: [[1, 2], 3, a]}}</rosparam>
      </node>
      <node pkg="robot_pose_ekf" type="robot_pose_ekf" name="robot_pose_ekf"/>
      <node pkg="amcl" type="amcl" name="amcl" args="'"/>
      <node pkg="controller_manager" type="spawner" name="spawner" args="--stopped arm"/>"""

    found = expected_robot(launch(text, tmp_path))

    assert "robot" not in found.params
    assert found.params["publish_tf"] is False
    assert "controller [/arm] (without a type) is not simulated" in found.unknown
    assert "controllers" not in found.params  # with a manager, nothing would move the base
    assert any("a controller of /spawner that moves the base" in each for each in found.unknown)


@pytest.mark.parametrize("is_published", [True, False])
def test_joints_that_nothing_publishes_are_named(tmp_path: Path, is_published: bool) -> None:
    model = "<robot name='car'><link name='a'/><link name='b'/><joint name='steering' type='continuous'>"
    model += "<parent link='a'/><child link='b'/></joint></robot>"
    names = ["robot_state_publisher", *(["joint_state_publisher"] if is_published else [])]
    text = f"""<param name="robot_description" value="{model.replace("<", "&lt;")}"/>""" + "".join(
        f"""<node pkg="{name}" type="{name}" name="{name}"/>""" for name in names
    )
    unknown = expected_robot(launch(text, tmp_path)).unknown
    assert any("who publishes the joints steering" in each for each in unknown) != is_published


def test_a_wrapper_is_a_launch_file_with_all_parameters(tmp_path: Path) -> None:
    file = tmp_path / "a & b -- c.launch"
    file.write_text('<launch><arg name="x"/><param name="given" value="$(arg x)"/></launch>')
    robot = Expected({"scan": "/front/scan", "odom": "/odom"}, {"map": "/m.yaml", "laser": {"z": 0.3}})
    robot.overrides, robot.unknown = {"/amcl/initial_pose_x": 1.5}, ["much -- and <more>"]

    text = wrapper_text(str(file), {"x": "<1>"}, robot)

    (tmp_path / "w.launch").write_text(text)
    loaded = load([str(tmp_path / "w.launch")])
    assert {
        key: loaded.params[key] for key in ("/given", "/sim/map", "/sim/laser/z", "/amcl/initial_pose_x")
    } == {"/given": "<1>", "/sim/map": "/m.yaml", "/sim/laser/z": 0.3, "/amcl/initial_pose_x": 1.5}
    (node,) = loaded.nodes
    assert node.remappings == (("scan", "/front/scan"),)
    assert re.search("much - - and <more>", text)


# What a node says if the import of one of its libraries fails.


@pytest.mark.parametrize("program", ["costmap.costmap", "navfn.navfn_node", "move_base.move_base_node"])
def test_a_program_without_numpy_says_so_in_one_line(program: str) -> None:
    code = (
        "import sys; sys.modules['numpy'] = sys.modules['cv2'] = None; "
        f"from pipros_robot.navigation.programs import run_program; sys.exit(run_program({program!r}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)

    assert done.returncode == 1
    assert done.stderr.startswith("ERROR: this node needs ")
    assert done.stderr.count("\n") == 1
