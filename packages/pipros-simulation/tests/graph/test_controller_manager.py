"""A simulated base behind `controller_manager`: its services, two controllers, and the spawner."""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from pipros.safe import yaml
from tests.support.nodes import Inbox
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

PARAMETERS = """
base:
  type: diff_drive_controller/DiffDriveController
  left_wheel: [front_left, rear_left]
  right_wheel: [front_right, rear_right]
  pose_covariance_diagonal: [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
  cmd_vel_timeout: 0.5
  odom_frame_id: wheels
  linear: {x: {has_velocity_limits: true, max_velocity: 0.3,
               has_acceleration_limits: true, max_acceleration: 0.5}}
other: {type: diff_drive_controller/DiffDriveController, left_wheel: front_left, right_wheel: front_right}
joints: {type: joint_state_controller/JointStateController, publish_rate: 25,
         extra_joints: [{name: lift, position: 0.5}]}
arm: {type: position_controllers/JointTrajectoryController}
blind: {type: joint_state_controller/JointStateController}
one_wheel: {type: diff_drive_controller/DiffDriveController, left_wheel: a}
"""


@pytest.fixture
def node(ros: RosSystem) -> Iterator[Node]:
    ros.serve_master()
    with Node("a_test", environment=Environment(master_uri=ros.master_uri)) as node:
        node.params.set("/bot", yaml.load(PARAMETERS))
        yield node


def start_sim(ros: RosSystem) -> Process:
    sim = ros.pipros.start("rosrun", "pipros_sim", "sim", "_headless:=true", "_controllers:=/bot")
    sim.wait_for("Simulating 1 robot")
    return sim


def call(node: Node, service: str, kind: str, **fields: Any) -> Any:
    service_class: Any = load_service_class(f"controller_manager_msgs/{kind}")
    request = service_class._request_class(**fields)
    return node.client(f"/bot/controller_manager/{service}", service_class).call(request, 60)


def states(node: Node) -> dict[str, str]:
    return {each.name: each.state for each in call(node, "list_controllers", "ListControllers").controller}


def load(node: Node, *names: str) -> list[bool]:
    return [call(node, "load_controller", "LoadController", name=name).ok for name in names]


def switch(node: Node, start: tuple[str, ...] = (), stop: tuple[str, ...] = (), strictness: int = 2) -> bool:
    fields = {"start_controllers": start, "stop_controllers": stop, "strictness": strictness}
    return bool(call(node, "switch_controller", "SwitchController", **fields).ok)


def test_a_spawner_starts_controllers_and_stops_them_at_its_end(ros: RosSystem, node: Node) -> None:
    sim = start_sim(ros)
    spawner = ros.pipros.start(
        "rosrun", "controller_manager", "spawner", "--namespace", "/bot", "base", "arm", "joints"
    )
    spawner.wait_for("start base, joints: done")
    assert states(node) == {"base": "running", "joints": "running"}
    assert sim.wait_for("position_controllers/JointTrajectoryController is not simulated")
    listed = ros.pipros.run(
        "rosrun", "controller_manager", "controller_manager", "list", "__ns:=/bot", ROS_NAMESPACE="/bot"
    )
    assert "'base' - 'hardware_interface::VelocityJointInterface' ( running )" in listed.output

    spawner.press_ctrl_c()

    assert (spawner.wait(), states(node)) == (0, {})
    assert "Traceback" not in spawner.output


