"""move_base of pipros with recorded inputs, and the recorded answers of the genuine one.

The robot does not move, whatever it commands: it gets what the test publishes.
"""

import math
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.node import Node
from pipros_libraries.nodes.wiring import stamped
from pipros_robot.navigation import plane
from tests.support.both_navigation import BothNodes, end_node
from tests.support.nodes import Inbox
from tests.support.processes import Process
from tests.support.recordings import Recording
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

RESOLUTION, SIZE = 0.05, 120
"""Metres per cell, and cells of a side of the map, whose middle is 0, 0."""
_LAYERS = {
    "robot_base_frame": "base_link", "footprint": "[[0.12, 0.1], [0.12, -0.1], [-0.12, -0.1], [-0.12, 0.1]]",
    "transform_tolerance": 2.0,
    "obstacles": {"observation_sources": "scan",
        "scan": {"topic": "/scan", "data_type": "LaserScan", "marking": True, "clearing": True}},
    "inflation": {"inflation_radius": 0.5, "cost_scaling_factor": 4.0},
}  # fmt: skip
_PLUGINS = [
    {"name": "obstacles", "type": "costmap_2d::ObstacleLayer"},
    {"name": "inflation", "type": "costmap_2d::InflationLayer"},
]
PARAMETERS: Mapping[str, Any] = {
    "base_local_planner": "dwa_local_planner/DWAPlannerROS",
    "base_global_planner": "navfn/NavfnROS",
    "controller_frequency": 10.0,
    "planner_patience": 0.6,
    "controller_patience": 0.6,
    "recovery_behavior_enabled": False,
    "global_costmap": {**_LAYERS, "global_frame": "map", "update_frequency": 5.0,
        "plugins": [{"name": "static", "type": "costmap_2d::StaticLayer"}, *_PLUGINS],
        "static": {"map_topic": "/map"}},
    "local_costmap": {**_LAYERS, "global_frame": "odom", "rolling_window": True, "width": 3, "height": 3,
        "resolution": 0.05, "update_frequency": 10.0, "publish_frequency": 5.0, "plugins": _PLUGINS},
    "DWAPlannerROS": {"max_vel_y": 0.0, "min_vel_y": 0.0, "acc_lim_y": 0.0, "vy_samples": 1, "vx_samples": 8,
        "publish_cost_grid_pc": True, "publish_traj_pc": True},
}  # fmt: skip


def _walls() -> Any:
    """Return the occupied cells: walls around, and a block ahead of the robot, to its left."""
    cells = np.zeros((SIZE, SIZE), bool)
    cells[:2] = cells[-2:] = True
    cells[:, :2] = cells[:, -2:] = True
    cells[66:76, 78:86] = True
    return cells


def _map_message() -> Any:
    message = stamped("nav_msgs/OccupancyGrid", "map", Time())
    message.info.resolution, message.info.width, message.info.height = RESOLUTION, SIZE, SIZE
    message.info.origin.position.x = message.info.origin.position.y = -SIZE * RESOLUTION / 2
    message.info.origin.orientation.w = 1.0
    message.data = np.where(_walls(), 100, 0).ravel().tolist()
    return message


def _seen(stamp: Time) -> Any:
    """Return a scan that sees a post ahead, to the right, and nothing else."""
    step = math.tau / 360
    ranges = [5.0] * 150 + [0.9] * 8 + [5.0] * 202
    return stamped(
        "sensor_msgs/LaserScan", "laser", stamp, angle_min=-math.pi, angle_increment=step,
        angle_max=-math.pi + 359 * step, range_min=0.05, range_max=5.0, ranges=ranges,
    )  # fmt: skip


