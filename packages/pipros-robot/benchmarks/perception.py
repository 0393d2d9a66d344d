#!/usr/bin/env python3
"""Processor time of nodes for images, clouds and lidars: pipros's and Debian's genuine ones, in one run.

    script/bench perception [--only rectify,cloud,chain,voxels,lidar] [--seconds 10]

A row is one node, or a chain of nodes. The benchmark publishes the inputs at a fixed rate, subscribes to the
last output, and reads the processor time of the nodes' processes from /proc. Chains run in one manager, and
with one process for each nodelet. The relays pass on the messages that they receive, so their rows are the
cost of handing messages over. The lidar is simulated on a pseudo-terminal, with 8,000 samples in 10 turns per
second; there is no genuine driver to compare with.

`in` and `out` are the rates of inputs and outputs, `lost` is the number of inputs without an output, and
`foreign load` is the share of the machine that processes outside of the benchmark used. A node keeps up in
real time if nothing is lost; a row says little if the foreign load is high.
"""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import xmlrpc.client
from pathlib import Path

import numpy as np
import psutil
from table import options_of

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.launch.roscore import Core
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from pipros.perception.clouds.points import cloud_of

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "build"))
from tests.support.pictures_of_cameras import camera_info, depths, image, picture
from tests.support.simulated_rplidar import MODES, SimulatedRplidar

COMMANDS = {
    "pipros": [str(Path(sys.executable).parent / "rosrun"), "nodelet", "nodelet"],
    "genuine": ["/usr/lib/nodelet/nodelet"],
}
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


def cpu_s(pid):
    """Return the processor time that a process has used."""
    return sum(psutil.Process(pid).cpu_times()[:2])


def machine_s():
    """Return the processor time that all processes of the machine have used."""
    times = psutil.cpu_times()
    return sum(times[:8]) - times.idle - times.iowait


