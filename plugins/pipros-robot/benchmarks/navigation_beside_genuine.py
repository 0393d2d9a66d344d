#!/usr/bin/env python3
"""Processor time of pipros's navigation nodes, beside recorded times of the genuine ones for the same work.

    script/bench navigation_beside_genuine [localise] [keep_a_costmap] [plan] [follow_a_plan] [build_a_map]
        [filter_odometry]

The time of the node's processes counts from the first message to the last, without the start. The other
columns are history: on 2026-11-26, the nodes of pipros and the genuine ones (C++) ran at the same time, on
another machine (benchmarks/recorded). On this machine, only their ratio means something.
"""

import gzip
import json
import math
import sys
import time
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import psutil
from programs import QUIET, Programs

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class, load_service_class
from pipros.msg.time import Time
from pipros_simulation.robots.drive import Pose
from tests.golden.navigation.test_navfn_as_genuine import building, pose
from tests.support.drives import ROUTE, START, drive, map_message, scan_message, stamp, transform_message
from tests.support.nodes import Inbox
from tests.support.waiting import wait_until

RECORDED = Path(__file__).parent / "recorded" / "navigation_beside_genuine.json.gz"
LASER = {"topic": "/scan", "data_type": "LaserScan", "marking": True, "clearing": True}
STATIC = {"name": "static", "type": "costmap_2d::StaticLayer"}
OBSTACLES = {"name": "obstacles", "type": "costmap_2d::ObstacleLayer"}
INFLATION = {"name": "inflation", "type": "costmap_2d::InflationLayer"}


class Bench(Programs):
    """A master, a node of pipros with the name `tested`, and a node that feeds it."""

    def __init__(self):
        super().__init__()
        self.node = super().node()
        self._publishers = {}
        self._subscribed = set()

    def start_tested(self, package, program, parameters):
        self.node.params.set("/tested", parameters)
        self._process = self.start("rosrun", package, program, "__name:=tested", **QUIET)

    def publish(self, topic, message, *, waits=True):
        """Publish a message, as soon as the node has subscribed to the topic if `waits`."""
        if topic not in self._publishers:
            is_latched = topic in ("/tf_static", "/map")
            made = self.node.advertise(topic, type(message), queue_size=100, latch=is_latched)
            self._publishers[topic] = made
            is_own = topic in self._subscribed
            if waits:
                self.wait(lambda: made.connection_count > is_own, f"the subscription to {topic}")
        self._publishers[topic].publish(message)

    def subscribe(self, topic, kind):
        inbox = Inbox()
        self._subscribed.add(topic)
        self.node.subscribe(topic, load_message_class(kind), inbox)
        return inbox

    def wait(self, condition, what):
        wait_until(condition, 60, what)

    @contextmanager
    def measured(self):
        """Measure the processor time of the node during a context."""
        before = self._used_s()
        yield
        self.used_s = self._used_s() - before

    def _used_s(self):
        root = psutil.Process(self._process.pid)
        return sum(sum(each.cpu_times()[:2]) for each in (root, *root.children(recursive=True)))


def localise(bench):
    service = load_service_class("nav_msgs/GetMap")
    bench.node.serve("/static_map", service, lambda _: service._response_class(map_message()))
    parameters = {
        "initial_pose_x": START.x, "initial_pose_y": START.y, "initial_pose_a": START.yaw,
        "initial_cov_xx": 0.04, "initial_cov_yy": 0.04, "initial_cov_aa": 0.02, "min_particles": 1000,
        "max_particles": 1000, "laser_max_beams": 60, "save_pose_rate": -1.0, "update_min_d": 0.15,
        "resample_interval": 1,
    }  # fmt: skip
    bench.start_tested("amcl", "amcl", parameters)
    transforms = bench.subscribe("/tf", "tf2_msgs/TFMessage")
    bench.subscribe("/amcl_pose", "geometry_msgs/PoseWithCovarianceStamped")
    bench.publish("/tf_static", transform_message("base_link", "laser", Pose(0.1, 0.05, 0.0), 0.0))

    def feed(moment):
        wanted = stamp(moment.time_s + 0.1)
        bench.publish("/tf", transform_message("odom", "base_link", moment.odometry, moment.time_s))
        bench.publish("/scan", scan_message(moment))
        bench.wait(
            lambda: any(
                each.header.frame_id == "map" and each.header.stamp >= wanted
                for message in transforms.messages[-10:]
                for each in message.transforms
            ),
            "the pose",
        )

    moments = list(drive(route=ROUTE[:8]))[::3]
    feed(moments[0])
    with bench.measured():
        for moment in moments[1:]:
            feed(moment)


