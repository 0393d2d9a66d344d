#!/usr/bin/env python3
"""The page under load: point clouds, cameras, curves, and a graph with many nodes.

    script/bench page [--seconds 30] [--only opening,clouds,cameras,curves,graph]

First, prints how the page opens in a new browser whose processor is slowed four times: requests, kB
transferred, and ms until the first text and until the graph or scene of a simulated robot is drawn. Then, for
each load, prints animation frames and pictures a second, the processor time of the server and of Chromium
(with all its processes) as percentages of a core, and their memory at the beginning and at the end, after a
collection; with `--seconds 600`, memory that grows shows a leak, and so do elements and listeners. Chromium
is driven through its own protocol, because Playwright copies all data of WebSockets. Without a graphics card,
Chromium draws in software.
"""

import contextlib
import itertools
import json
import os
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.request
from urllib.parse import quote
from xmlrpc.client import ServerProxy

import numpy as np
import psutil
from programs import QUIET, Programs
from sensor_msgs.msg import Image, PointCloud2, PointField
from std_msgs.msg import Float64MultiArray
from table import free_port, options_of, wait_for_port
from websockets.sync.client import connect

import rospy
from tests.support.browser import find_chromium

CLOUDS, POINTS, CLOUD_HZ = 5, 300_000, 10
CAMERAS, SIZE, CAMERA_HZ = 8, (640, 480), 30
CURVES, CURVE_HZ = 100, 20
NODES = 300
SLOWED = 4
NOTE_DRAWN = """(() => {
  const look = () => {
    const scene = document.querySelector(".tab-scene")?.scene;
    if (!globalThis.drawn_ && (document.querySelector("svg .vertex") || scene?.figures?.pictures)) {
      globalThis.drawn_ = performance.now();
    }
    setTimeout(look, 10);
  };
  look();
})()"""
OPENED = """JSON.stringify((() => {
  const loaded = [...performance.getEntriesByType("navigation"), ...performance.getEntriesByType("resource")];
  return [loaded.length, loaded.reduce((sum, each) => sum + each.transferSize, 0),
    performance.getEntriesByName("first-contentful-paint")[0]?.startTime, globalThis.drawn_];
})())"""
SCENE = """\
Visualization Manager:
  Displays: [{displays}]
  Global Options: {{Fixed Frame: map}}
Window Geometry: {{Hide Left Dock: true}}
"""
COUNT_FRAMES = """(() => {
  globalThis.frames_ = 0;
  const count = () => { globalThis.frames_ += 1; requestAnimationFrame(count); };
  requestAnimationFrame(count);
})()"""
COUNTED = """JSON.stringify([globalThis.frames_,
  document.querySelector(".tab-scene")?.scene?.figures?.pictures ?? null,
  document.querySelectorAll("svg .vertex, canvas, .u-over").length])"""


def send(kind, number):
    """Run a node that publishes the clouds or pictures of one sensor, or the numbers of all curves."""
    rospy.init_node(f"{kind}_{number}")
    random = np.random.default_rng(int(number))
    if kind == "clouds":
        made = PointCloud2(height=1, width=POINTS, point_step=16, row_step=16 * POINTS, is_dense=True)
        made.header.frame_id = "map"
        made.fields = [PointField(name, 4 * at, PointField.FLOAT32, 1) for at, name in enumerate("xyzi")]
        messages = []
        for _ in range(4):
            points = random.uniform(-5, 5, (POINTS, 4)).astype("<f4")
            messages.append(
                PointCloud2(
                    made.header, 1, POINTS, made.fields, False, 16, 16 * POINTS, points.tobytes(), True
                )
            )
        hertz = CLOUD_HZ
    elif kind == "cameras":
        width, height = SIZE
        pictures = random.integers(0, 255, (4, height * width * 3), np.uint8)
        messages = [
            Image(height=height, width=width, encoding="rgb8", step=3 * width, data=each.tobytes())
            for each in pictures
        ]
        hertz = CAMERA_HZ
    else:
        messages = [Float64MultiArray(data=list(random.uniform(-1, 1, CURVES))) for _ in range(20)]
        hertz = CURVE_HZ
    out = rospy.Publisher(f"/{kind}_{number}", type(messages[0]), queue_size=1)
    turns = itertools.cycle(messages)
    rospy.Timer(rospy.Duration(1 / hertz), lambda _: out.publish(next(turns)))
    rospy.spin()


