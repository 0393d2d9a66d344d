"""move_base of pipros and the genuine one, in namespaces, with the same map, transforms, scans and odometry.

The robot does not move, whatever they command: each gets what the test publishes.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from pipros.basics.env import Environment
from pipros.msg import load_message_class, load_service_class
from pipros.msg.time import Time
from pipros.navigation import plane
from pipros.node import Node
from tests.support.navigation_oracle import add_to
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

SIDES = ("pipros", "genuine")
RESOLUTION, SIZE = 0.05, 120
"""Metres per cell, and cells of a side of the map, whose middle is 0, 0."""
_LAYERS = {
    "robot_base_frame": "base_link",
    "footprint": "[[0.12, 0.1], [0.12, -0.1], [-0.12, -0.1], [-0.12, 0.1]]",
    "transform_tolerance": 2.0,
    "obstacles": {
        "observation_sources": "scan",
        "scan": {"topic": "/scan", "data_type": "LaserScan", "marking": True, "clearing": True},
    },
    "inflation": {"inflation_radius": 0.5, "cost_scaling_factor": 4.0},
}
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
    "global_costmap": {
        **_LAYERS,
        "global_frame": "map",
        "update_frequency": 5.0,
        "plugins": [{"name": "static", "type": "costmap_2d::StaticLayer"}, *_PLUGINS],
        "static": {"map_topic": "/map"},
    },
    "local_costmap": {
        **_LAYERS,
        "global_frame": "odom",
        "rolling_window": True,
        "width": 3,
        "height": 3,
        "resolution": 0.05,
        "update_frequency": 10.0,
        "publish_frequency": 5.0,
        "plugins": _PLUGINS,
    },
    "DWAPlannerROS": {
        "max_vel_y": 0.0,
        "min_vel_y": 0.0,
        "acc_lim_y": 0.0,
        "vy_samples": 1,
        "vx_samples": 8,
        "publish_cost_grid_pc": True,
        "publish_traj_pc": True,
    },
}


def _walls() -> Any:
    """Return the occupied cells: walls around, and a block ahead of the robot, to its left."""
    cells = np.zeros((SIZE, SIZE), bool)
    cells[:2] = cells[-2:] = True
    cells[:, :2] = cells[:, -2:] = True
    cells[66:76, 78:86] = True
    return cells


class BothBases:
    """Both nodes, and what they publish. `velocity` (m/s, rad/s) and `pose` are what odometry reports."""

    def __init__(self, node: Node, processes: Mapping[str, Process]) -> None:
        self.node, self.processes = node, processes
        self.pose, self.velocity = (0.0, 0.0, 0.0), (0.2, 0.1)
        self.results: dict[str, list[tuple[int, str]]] = {side: [] for side in SIDES}
        self.newest: dict[tuple[str, str], Any] = {}
        self._goal_class: Any = load_message_class("move_base_msgs/MoveBaseActionGoal")
        self._id_class: Any = load_message_class("actionlib_msgs/GoalID")
        self._goals = {side: self._advertise(side, "goal", self._goal_class) for side in SIDES}
        self._cancels = {side: self._advertise(side, "cancel", self._id_class) for side in SIDES}
        stamped: Any = load_message_class("geometry_msgs/PoseStamped")
        self._simple = {
            side: node.advertise(f"/{side}/move_base_simple/goal", stamped, queue_size=1) for side in SIDES
        }
        result: Any = load_message_class("move_base_msgs/MoveBaseActionResult")
        status: Any = load_message_class("actionlib_msgs/GoalStatusArray")
        self._statuses: dict[str, Any] = {}
        for side in SIDES:
            self.node.subscribe(f"/{side}/move_base/result", result, self._keeper(side))
            self.node.subscribe(f"/{side}/move_base/status", status, self._status_keeper(side))
        self._scan: Any = load_message_class("sensor_msgs/LaserScan")
        self._publishers = {
            name: node.advertise(name, load_message_class(kind), queue_size=10)
            for name, kind in (("/tf", "tf2_msgs/TFMessage"), ("/scan", "sensor_msgs/LaserScan"),
                               ("/odom", "nav_msgs/Odometry"))
        }  # fmt: skip
        self._map = node.advertise("/map", load_message_class("nav_msgs/OccupancyGrid"), latch=True)
        self._publish_map()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._feed, daemon=True)
        self._thread.start()

    def _advertise(self, side: str, name: str, kind: Any) -> Any:
        return self.node.advertise(f"/{side}/move_base/{name}", kind, queue_size=10)

    @property
    def inputs(self) -> list[Any]:
        """The publishers to which both nodes subscribe when they are ready."""
        return [*self._goals.values(), *self._cancels.values(), *self._simple.values()]

    def _keeper(self, side: str) -> Any:
        return lambda message: self.results[side].append((message.status.status, message.status.text))

    def _status_keeper(self, side: str) -> Any:
        return lambda message: self._statuses.update({side: message.status_list})

    def wait_until_active(self) -> None:
        """Wait until both have accepted their goal."""
        wait_until(
            lambda: all(any(each.status == 1 for each in self._statuses.get(side, ())) for side in SIDES),
            60,
            "active goals",
        )

    def stop(self) -> None:
        self._ended.set()
        self._thread.join()

    # -- the robot -----------------------------------------------------------------

    def _publish_map(self) -> None:
        message: Any = load_message_class("nav_msgs/OccupancyGrid")()
        message.header.frame_id = "map"
        message.info.resolution, message.info.width, message.info.height = RESOLUTION, SIZE, SIZE
        message.info.origin.position.x = message.info.origin.position.y = -SIZE * RESOLUTION / 2
        message.info.origin.orientation.w = 1.0
        message.data = np.where(_walls(), 100, 0).ravel().tolist()
        self._map.publish(message)

    def _feed(self) -> None:
        transform: Any = load_message_class("geometry_msgs/TransformStamped")
        tf_class: Any = load_message_class("tf2_msgs/TFMessage")
        odometry: Any = load_message_class("nav_msgs/Odometry")
        while not self._ended.wait(0.05):
            stamp = Time(*divmod(time.time_ns(), 1_000_000_000))
            transforms = []
            frames = (("map", "odom", (0.0, 0.0, 0.0)), ("odom", "base_link", self.pose),
                      ("base_link", "laser", (0.0, 0.0, 0.0)))  # fmt: skip
            for parent, child, (x, y, yaw) in frames:
                made = transform(child_frame_id=child)
                made.header.frame_id, made.header.stamp = parent, stamp
                made.transform.translation.x, made.transform.translation.y = x, y
                turn = made.transform.rotation
                turn.z, turn.w = math.sin(yaw / 2), math.cos(yaw / 2)
                transforms.append(made)
            self._publishers["/tf"].publish(tf_class(transforms))
            message = odometry()
            message.header.frame_id, message.header.stamp, message.child_frame_id = "odom", stamp, "base_link"
            message.twist.twist.linear.x, message.twist.twist.angular.z = self.velocity
            self._publishers["/odom"].publish(message)
            self._publishers["/scan"].publish(self._seen(stamp))

    def _seen(self, stamp: Any) -> Any:
        """Return a scan that sees a post ahead, to the right, and nothing else."""
        scan = self._scan()
        scan.header.frame_id, scan.header.stamp = "laser", stamp
        scan.angle_min, scan.angle_increment = -math.pi, math.tau / 360
        scan.angle_max = scan.angle_min + 359 * scan.angle_increment
        scan.range_min, scan.range_max = 0.05, 5.0
        scan.ranges = [5.0] * 360
        scan.ranges[150:158] = [0.9] * 8
        return scan

    # -- goals and answers ---------------------------------------------------------

    def send(self, x: float, y: float, yaw: float = 0.0, *, quaternion_w: float | None = None) -> None:
        """Send a goal in the frame of the map to both."""
        goal = self._goal_class()
        goal.goal.target_pose = plane.stamped_pose((x, y, yaw), "map", Time(0, 0))
        if quaternion_w is not None:
            turn = goal.goal.target_pose.pose.orientation
            turn.z, turn.w = 0.0, quaternion_w
        for publisher in self._goals.values():
            publisher.publish(goal)

    def cancel(self) -> None:
        """Cancel all goals of both."""
        for publisher in self._cancels.values():
            publisher.publish(self._id_class())

    def next_results(self, count: int = 1) -> dict[str, list[tuple[int, str]]]:
        """Wait for so many results of both, and return and forget them: status and text of each."""
        wait_until(
            lambda: all(len(found) >= count for found in self.results.values()),
            60,
            f"{count} results: {self.results} {[each.output[-5:] for each in self.processes.values()]}",
        )
        found = {side: list(results) for side, results in self.results.items()}
        for results in self.results.values():
            results.clear()
        return found

    def latest(self, side: str, topic: str, kind: str) -> Any:
        """Return the next message of a topic below `/SIDE/`."""
        received: list[Any] = []
        subscriber = self.node.subscribe(f"/{side}/{topic}", load_message_class(kind), received.append)
        wait_until(lambda: received, 30, f"{topic} of {side}")
        subscriber.unregister()
        return received[-1]

    def call(self, side: str, service: str, kind: str, *values: Any) -> Any:
        """Call a service of a node's private namespace."""
        service_class: Any = load_service_class(kind)
        client = self.node.client(f"/{side}/move_base/{service}", service_class)
        return client.call(service_class._request_class(*values), 30)


@contextmanager
def both_bases(ros: RosSystem, changes: Mapping[str, Any] | None = None) -> Iterator[BothBases]:
    """Run both nodes; yield when both accept goals."""
    ros.serve_master()
    folder = add_to(ros.genuine)
    with Node("test", environment=Environment(master_uri=ros.master_uri)) as node:
        for side in SIDES:
            node.params.set(f"/{side}/move_base", {**PARAMETERS, **(changes or {})})
        commands: dict[str, list[str | Path]] = {
            "pipros": ["rosrun", "move_base", "move_base"],
            "genuine": [folder / "lib/move_base/move_base"],
        }
        processes = {
            side: getattr(ros, side).start(
                *commands[side], "__name:=move_base", f"__ns:=/{side}", f"/{side}/odom:=/odom"
            )
            for side in SIDES
        }
        both = BothBases(node, processes)
        try:
            wait_until(
                lambda: all(each.connection_count for each in both.inputs),
                60,
                "both nodes",
            )
            yield both
        finally:
            both.stop()
        for process in processes.values():
            process.press_ctrl_c()
            process.wait()