def build_a_map(bench):
    parameters = {
        "xmin": -8.0, "ymin": -8.0, "xmax": 12.0, "ymax": 12.0, "linearUpdate": 0.0, "angularUpdate": 0.0,
        "map_update_interval": 0.0, "particles": 15, "srr": 0.05, "srt": 0.05, "str": 0.05, "stt": 0.05,
        "seed": 1,
    }  # fmt: skip
    moments = list(drive(start=Pose(2.9, 1.0, 0.0), route=ROUTE[:9], noise=0.01))[::7]
    bench.start_tested("gmapping", "slam_gmapping", parameters)
    maps = bench.subscribe("/map", "nav_msgs/OccupancyGrid")
    bench.publish("/tf_static", transform_message("base_link", "laser", Pose(), 0.0))
    with bench.measured():
        for count, moment in enumerate(moments, 1):
            bench.publish("/tf", transform_message("odom", "base_link", moment.odometry, moment.time_s))
            bench.publish("/scan", scan_message(moment))
            bench.wait(lambda: len(maps.messages) >= count, "a map")  # noqa: B023


def place(bench, x, y):
    """Put the robot at a position in the map."""
    bench.publish("/tf_static", transform_message("map", "base_link", Pose(x, y, 0.0), -1000.0))


def grid_message(cells, origin=0.0):
    message = map_message(cells > 0)
    message.info.origin.position.x = message.info.origin.position.y = origin
    message.data = cells.ravel().tolist()
    return message


def round_scan(ranges, stamp_s, frame="base_link", range_max=10.0):
    """Return a scan all around."""
    scan = load_message_class("sensor_msgs/LaserScan")(
        range_min=0.1, range_max=range_max, ranges=list(ranges)
    )
    scan.header.frame_id, scan.header.stamp = frame, ros_time(stamp_s)
    scan.angle_min, scan.angle_increment, scan.angle_max = -math.pi, math.tau / len(scan.ranges), math.pi
    return scan


def ros_time(time_s):
    return Time(*divmod(round(time_s * 1e9), 1_000_000_000))


def keep_a_costmap(bench):
    costmap = {
        "plugins": [STATIC, OBSTACLES, INFLATION], "update_frequency": 10.0, "publish_frequency": 2.0,
        "transform_tolerance": 99.0, "robot_radius": 0.17, "static": {"map_topic": "/map"},
        "obstacles": {"observation_sources": "scan", "scan": LASER},
    }  # fmt: skip
    bench.start_tested("costmap_2d", "costmap_2d_node", {"costmap": costmap})
    maps = bench.subscribe("/tested/costmap/costmap", "nav_msgs/OccupancyGrid")
    bench.subscribe("/tested/costmap/costmap_updates", "map_msgs/OccupancyGridUpdate")
    bench.subscribe("/tested/costmap/footprint", "geometry_msgs/PolygonStamped")
    place(bench, 1.0, 1.0)
    bench.publish("/map", grid_message(building()))
    bench.wait(lambda: maps.messages, "the costmap")
    numbers = np.random.default_rng(1)
    with bench.measured():
        for _ in range(100):
            bench.publish("/scan", round_scan(numbers.uniform(0.3, 4.5, 360), time.time()))
            time.sleep(0.1)


def plan(bench):
    costmap = {
        "plugins": [STATIC, INFLATION], "robot_radius": 0.17, "update_frequency": 1.0,
        "static": {"map_topic": "/map"},
    }  # fmt: skip
    bench.start_tested("navfn", "navfn_node", {"costmap": costmap})
    place(bench, 1.0, 1.0)
    bench.publish("/map", grid_message(building()))
    service = load_service_class("navfn/MakeNavPlan")
    client = bench.node.client("/tested/make_plan", service)

    def has_plan(start, goal):
        request = service._request_class(start=pose(*start), goal=pose(*goal))
        with suppress(PiprosError):  # the service is not ready
            return client.call(request, timeout_s=60.0).plan_found

    bench.wait(lambda: has_plan((1.0, 1.0), (1.5, 1.5)), "a plan")
    numbers = np.random.default_rng(2)
    with bench.measured():
        for _ in range(50):
            has_plan(*numbers.uniform((0.3, 0.3), (11.7, 9.7), (2, 2)))


