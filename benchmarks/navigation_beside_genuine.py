#!/usr/bin/env python3
"""Processor time of pipros's navigation nodes and the genuine ones, for the same messages and requests.

    benchmarks/navigation_beside_genuine.py [localise] [keep_a_costmap] [plan] [follow_a_plan] [build_a_map]
        [filter_odometry]

Both nodes run at the same time, with a pipros master. The time of their processes counts from the first
message to the last, without the start. It needs genuine ROS 1 and the compiled nodes; see tests/interop.
"""

import os
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np

from tests.interop import test_amcl_as_genuine as amcl
from tests.interop import test_gmapping_as_genuine as gmapping
from tests.interop import test_navfn_as_genuine as navfn
from tests.support.both_bases import both_bases
from tests.support.both_costmaps import both_costmaps, grid_message, scan_message
from tests.support.both_filters import both_filters, stamped
from tests.support.both_navigation import both_nodes
from tests.support.drives import ROUTE, drive
from tests.support.environments import make_tool_folder
from tests.support.ports import ClaimedPort
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

FIXED = {"name": "fixed", "type": "costmap_2d::StaticLayer"}
SEEN = {"name": "seen", "type": "costmap_2d::ObstacleLayer"}
AROUND = {"name": "around", "type": "costmap_2d::InflationLayer"}
LASER = {"topic": "/scan", "data_type": "LaserScan", "marking": True, "clearing": True}
TICKS = os.sysconf("SC_CLK_TCK")


def used_s(process):
    """Return the processor time of a process and those that it has started, in seconds."""
    total = 0
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = file.read_text().rpartition(")")[2].split()
        except OSError:  # it has ended
            continue
        if int(fields[3]) == process.pid:  # its session
            total += int(fields[11]) + int(fields[12])
    return total / TICKS


class Meter:
    """The processor time of both sides since the beginning of a context."""

    def __init__(self, processes):
        self._processes = list(processes)

    def __enter__(self):
        self._before = [used_s(each) for each in self._processes]
        return self

    def __exit__(self, *_):
        after = [used_s(each) for each in self._processes]
        self.used_s = [end - start for start, end in zip(self._before, after, strict=True)]


def localise(ros):
    parameters = {**amcl.PARAMETERS, "resample_interval": 1, "min_particles": 1000}
    with both_nodes(ros, "amcl", "amcl", parameters, before=amcl.serve_map, remaps=amcl.REMAPS) as both:
        drives, moments = amcl.Drive(both), list(drive(route=ROUTE[:8]))[::3]
        drives.feed(moments[0])
        with Meter(both._processes) as meter:
            for moment in moments[1:]:
                drives.feed(moment)
    return f"amcl, {len(moments)} scans, 1,000 particles", meter


def build_a_map(ros):
    with both_nodes(ros, "gmapping", "slam_gmapping", gmapping.PARAMETERS, remaps=["scan:=/scan"]) as both:
        with Meter(both._processes) as meter:
            moments = list(drive(start=gmapping.BEGIN, route=ROUTE[:9], noise=0.01))[::7]
            maps = gmapping.drawn(both, moments)
        count = len(maps["pipros"].messages)
    return f"slam_gmapping, {count} processed scans and maps, 15 particles", meter


def keep_a_costmap(ros):
    parameters = {
        "plugins": [FIXED, SEEN, AROUND], "update_frequency": 10.0, "publish_frequency": 2.0,
        "transform_tolerance": 99.0, "robot_radius": 0.17, "fixed": {"map_topic": "/map"},
        "seen": {"observation_sources": "scan", "scan": LASER},
    }  # fmt: skip
    numbers = np.random.default_rng(1)
    with both_costmaps(ros, parameters, (1.0, 1.0, 0.0)) as costmaps:
        costmaps.both.publish("map", grid_message(navfn.building(), 0.05, (0.0, 0.0)))
        costmaps.wait_until_equal()
        with Meter(costmaps.both._processes) as meter:
            for _ in range(100):
                ranges = numbers.uniform(0.3, 4.5, 360)
                costmaps.both.publish("scan", scan_message(ranges, time.time()))
                time.sleep(0.1)
    return "costmap_2d, 240 x 200 cells, 10 s with 10 scans and 10 updates per second", meter


def plan(ros):
    parameters = {"plugins": [FIXED, AROUND], "robot_radius": 0.17, "update_frequency": 1.0}
    numbers = np.random.default_rng(2)
    with both_costmaps(ros, parameters, (1.0, 1.0, 0.0), program=navfn.NODE) as costmaps:
        both = costmaps.both
        both.publish("map", grid_message(navfn.building(), 0.05, (0.0, 0.0)))
        costmaps.wait_until_equal()
        service = "/global_planner/make_plan"
        wait_until(lambda: all(service in both.interface(side)["services"] for side in amcl.SIDES), 60)
        with Meter(both._processes) as meter:
            for _ in range(50):
                (a, b), (c, d) = numbers.uniform((0.3, 0.3), (11.7, 9.7), (2, 2))
                request = {"start": navfn.pose(a, b), "goal": navfn.pose(c, d)}
                both.call("global_planner/make_plan", "navfn/MakeNavPlan", **request)
    return "navfn, 50 plans on 240 x 200 cells", meter


def follow_a_plan(ros):
    with both_bases(ros, {"planner_frequency": 1.0}) as both:
        both.send(2.4, 0.9)
        both.wait_until_active()
        with Meter(both.processes[side] for side in ("pipros", "genuine")) as meter:
            time.sleep(20.0)
    return "move_base with DWA, 20 s, 10 commands and 1 plan per second, two costmaps", meter


def filter_odometry(ros):
    parameters = {"frequency": 30.0, "odom0": "/odom0", "odom0_config": [True] * 12 + [False] * 3}
    with both_filters(ros, "ekf_localization_node", parameters) as both:
        both.feed("/odom0", odometry(0))
        with Meter(both._processes) as meter:
            for index in range(1, 300):
                both.feed("/odom0", odometry(index))
    return "ekf_localization_node, 300 odometry messages at 30 Hz", meter


def odometry(index):
    made = stamped("odom", 1000.0 + index / 30.0, "odom")
    made.child_frame_id, made.pose.pose.position.x = "base_link", 0.01 * index
    made.pose.pose.orientation.w, made.twist.twist.linear.x = 1.0, 0.3
    made.pose.covariance = made.twist.covariance = (np.eye(6) * 0.01).ravel().tolist()
    return made


WORKS = (localise, keep_a_costmap, plan, follow_a_plan, build_a_map, filter_odometry)


@contextmanager
def system():
    """Yield a ROS system with its own port and folder."""
    with tempfile.TemporaryDirectory() as folder:
        port, home = ClaimedPort(), Path(folder) / "home"
        home.mkdir()
        ros = RosSystem(port.number, home, make_tool_folder(Path(folder) / "bin"))
        try:
            yield ros
        finally:
            ros.close()
            port.release()


def main(*names):
    works = [each for each in WORKS if each.__name__ in names]
    print("| node | pipros | genuine (C++) | factor |")
    print("| --- | ---: | ---: | ---: |")
    for work in works or WORKS:
        with system() as ros:
            name, meter = work(ros)
        ours, theirs = meter.used_s
        print(f"| {name} | {ours:.2f} s | {theirs:.2f} s | {ours / max(theirs, 0.01):.1f} |", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
