#!/usr/bin/env python3
"""Processor time of nodes for images, clouds and lidars: pipros's and Debian's genuine ones, in one run.

    script/bench perception [--only rectify,cloud,chain,voxels,lidar] [--seconds 10]

A row is one node, or a chain of nodes in one manager or in one process each. The benchmark publishes the
inputs at a fixed rate, subscribes to the last output, and reads the processor time of the nodes' processes.
The relays pass on the messages that they receive. The lidar is simulated on a pseudo-terminal, with 8,000
samples in 10 turns per second; there is no genuine driver. `lost` is the number of inputs without an output.
A row says little if the foreign load, the share of the machine that other processes used, is high.
"""

import contextlib
import os
import time
import xmlrpc.client
from pathlib import Path

import numpy as np
import psutil
from programs import QUIET, Programs, cpu_s
from table import options_of

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class, load_service_class
from pipros_robot.perception.clouds.points import cloud_of
from tests.support.pictures_of_cameras import camera_info, depths, image, picture
from tests.support.simulated_rplidar import MODES, SimulatedRplidar
from tests.support.waiting import wait_until

COMMANDS = {"pipros": ("rosrun", "nodelet", "nodelet"), "genuine": ("/usr/lib/nodelet/nodelet",)}
WARM_UP_S = 1.5
DRAIN_S = 1.0
RELAY = """
import copy
from pipros.msg import load_message_class

class Relay:
    def __init__(self, node):
        kind = load_message_class("{}")
        output = node.advertise("out", kind, queue_size=10)
        node.subscribe("in", kind, lambda m: output.publish(copy.copy(m)), queue_size=10, zero_copy=True)
"""


class Bench(Programs):
    """A master, a node that publishes inputs and receives outputs, and the processes that are measured."""

    def __init__(self, seconds):
        super().__init__()
        self.seconds = seconds
        self.environment["PYTHONPATH"] = os.path.join(self.folder, "site")
        self.node = super().node()

    def start_nodelets(self, side, nodelets, *, shares_process):
        """Start nodelets, `{name: (plugin, remappings)}`, in one process or in several. Return their IDs."""
        variables = {}
        if side == "genuine":
            prefix = Path(self.folder, "prefix")  # the plugins of Debian's pcl_ros name the folder `lib`
            prefix.mkdir(exist_ok=True)
            if not (prefix / "lib").exists():
                (prefix / "lib").symlink_to("/usr/lib/x86_64-linux-gnu")
            variables = {"ROS_PACKAGE_PATH": "/usr/share", "CMAKE_PREFIX_PATH": f"{prefix}:/usr"}
        if not shares_process or len(nodelets) == 1:
            for each, (plugin, moved) in nodelets.items():
                words = ["standalone", plugin, f"__name:={each}", *(f"{a}:={b}" for a, b in moved.items())]
                self.start(*COMMANDS[side], *words, variables=variables, **QUIET)
            return [self.pid_of(f"/{each}") for each in nodelets]
        self.start(*COMMANDS[side], "manager", "__name:=manager", variables=variables, **QUIET)
        pids = [self.pid_of("/manager")]
        load = load_service_class("nodelet/NodeletLoad")
        client = self.node.client("/manager/load_nodelet", load)
        client.wait_until_available(60, pause=time.sleep, report=print)
        for each, (plugin, moved) in nodelets.items():
            client.call(load._request_class(f"/{each}", plugin, [*moved], [*moved.values()], [], ""))
        return pids

    def row(self, name, side, pids, inputs, output, rate_hz):
        """Measure processes, print a row, and return the processor time per output.

        Args:
            inputs: function that returns the messages, by topic, for a number.
            output: the last topic, and its type.
        """
        received = []
        self.node.subscribe(
            output[0], load_message_class(output[1]), lambda _: received.append(None), queue_size=100
        )
        publishers = {
            topic: self.node.advertise(topic, type(message), queue_size=5)
            for topic, message in inputs(0).items()
        }
        wait_until(lambda: all(each.connection_count for each in publishers.values()), what="the inputs")

        def run(seconds, first):
            """Publish, and wait up to `DRAIN_S` until the last input has an output."""
            began, count = time.monotonic(), round(seconds * rate_hz)
            expected = len(received) + count
            for sent in range(1, count + 1):
                for topic, message in inputs(first + sent).items():
                    publishers[topic].publish(message)
                time.sleep(max(0.0, began + sent / rate_hz - time.monotonic()))
            took_s = time.monotonic() - began
            while len(received) < expected and time.monotonic() - began < took_s + DRAIN_S:
                time.sleep(0.01)
            return count, took_s

        first, _ = run(WARM_UP_S, 0)
        used_s, before, machine, began = sum(map(cpu_s, pids)), len(received), machine_s(), time.monotonic()
        sent, took_s = run(self.seconds, first)
        used_s, got = sum(map(cpu_s, pids)) - used_s, len(received) - before
        others = max(machine_s() - machine - used_s, 0.0) / (time.monotonic() - began) / os.cpu_count()
        each_ms = used_s / max(got, 1) * 1e3
        print(
            f"| {name} | {side} | {used_s / took_s:.1%} | {each_ms:.2f} ms | {sent / took_s:.1f} Hz | "
            f"{got / took_s:.1f} Hz | {max(sent - got, 0)} | {others:.0%} |",
            flush=True,
        )
        return each_ms

    def pid_of(self, name):
        """Return the process ID of a node, which may be a child of the process that was started."""

        def ask():
            with contextlib.suppress(PiprosError, OSError):
                return xmlrpc.client.ServerProxy(self.node.master.lookup_node(name)).getPid("/bench")[2]

        return wait_until(ask, what=name)