class Bench:
    """A master, a node that publishes inputs and receives outputs, and the processes that are measured."""

    def __init__(self, seconds):
        self.seconds = seconds
        self.folder = Path(tempfile.mkdtemp(prefix="perception-"))
        self.processes = []
        port = 20000 + os.getpid() % 20000
        environment = Environment(master_uri=f"http://127.0.0.1:{port}", ros_home=self.folder)
        self.variables = {"ROS_MASTER_URI": environment.master_uri, "ROS_HOME": str(self.folder)}
        self.core = Core(run_id="perception", environment=environment, port=port)
        self.core.start_master()
        self.node = Node("bench", environment=environment)
        self.node.start()

    def row(self, name, side, nodelets, inputs, output, rate_hz, *, shares_process=True):
        """Start nodelets, measure them, print a row, and return the processor time per output.

        Args:
            nodelets: plugin and remappings by name.
            inputs: function that returns the messages, by topic, for a number.
            output: the last topic, and its type.
            shares_process: whether all are in one process.
        """
        if shares_process and len(nodelets) > 1:
            self._start(side, "manager", "__name:=manager")
            pids = [self._pid_of("/manager")]
            load = load_service_class("nodelet/NodeletLoad")
            client = self.node.client("/manager/load_nodelet", load)
            client.wait_until_available(60, pause=time.sleep, report=print)
            for each, (plugin, moved) in nodelets.items():
                client.call(load._request_class(f"/{each}", plugin, [*moved], [*moved.values()], [], ""))
        else:
            for each, (plugin, moved) in nodelets.items():
                remappings = [f"{old}:={new}" for old, new in moved.items()]
                self._start(side, "standalone", plugin, f"__name:={each}", *remappings)
            pids = [self._pid_of(f"/{each}") for each in nodelets]
        return self._finish(name, side, pids, inputs, output, rate_hz)

    def driver_row(self, name, program, output, rate_hz):
        """Start a pipros program, measure it, and print a row."""
        self._start("pipros", *program, "__name:=driver", command=COMMANDS["pipros"][:1])
        self._finish(name, "pipros", [self._pid_of("/driver")], lambda _: {}, output, rate_hz)

    def _finish(self, name, side, pids, inputs, output, rate_hz):
        used_s, others, took_s, sent, received = self._measure(pids, inputs, *output, rate_hz)
        each_ms = used_s / max(received, 1) * 1e3
        print(
            f"| {name} | {side} | {used_s / took_s:.1%} | {each_ms:.2f} ms | {sent / took_s:.1f} Hz | "
            f"{received / took_s:.1f} Hz | {max(sent - received, 0)} | "
            f"{others:.0%} |",
            flush=True,
        )
        self._end_processes()
        return each_ms

    def _start(self, side, *arguments, command=None):
        variables = {**os.environ, **self.variables, "PYTHONPATH": str(self.folder / "site")}
        if side == "genuine":
            variables = {"PATH": "/usr/bin:/bin", "ROS_PACKAGE_PATH": "/usr/share", "ROS_IP": "127.0.0.1"}
            variables |= {**self.variables, "HOME": str(self.folder)}
            variables["CMAKE_PREFIX_PATH"] = f"{self._prefix()}:/usr"
        quiet = subprocess.DEVNULL
        command = [*(command or COMMANDS[side]), *arguments]
        self.processes.append(subprocess.Popen(command, env=variables, stdout=quiet, stderr=quiet))

    def _prefix(self):
        """Return a prefix in which the plugins of Debian's pcl_ros are found: they name the folder `lib`."""
        prefix = self.folder / "prefix"
        prefix.mkdir(exist_ok=True)
        if not (prefix / "lib").exists():
            (prefix / "lib").symlink_to("/usr/lib/x86_64-linux-gnu")
        return prefix

    def _measure(self, pids, inputs, output, kind, rate_hz):
        """Return processor time, the share of others, duration, and the numbers of inputs and outputs."""
        count, lock = 0, threading.Lock()

        def on_output(_):
            nonlocal count
            with lock:
                count += 1

        subscriber = self.node.subscribe(output, load_message_class(kind), on_output, queue_size=100)
        publishers = {
            topic: self.node.advertise(topic, type(message), queue_size=5)
            for topic, message in inputs(0).items()
        }
        self._wait(lambda: all(each.connection_count for each in publishers.values()), "the inputs")

        def run(seconds, number):
            """Publish, and wait up to `DRAIN_S` until the last input has an output."""
            began, begun, expected = time.monotonic(), number, count + round(seconds * rate_hz)
            due = began
            while number - begun < round(seconds * rate_hz):
                for topic, message in inputs(number).items():
                    publishers[topic].publish(message)
                number += 1
                due += 1 / rate_hz
                time.sleep(max(0.0, due - time.monotonic()))
            took_s = time.monotonic() - began
            while count < expected and time.monotonic() - began < took_s + DRAIN_S:
                time.sleep(0.01)
            return number, took_s

        number, _ = run(WARM_UP_S, 1)
        before, begun, sent = sum(map(cpu_s, pids)), count, number
        machine, own, began = machine_s(), time.process_time(), time.monotonic()
        number, took_s = run(self.seconds, number)
        used_s = sum(map(cpu_s, pids)) - before
        others_s = machine_s() - machine - used_s - (time.process_time() - own)
        others = max(others_s, 0.0) / (time.monotonic() - began) / os.cpu_count()
        result = used_s, others, took_s, number - sent, count - begun
        for each in (subscriber, *publishers.values()):
            each.unregister()
        return result

    def _pid_of(self, name):
        """Return the process ID of a node, which may be a child of the process that was started."""
        found = []

        def asks():
            # until it has started, the master may know an ended node of that name
            with contextlib.suppress(PiprosError, OSError):
                uri = self.node.master.lookup_node(name)
                found.append(xmlrpc.client.ServerProxy(uri).getPid("/bench")[2])
            return bool(found)

        self._wait(asks, name)
        return found[0]

    def _wait(self, is_reached, what):
        end = time.monotonic() + 60
        while not is_reached():
            if time.monotonic() > end:
                raise SystemExit(f"waited too long for {what}")
            time.sleep(0.02)

    def _end_processes(self):
        for each in self.processes:
            each.send_signal(signal.SIGINT)
        for each in self.processes:
            try:
                each.wait(5)
            except subprocess.TimeoutExpired:
                each.kill()
                each.wait()
        self.processes.clear()

    def close(self):
        self._end_processes()
        self.node.shutdown()
        shutil.rmtree(self.folder, ignore_errors=True)


def stamped(number, info_topic, **images):
    """Return images with the stamp of a camera's calibration, and the calibration, by topic."""
    info = camera_info(number)
    for each in images.values():
        each.header.stamp = info.header.stamp
    return {f"/{topic.replace('__', '/')}": each for topic, each in images.items()} | {info_topic: info}


def rectify(bench):
    colors = image(picture(), "bgr8", 0)
    for side in COMMANDS:
        bench.row(
            "image_proc/rectify",
            side,
            {"n": ("image_proc/rectify", {})},
            lambda number: stamped(number, "/camera_info", image_mono=colors),
            ("/image_rect", "sensor_msgs/Image"),
            30,
        )