class Chromium:
    """A headless Chromium with one tab, driven through its protocol."""

    def __init__(self, programs, url, slowed=1, has_scene=True):
        folder = programs.enter_context(tempfile.TemporaryDirectory(ignore_cleanup_errors=True))
        port = free_port()
        options = ("--headless", "--no-sandbox", f"--user-data-dir={folder}", "--window-size=1440,900")
        more = ("--enable-precise-memory-info", f"--remote-debugging-port={port}")
        if has_scene:  # otherwise, Chromium would draw plots through WebGL in software, too
            more += ("--use-angle=swiftshader",)
        self.process = subprocess.Popen(
            [find_chromium(), *options, *more, "about:blank"], start_new_session=True, **QUIET
        )
        programs.callback(self.end)
        wait_for_port(port)
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json/list", timeout=30) as answer:  # noqa: S310
            (tab,) = [each for each in json.load(answer) if each["type"] == "page"]
        self._socket = programs.enter_context(
            connect(tab["webSocketDebuggerUrl"], max_size=None, proxy=None, ping_interval=None)
        )
        self._number = 0
        self.call("Emulation.setCPUThrottlingRate", rate=slowed)
        self.call("Page.enable")
        self.call("Page.addScriptToEvaluateOnNewDocument", source=NOTE_DRAWN)
        self.call("Page.navigate", url=url)

    def call(self, method, **params):
        self._number += 1
        self._socket.send(json.dumps({"id": self._number, "method": method, "params": params}))
        while True:
            answer = json.loads(self._socket.recv(timeout=120))
            if answer.get("id") == self._number:
                return answer.get("result", {})

    def evaluate(self, text):
        return self.call("Runtime.evaluate", expression=text)["result"].get("value")

    def processes(self):
        return [self.process_of, *self.process_of.children(recursive=True)]

    @property
    def process_of(self):
        return psutil.Process(self.process.pid)

    def end(self):
        with contextlib.suppress(
            ProcessLookupError
        ):  # all of it: Debian's program is a shell that starts Chromium
            os.killpg(self.process.pid, signal.SIGTERM)
        self.process.wait(30)


def used_s(processes):
    return sum(sum(each.cpu_times()[:2]) for each in processes if each.is_running())


def memory_mb(processes):
    """Return the memory of processes (MB), with what they share divided among them."""
    return sum(each.memory_full_info().pss for each in processes if each.is_running()) / 1e6


def memory(server, chromium):
    """Return the memory of the server, of Chromium and of its scripts (MB), its elements and listeners."""
    chromium.call("HeapProfiler.collectGarbage")
    counted = chromium.call("Memory.getDOMCounters")
    heap = chromium.call("Runtime.getHeapUsage")["usedSize"] / 1e6
    ours = memory_mb([psutil.Process(server.pid)]), memory_mb(chromium.processes())
    return *ours, heap, counted["nodes"], counted["jsEventListeners"]


def place_of(kind, programs):
    """Start the programs of a load. Return the options of the page, and the place that it shows."""

    def start(count):
        for number in range(count):
            programs.start(sys.executable, __file__, "--send", kind, str(number), **QUIET)

    if kind == "clouds":
        start(CLOUDS)
        shown = (
            f"{{Class: rviz/PointCloud2, Name: C{number}, Topic: /clouds_{number}}}"
            for number in range(CLOUDS)
        )
        file = f"{programs.folder}/clouds.rviz"
        with open(file, "w") as out:
            out.write(SCENE.format(displays=", ".join(shown)))
        return ["rviz", "-d", file], "scene"
    if kind == "cameras":
        start(CAMERAS)
        half = CAMERAS // 2
        columns = ("~".join(f"images//cameras_{at + number}" for number in range(half)) for at in (0, half))
        return ["rqt"], f"panels/row({'~'.join(f'column({each})' for each in columns)})"
    if kind == "curves":
        start(1)
        curves = ",".join(f"/curves_0/data[{number}]" for number in range(CURVES))
        return ["rqt"], f"plot/{quote(curves, safe=',')}"
    master = ServerProxy(programs.environment["ROS_MASTER_URI"])
    node = programs.node()
    node.advertise("/start", "std_msgs/String")
    address = master.lookupNode("/bench", node.name)[2]  # of the only node that exists
    for number in range(NODES):
        name = f"/part_{number}"
        master.registerPublisher(name, f"{name}/out", "std_msgs/String", address)
        master.registerSubscriber(name, f"/part_{number // 3}/out", "std_msgs/String", address)
    return ["rqt"], "graph"