def machine_s():
    """Return the processor time that all processes of the machine, except for this one, have used."""
    times = psutil.cpu_times()
    return sum(times[:8]) - times.idle - times.iowait - time.process_time()


def nodelets_row(seconds, name, side, nodelets, *arguments, prepare=lambda _: None, shares_process=True):
    with Bench(seconds) as bench:
        prepare(bench)
        return bench.row(
            name, side, bench.start_nodelets(side, nodelets, shares_process=shares_process), *arguments
        )


def both_ways(seconds, name, side, nodelets, *arguments, **more):
    """Print the rows of a chain in one process and in several, and the ratio of their costs."""
    together = nodelets_row(seconds, f"{name} in one manager", side, nodelets, *arguments, **more)
    label = f"{name} in {len(nodelets)} processes"
    apart = nodelets_row(seconds, label, side, nodelets, *arguments, shares_process=False, **more)
    print(f"| {name}: ratio of one manager to processes | {side} | | {together / apart:.2f} | | | | |")


def stamped(number, info_topic, **images):
    """Return images with the stamp of a camera's calibration, and the calibration, by topic."""
    info = camera_info(number)
    for each in images.values():
        each.header.stamp = info.header.stamp
    return {f"/{topic.replace('__', '/')}": each for topic, each in images.items()} | {info_topic: info}


def rectify(seconds):
    colors = image(picture(), "bgr8", 0)
    nodelets = {"n": ("image_proc/rectify", {})}
    output = "/image_rect", "sensor_msgs/Image"
    for side in COMMANDS:
        inputs = lambda number: stamped(number, "/camera_info", image_mono=colors)  # noqa: E731
        nodelets_row(seconds, "image_proc/rectify", side, nodelets, inputs, output, 30)


def cloud(seconds):
    colors, depth = image(picture(), "rgb8", 0), image(depths("16UC1"), "16UC1", 0)
    name, output = (
        "depth_image_proc/point_cloud_xyzrgb",
        ("/depth_registered/points", "sensor_msgs/PointCloud2"),
    )

    def inputs(number):
        images = {"depth_registered__image_rect": depth, "rgb__image_rect_color": colors}
        return stamped(number, "/rgb/camera_info", **images)

    for side in COMMANDS:
        nodelets_row(seconds, name, side, {"n": (name, {})}, inputs, output, 15)