def follow_a_plan(bench):
    layers = {
        "robot_base_frame": "base_link",
        "footprint": "[[0.12, 0.1], [0.12, -0.1], [-0.12, -0.1], [-0.12, 0.1]]",
        "transform_tolerance": 2.0, "obstacles": {"observation_sources": "scan", "scan": LASER},
        "inflation": {"inflation_radius": 0.5, "cost_scaling_factor": 4.0},
    }  # fmt: skip
    parameters = {
        "base_local_planner": "dwa_local_planner/DWAPlannerROS", "base_global_planner": "navfn/NavfnROS",
        "controller_frequency": 10.0, "planner_frequency": 1.0, "planner_patience": 0.6,
        "controller_patience": 0.6, "recovery_behavior_enabled": False,
        "global_costmap": layers | {
            "global_frame": "map", "update_frequency": 5.0, "plugins": [STATIC, OBSTACLES, INFLATION],
            "static": {"map_topic": "/map"},
        },
        "local_costmap": layers | {
            "global_frame": "odom", "rolling_window": True, "width": 3, "height": 3, "resolution": 0.05,
            "update_frequency": 10.0, "publish_frequency": 5.0, "plugins": [OBSTACLES, INFLATION],
        },
        "DWAPlannerROS": {
            "max_vel_y": 0.0, "min_vel_y": 0.0, "acc_lim_y": 0.0, "vy_samples": 1, "vx_samples": 8,
            "publish_cost_grid_pc": True, "publish_traj_pc": True,
        },
    }  # fmt: skip
    bench.start_tested("move_base", "move_base", parameters)
    cells = np.zeros((120, 120), np.int8)
    cells[:2] = cells[-2:] = cells[:, :2] = cells[:, -2:] = cells[66:76, 78:86] = 100
    commands = bench.subscribe("/cmd_vel", "geometry_msgs/Twist")
    frames = [transform_message(*each, Pose(), 0.0).transforms[0]
              for each in (("map", "odom"), ("odom", "base_link"), ("base_link", "laser"))]  # fmt: skip
    odometry = load_message_class("nav_msgs/Odometry")(child_frame_id="base_link")
    odometry.header.frame_id = "odom"
    odometry.twist.twist.linear.x, odometry.twist.twist.angular.z = 0.2, 0.1
    ranges = [5.0] * 360
    ranges[150:158] = [0.9] * 8  # a post

    def feed():
        now = time.time()
        for each in (*frames, odometry):
            each.header.stamp = ros_time(now)
        bench.publish("/tf", load_message_class("tf2_msgs/TFMessage")(frames), waits=False)
        bench.publish("/odom", odometry, waits=False)
        bench.publish("/scan", round_scan(ranges, now, "laser", 5.0), waits=False)
        time.sleep(0.05)

    bench.publish("/map", grid_message(cells, -3.0), waits=False)
    goals = bench.node.advertise("/move_base_simple/goal", load_message_class("geometry_msgs/PoseStamped"))
    bench.wait(lambda: feed() or goals.connection_count, "the subscription to the goal")
    goals.publish(pose(2.4, 0.9))
    bench.wait(lambda: feed() or commands.messages, "a command")
    with bench.measured():
        end_s = time.monotonic() + 20.0
        while time.monotonic() < end_s:
            feed()


def filter_odometry(bench):
    parameters = {
        "frequency": 30.0, "sensor_timeout": 1e12, "odom0": "/odom0",
        "odom0_config": [True] * 12 + [False] * 3,
    }  # fmt: skip
    bench.start_tested("robot_localization", "ekf_localization_node", parameters)
    estimates = bench.subscribe("/odometry/filtered", "nav_msgs/Odometry")
    made = load_message_class("nav_msgs/Odometry")(child_frame_id="base_link")
    made.header.frame_id, made.pose.pose.orientation.w, made.twist.twist.linear.x = "odom", 1.0, 0.3
    made.pose.covariance = made.twist.covariance = (np.eye(6) * 0.01).ravel().tolist()

    def feed(index):
        made.header.stamp, made.pose.pose.position.x = ros_time(1000.0 + index / 30.0), 0.01 * index
        bench.publish("/odom0", made)
        wanted = ros_time(1000.0 + index / 30.0 - 1e-5)
        bench.wait(lambda: any(e.header.stamp >= wanted for e in estimates.messages[-3:]), "an estimate")

    feed(0)
    with bench.measured():
        for index in range(1, 300):
            feed(index)


WORKS = (localise, keep_a_costmap, plan, follow_a_plan, build_a_map, filter_odometry)


def main(*names):
    rows = json.loads(gzip.decompress(RECORDED.read_bytes()))["rows"]
    print("| node | pipros now | pipros 2026-11-26 | genuine (C++) 2026-11-26 | factor 2026-11-26 |")
    print("| --- | ---: | ---: | ---: | ---: |")
    for work in [each for each in WORKS if each.__name__ in names] or WORKS:
        with Bench() as bench:
            work(bench)
        row = rows[work.__name__]
        ours, theirs = row["pipros_s"], row["genuine_s"]
        times = f"{bench.used_s:.2f} s | {ours:.2f} s | {theirs:.2f} s"
        print(f"| {row['work']} | {times} | {ours / theirs:.1f} |", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