def test_a_diff_drive_controller_drives_within_its_limits(ros: RosSystem, node: Node) -> None:
    start_sim(ros)
    assert ros.subscribers("/cmd_vel") == ros.publishers("/odom") == []
    assert load(node, "base", "joints") == [True, True]
    assert switch(node, ("base", "joints"))
    odometry, joints, moving = Inbox(), Inbox(), Inbox()
    node.subscribe("/bot/base/odom", load_message_class("nav_msgs/Odometry"), odometry)
    node.subscribe("/bot/joint_states", load_message_class("sensor_msgs/JointState"), joints)
    node.subscribe("/tf", load_message_class("tf2_msgs/TFMessage"), moving)
    odometry.wait()
    twist: Any = load_message_class("geometry_msgs/Twist")()
    twist.linear.x = 5.0

    node.advertise("/bot/base/cmd_vel", type(twist), latch=True).publish(twist)  # for half a second

    wait_until(lambda: any(each.twist.twist.linear.x > 0.2 for each in list(odometry.messages)))
    wait_until(lambda: odometry.messages[-1].twist.twist.linear.x == 0.0)
    speeds = [each.twist.twist.linear.x for each in odometry.messages]
    steps = [after - before for before, after in itertools.pairwise(speeds)]
    assert max(speeds) <= 0.3 + 1e-9
    assert 0 < max(steps) <= 0.5 * 0.02 * 3  # one message may be lost on a busy machine
    first = odometry.messages[0]
    assert (first.header.frame_id, first.child_frame_id) == ("wheels", "base_link")
    assert list(first.pose.covariance[::7]) == [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
    names = ["front_left", "rear_left", "front_right", "rear_right", "lift"]
    wait_until(lambda: joints.messages and joints.messages[-1].position[0] > 0)
    assert (joints.messages[-1].name, joints.messages[-1].position[4]) == (names, 0.5)
    (transform,) = moving.wait()[0].transforms
    assert (transform.header.frame_id, transform.child_frame_id) == ("wheels", "base_link")


def test_a_robot_whose_controller_is_stopped_stops_at_once(ros: RosSystem, node: Node) -> None:
    start_sim(ros)
    assert load(node, "base") == [True]
    assert switch(node, ("base",))
    truth = Inbox()
    node.subscribe("/base_pose_ground_truth", load_message_class("nav_msgs/Odometry"), truth)
    twist: Any = load_message_class("geometry_msgs/Twist")()
    twist.angular.z = 1.0
    node.advertise("/bot/base/cmd_vel", type(twist), latch=True).publish(twist)
    wait_until(lambda: truth.messages and truth.messages[-1].twist.twist.angular.z == 1.0)

    assert switch(node, stop=("base",))

    stopped_s = time.time()
    wait_until(lambda: truth.messages[-1].header.stamp.to_sec() > stopped_s + 0.2)
    later = [each for each in truth.messages if each.header.stamp.to_sec() > stopped_s + 0.02]
    assert all(each.twist.twist.angular.z == 0.0 for each in later)


def test_controllers_that_cannot_be_loaded_are_named(ros: RosSystem, node: Node) -> None:
    sim = start_sim(ros)

    assert load(node, "arm", "blind", "one_wheel", "nothing", "joints", "joints") == [False] * 4 + [
        True,
        False,
    ]
    for text in (
        r"\[/bot/blind\]: publish_rate must be set",
        r"\[/bot/one_wheel\]: left_wheel and right_wheel must be names of joints",
        r"\[/bot/nothing\]: the parameter /bot/nothing/type is not set",
        r"\[/bot/joints\]: it is already loaded",
    ):
        sim.wait_for(text)
    assert states(node) == {"joints": "initialized"}
    assert len(call(node, "list_controller_types", "ListControllerTypes").types) == 2


def test_a_strict_switch_changes_all_or_nothing(ros: RosSystem, node: Node) -> None:
    start_sim(ros)
    assert load(node, "base", "other", "joints") == [True] * 3

    assert not switch(node, ("joints", "nothing"))
    assert states(node)["joints"] == "initialized"
    assert switch(node, ("joints", "nothing"), strictness=1)
    assert states(node)["joints"] == "running"
    assert not switch(node, ("base", "other"))  # both use the front wheels
    assert switch(node, ("base",))
    assert not switch(node, ("other",))
    assert switch(node, ("other",), ("base",))
    assert states(node) == {"base": "stopped", "other": "running", "joints": "running"}
    assert not call(node, "unload_controller", "UnloadController", name="other").ok
    assert call(node, "unload_controller", "UnloadController", name="base").ok
    assert not call(node, "unload_controller", "UnloadController", name="base").ok
    assert not call(node, "reload_controller_libraries", "ReloadControllerLibraries", force_kill=False).ok
    assert call(node, "reload_controller_libraries", "ReloadControllerLibraries", force_kill=True).ok
    assert states(node) == {}


def test_a_spawner_without_a_manager_gives_up(ros: RosSystem, node: Node) -> None:
    ended = ros.pipros.run("rosrun", "controller_manager", "spawner", "--timeout", "1", "base", timeout_s=60)

    assert ended.returncode == 1
    assert "no controller manager answered within 1 s" in ended.output


def test_a_topic_starts_and_stops_controllers(ros: RosSystem, node: Node) -> None:
    start_sim(ros)
    spawner = ros.pipros.start(
        *("rosrun", "controller_manager", "spawner", "--namespace", "/bot", "--wait-for", "/ready", "joints")
    )
    boolean: Any = load_message_class("std_msgs/Bool")
    ready = node.advertise("/ready", boolean, latch=True)
    ready.publish(boolean(True))
    spawner.wait_for("start joints: done")
    ready.publish(boolean(False))
    spawner.wait_for("stop joints: done")
    assert states(node) == {"joints": "stopped"}
    for command, expected in (("start", "running"), ("stop", "stopped")):
        words = "rosrun", "controller_manager", "controller_manager", command, "joints"
        assert ros.pipros.run(*words, ROS_NAMESPACE="/bot").returncode == 0
        assert states(node) == {"joints": expected}
    assert ros.pipros.run(*words[:3], "start", "nothing", ROS_NAMESPACE="/bot").returncode == 1


def test_odd_names_and_rates_are_refused_in_one_line(ros: RosSystem, node: Node) -> None:
    sim = start_sim(ros)
    node.params.set("/bot/joints/publish_rate", 1e-320)
    assert (load(node, "joints"), load(node, "\x1b]0;OWNED\x07\nforged")) == ([True], [False])
    sim.wait_for(r"controller \[/bot/\\x1b\]0;OWNED\\x07\\nforged\]: this is not a name")
    assert "\x1b]0" not in sim.output