def install_relays(bench):
    """Install the plugins `relays/image` and `relays/twist`."""
    info = Path(bench.folder, "site", "relays-1.0.dist-info")
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: relays\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[pipros.nodelets]\nrelays/image = relays_image:Relay\nrelays/twist = relays_twist:Relay\n"
    )
    for name, kind in (("image", "sensor_msgs/Image"), ("twist", "geometry_msgs/Twist")):
        (info.parent / f"relays_{name}.py").write_text(RELAY.format(kind))


def chain(seconds):
    """Three nodelets that pass messages on, then debayer and rectify."""
    pixels, twist = image(picture(), "bgr8", 0), load_message_class("geometry_msgs/Twist")()
    for name, message, rate_hz in (("image", pixels, 30), ("twist", twist, 200)):
        steps = (("n0", "/a", "/b"), ("n1", "/b", "/c"), ("n2", "/c", "/d"))
        nodelets = {each: (f"relays/{name}", {"/in": start, "/out": end}) for each, start, end in steps}
        arguments = nodelets, lambda _, kept=message: {"/a": kept}, ("/d", type(message)._type), rate_hz
        both_ways(seconds, f"3 relays of {name}", "pipros", *arguments, prepare=install_relays)
    raw = image(picture(1), "bayer_rggb8", 0)
    nodelets = {
        "debayer": ("image_proc/debayer", {}),
        "rectify": ("image_proc/rectify", {"/image_mono": "/image_color"}),
    }
    output = "/image_rect", "sensor_msgs/Image"
    for side in COMMANDS:
        inputs = lambda number: stamped(number, "/camera_info", image_raw=raw)  # noqa: E731
        both_ways(seconds, "debayer, rectify", side, nodelets, inputs, output, 30)


def voxels(seconds):
    """A cloud of a 3D lidar with 300,000 points, reduced to cells of 20 cm."""
    numbers, count = np.random.default_rng(1), 300_000
    angles, ranges = numbers.uniform(-np.pi, np.pi, count), numbers.gamma(2, 6, count)
    columns = {"x": ranges * np.cos(angles), "y": ranges * np.sin(angles), "z": numbers.normal(0, 0.8, count)}
    columns["intensity"] = numbers.uniform(0, 100, count)
    header = load_message_class("std_msgs/Header")(frame_id="lidar")
    points = cloud_of(header, {name: each.astype(np.float32) for name, each in columns.items()})

    def prepare(bench):
        bench.node.params.set("/voxels", {"leaf_size": 0.2, "filter_field_name": ""})

    nodelets = {"voxels": ("pcl/VoxelGrid", {})}
    arguments = (
        nodelets,
        lambda _: {"/voxels/input": points},
        ("/voxels/output", "sensor_msgs/PointCloud2"),
        10,
    )
    for side in COMMANDS:
        nodelets_row(seconds, "pcl/VoxelGrid of 300,000 points", side, *arguments, prepare=prepare)


def lidar(seconds):
    for mode in (0, 1, 3):
        with Bench(seconds) as bench:
            device = SimulatedRplidar(
                Path(bench.folder, "tty"), lambda angle: 1000 + 20 * angle, typical=mode, samples=800
            )
            bench.callback(device.unplug)
            options = f"_serial_port:={device.path}", "_angle_compensate:=true", "__name:=driver"
            bench.start("rosrun", "rplidar_ros", "rplidarNode", *options, **QUIET)
            name = f"rplidarNode, {MODES[mode][0]}, 8,000 samples/s"
            output = "/scan", "sensor_msgs/LaserScan"
            bench.row(name, "pipros", [bench.pid_of("/driver")], lambda _: {}, output, 10)


ROWS = {"rectify": rectify, "cloud": cloud, "chain": chain, "voxels": voxels, "lidar": lidar}


def main():
    options = options_of(__doc__, only=",".join(ROWS), seconds=10.0)
    print(
        "| workload (images of 640 x 480 pixels) | implementation | share of a core | time per output "
        "| in | out | lost | foreign load |"
    )
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |", flush=True)
    for name in options.only.split(","):
        ROWS[name](options.seconds)


if __name__ == "__main__":
    main()