def serve(programs, *command):
    """Start the page's server. Return its process and address."""
    server = programs.start(*command, "--no-browser", stderr=subprocess.PIPE)
    return server, re.search(r"http\S+?#token=[\w-]+", server.stderr.readline())[0]


def open_pages():
    """Print how each page opens in a new browser."""
    print(f"| opened, slowed {SLOWED} times | requests | kB | first text, ms | drawn, ms |")
    print("| --- | ---: | ---: | ---: | ---: |")
    with Programs() as programs:
        programs.start("rosrun", "pipros_sim", "sim", "_headless:=true")
        time.sleep(5)
        pages = (("rqt_graph", "rqt_graph", "graph"), ("Overview", "rqt", ""), ("Scene", "rviz", "scene"))
        for name, command, place in pages:
            _, url = serve(programs, command)
            runs = []
            for _ in range(3):
                chromium = Chromium(programs, f"{url}/{place}".removesuffix("/"), SLOWED)
                time.sleep(15)
                runs.append(json.loads(chromium.evaluate(OPENED)))
                chromium.end()
            cells = [statistics.median(each or 0 for each in column) for column in zip(*runs, strict=True)]
            print(
                f"| {name} | {cells[0]:.0f} | {cells[1] / 1e3:.0f} | {cells[2]:.0f} | {cells[3]:.0f} |",
                flush=True,
            )
    print()


def measure(kind, seconds):
    """Print the row of one load."""
    with Programs() as programs:
        command, place = place_of(kind, programs)
        server, url = serve(programs, *command)
        chromium = Chromium(programs, f"{url}/{place}", has_scene=kind == "clouds")
        time.sleep(max(min(seconds, 15), seconds / 6))  # until all is shown, and histories are full
        chromium.evaluate(COUNT_FRAMES)
        ours, theirs = [psutil.Process(server.pid)], chromium.processes()
        sizes = [memory(server, chromium)]
        before = [used_s(ours), used_s(theirs), *json.loads(chromium.evaluate(COUNTED))]
        began_s = time.monotonic()
        time.sleep(seconds)
        frames, pictures, parts = json.loads(chromium.evaluate(COUNTED))
        passed_s = time.monotonic() - began_s
        drawn = "" if pictures is None else f"{(pictures - (before[3] or 0)) / passed_s:.1f}"
        rates = [
            100 * (used - old) / passed_s
            for used, old in zip((used_s(ours), used_s(theirs)), before, strict=False)
        ]
        cells = [kind, f"{(frames - before[2]) / passed_s:.1f}", drawn, *(f"{each:.0f} %" for each in rates)]
        sizes.append(memory(server, chromium))
        cells += [f"{old:.0f}, {new:.0f}" for old, new in zip(*sizes, strict=True)]
        cells.append(str(parts))
        print("| " + " | ".join(cells) + " |", flush=True)


def main():
    options = options_of(__doc__, seconds=30, only="opening,clouds,cameras,curves,graph")
    loads = options.only.split(",")
    if "opening" in loads:
        open_pages()
        loads.remove("opening")
    if not loads:
        return
    names = "load | frames/s | pictures/s | server | Chromium | server MB | Chromium MB | heap MB"
    print(f"| {names} | elements | listeners | parts |")
    print("| --- |" + " ---: |" * 10)
    for kind in loads:
        measure(kind, options.seconds)


if __name__ == "__main__":
    send(*sys.argv[2:]) if sys.argv[1:2] == ["--send"] else main()