class BothBases(BothNodes):
    """Both nodes. `velocity` (m/s, rad/s) and `pose` are what odometry reports."""

    def __init__(self, node: Node, process: Process, recording: Recording) -> None:
        super().__init__(node, process, "move_base", recording)
        self.services = "/pipros/move_base/"
        self.pose, self.velocity = (0.0, 0.0, 0.0), (0.2, 0.1)
        self._results: list[tuple[int, str]] = []
        self._goal_class: Any = load_message_class("move_base_msgs/MoveBaseActionGoal")
        self._id_class: Any = load_message_class("actionlib_msgs/GoalID")
        self._goals = self._advertise("move_base/goal", self._goal_class)
        self._cancels = self._advertise("move_base/cancel", self._id_class)
        simple = self._advertise("move_base_simple/goal", load_message_class("geometry_msgs/PoseStamped"))
        self.inputs = (self._goals, self._cancels, simple)
        """The publishers to which the node subscribes when it is ready."""
        result: Any = load_message_class("move_base_msgs/MoveBaseActionResult")
        node.subscribe("/pipros/move_base/result", result, self._on_result)
        self._statuses = self.inboxes("move_base/status", "actionlib_msgs/GoalStatusArray")["pipros"]
        self._publishers |= {
            name: node.advertise(name, load_message_class(kind), queue_size=10)
            for name, kind in (("/tf", "tf2_msgs/TFMessage"), ("/scan", "sensor_msgs/LaserScan"),
                               ("/odom", "nav_msgs/Odometry"))
        }  # fmt: skip
        self.publish("/map", _map_message(), to="", subscribers=0)
        recording.give("publish /scan (20 Hz, at the present time)", _seen(Time(0, 0)))
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._feed, daemon=True)
        self._thread.start()

    def _advertise(self, name: str, kind: Any) -> Any:
        return self.node.advertise(f"/pipros/{name}", kind, queue_size=10)

    def _on_result(self, message: Any) -> None:
        self._results.append((message.status.status, message.status.text))

    def wait_until_active(self) -> None:
        """Wait until the node has accepted its goal."""

        def is_active() -> bool:
            newest = self._statuses.messages[-1:]
            return any(each.status == 1 for message in newest for each in message.status_list)

        wait_until(is_active, 60, "an active goal")

    def stop(self) -> None:
        self._ended.set()
        self._thread.join()

    # -- the robot -----------------------------------------------------------------

    def _feed(self) -> None:
        while not self._ended.wait(0.05):
            stamp = Time(*divmod(time.time_ns(), 1_000_000_000))
            frames = (("map", "odom", (0.0, 0.0, 0.0)), ("odom", "base_link", self.pose),
                      ("base_link", "laser", (0.0, 0.0, 0.0)))  # fmt: skip
            for parent, child, pose in frames:
                transform = plane.transforms(parent, child, plane.raised(pose), stamp)
                self._publishers["/tf"].publish(transform)
            message = stamped("nav_msgs/Odometry", "odom", stamp, child_frame_id="base_link")
            message.twist.twist.linear.x, message.twist.twist.angular.z = self.velocity
            self._publishers["/odom"].publish(message)
            self._publishers["/scan"].publish(_seen(stamp))

    # -- goals and answers ---------------------------------------------------------

    def send(self, x: float, y: float, yaw: float = 0.0, *, quaternion_w: float | None = None) -> None:
        """Send a goal in the frame of the map."""
        goal = self._goal_class()
        goal.goal.target_pose = plane.stamped_pose((x, y, yaw), "map", Time(0, 0))
        if quaternion_w is not None:
            turn = goal.goal.target_pose.pose.orientation
            turn.z, turn.w = 0.0, quaternion_w
        self.recording.give("odometry", [self.pose, self.velocity])
        self._goals.publish(self.recording.give("publish goal", goal))

    def cancel(self) -> None:
        """Cancel all goals."""
        self._cancels.publish(self._id_class())

    def next_results(self, count: int = 1) -> list[list[tuple[int, str]]]:
        """Wait for so many results, and return and forget them: status and text of each, of both nodes."""
        wait_until(lambda: len(self._results) >= count, 60, lambda: f"{count} results: {self.output[-500:]}")
        own, self._results = self._results, []
        return [own, [tuple(each) for each in self.recording.step("results")]]

    def latest(self, topic: str, kind: str) -> Any:
        """Return the next message of a topic of pipros."""
        received = Inbox()
        subscriber = self.node.subscribe(f"/pipros/{topic}", load_message_class(kind), received)
        wait_until(lambda: received.messages, 30, topic)
        subscriber.unregister()
        return received.messages[-1]


@contextmanager
def both_bases(ros: RosSystem, recording: Recording) -> Iterator[BothBases]:
    """Run the node; yield when it accepts goals."""
    ros.serve_master()
    recording.give("parameters", PARAMETERS)
    with Node("test", environment=Environment(master_uri=ros.master_uri)) as node:
        node.params.set("/pipros/move_base", dict(PARAMETERS))
        names = ("__name:=move_base", "__ns:=/pipros", "/pipros/odom:=/odom")
        process = ros.pipros.start("rosrun", "move_base", "move_base", *names)
        both = BothBases(node, process, recording)
        try:
            wait_until(lambda: all(each.connection_count for each in both.inputs), 60, "the node")
            yield both
        finally:
            both.stop()
        end_node(process)