def cloud(bench):
    colors, depth = image(picture(), "rgb8", 0), image(depths("16UC1"), "16UC1", 0)
    for side in COMMANDS:
        bench.row(
            "depth_image_proc/point_cloud_xyzrgb",
            side,
            {"n": ("depth_image_proc/point_cloud_xyzrgb", {})},
            lambda number: stamped(
                number, "/rgb/camera_info", depth_registered__image_rect=depth, rgb__image_rect_color=colors
            ),
            ("/depth_registered/points", "sensor_msgs/PointCloud2"),
            15,
        )


def both_ways(bench, name, side, *arguments):
    """Print the rows of a chain in one process and in several, and the ratio of their costs."""
    together = bench.row(f"{name} in one manager", side, *arguments)
    apart = bench.row(f"{name} in {len(arguments[0])} processes", side, *arguments, shares_process=False)
    print(
        f"| {name}: ratio of one manager to processes | {side} | | {together / apart:.2f} | | | | |",
        flush=True,
    )


def chain(bench):
    """Three nodelets that pass messages on, then debayer and rectify."""
    info = bench.folder / "site" / "relays-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: relays\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[pipros.nodelets]\nrelays/image = relays_image:Relay\nrelays/twist = relays_twist:Relay\n"
    )
    topics = ["/a", "/b", "/c", "/d"]
    pixels, twist = image(picture(), "bgr8", 0), load_message_class("geometry_msgs/Twist")()
    for name, message, rate_hz in (("image", pixels, 30), ("twist", twist, 200)):
        (info.parent / f"relays_{name}.py").write_text(RELAY.format(type(message)._type))
        nodelets = {
            f"n{at}": (f"relays/{name}", {"/in": topics[at], "/out": topics[at + 1]}) for at in range(3)
        }
        inputs = {"/a": message}
        output = "/d", type(message)._type
        both_ways(
            bench, f"3 relays of {name}", "pipros", nodelets, lambda _, kept=inputs: kept, output, rate_hz
        )
    raw = image(picture(1), "bayer_rggb8", 0)
    for side in COMMANDS:
        both_ways(
            bench,
            "debayer, rectify",
            side,
            {
                "debayer": ("image_proc/debayer", {}),
                "rectify": ("image_proc/rectify", {"/image_mono": "/image_color"}),
            },
            lambda number: stamped(number, "/camera_info", image_raw=raw),
            ("/image_rect", "sensor_msgs/Image"),
            30,
        )


def voxels(bench):
    """A cloud of a 3D lidar with 300,000 points, reduced to cells of 20 cm."""
    numbers, count = np.random.default_rng(1), 300_000
    angles, ranges = numbers.uniform(-np.pi, np.pi, count), numbers.gamma(2, 6, count)
    columns = {"x": ranges * np.cos(angles), "y": ranges * np.sin(angles), "z": numbers.normal(0, 0.8, count)}
    columns["intensity"] = numbers.uniform(0, 100, count)
    header = load_message_class("std_msgs/Header")(frame_id="lidar")
    points = cloud_of(header, {name: each.astype(np.float32) for name, each in columns.items()})
    bench.node.params.set("/voxels", {"leaf_size": 0.2, "filter_field_name": ""})
    for side in COMMANDS:
        bench.row(
            "pcl/VoxelGrid of 300,000 points",
            side,
            {"voxels": ("pcl/VoxelGrid", {})},
            lambda _: {"/voxels/input": points},
            ("/voxels/output", "sensor_msgs/PointCloud2"),
            10,
        )


def lidar(bench):
    for mode in (0, 1, 3):
        device = SimulatedRplidar(
            bench.folder / "tty", lambda angle: 1000 + 20 * angle, typical=mode, samples=800
        )
        program = "rplidar_ros", "rplidarNode", f"_serial_port:={device.path}", "_angle_compensate:=true"
        name = f"rplidarNode, {MODES[mode][0]}, 8,000 samples/s"
        bench.driver_row(name, program, ("/scan", "sensor_msgs/LaserScan"), 10)
        device.unplug()


ROWS = {"rectify": rectify, "cloud": cloud, "chain": chain, "voxels": voxels, "lidar": lidar}


def main():
    options = options_of(__doc__, only=",".join(ROWS), seconds=10.0)
    bench = Bench(options.seconds)
    print(
        "| workload (images of 640 x 480 pixels) | implementation | share of a core | time per output "
        "| in | out | lost | foreign load |"
    )
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |", flush=True)
    try:
        for name in options.only.split(","):
            ROWS[name](bench)
    finally:
        bench.close()


if __name__ == "__main__":
    main()
