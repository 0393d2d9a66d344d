#!/usr/bin/env python3
"""A long run of the Scene tab, with a bag that loops in simulated time: no stale objects, no growing memory.

    script/bench scene_soak [--minutes 60]

Prints a line per loop. The exit status is 1 if an object of the end of the bag is shown at its beginning, or
if page or server have over 10 % more memory, or the graphics card more objects, in the last ten loops than in
ten loops after the first 20. Needs Chromium and Playwright.
"""

import struct
import sys
import time
from pathlib import Path

import psutil
from playwright.sync_api import TimeoutError as NeverShown
from programs import QUIET, Programs
from table import options_of

from pipros.msg import load_message_class
from pipros_tools.bag import BagWriter
from tests.browser.chromium import running_chromium

SECONDS = 12
HALF = SECONDS // 2
POINTS = 20_000
GROWTH = 1.1
WARM_UP_LOOPS = 20
SOME_LOOPS = 10
MORE_OBJECTS = 5
FILE = """\
Visualization Manager:
  Displays:
    - {Class: rviz/Grid, Name: Grid}
    - {Class: rviz/TF, Name: TF}
    - {Class: rviz/Marker, Name: Marks, Marker Topic: /marks}
    - {Class: rviz/Odometry, Name: Odometry, Topic: /odom, Keep: 50}
    - {Class: rviz/PointCloud2, Name: Cloud, Topic: /cloud, Decay Time: 1}
  Global Options: {Fixed Frame: map}
Window Geometry: {Hide Left Dock: true}
"""
STATE = """() => {
  const scene = document.querySelector(".tab-scene")?.scene;
  if (!scene?.displays?.length || !scene.simulatedNs) return null;
  const [, , marks, odometry] = scene.displays;
  const { memory } = scene.renderer.info;
  const places = odometry.root.children.map(({ children: [each] }) => each.children[0].position.x);
  return {
    second: Number(scene.now()) / 1e9 - 1000,
    late: [...marks.shown.keys()].includes("late/0") || scene.frames.parent("late") !== null,
    newest: Math.max(0, ...places),
    objects: memory.geometries + memory.textures,
    pictures: scene.figures.pictures,
  };
}"""


def make_bag(path):
    """Write a bag with a moving base, odometry and clouds. Its second half has another marker and frame."""
    names = {
        "/tf": "tf2_msgs/TFMessage",
        "/marks": "visualization_msgs/Marker",
        "/odom": "nav_msgs/Odometry",
        "/cloud": "sensor_msgs/PointCloud2",
    }
    kinds = {topic: load_message_class(name) for topic, name in names.items()}
    transform, field = map(load_message_class, ("geometry_msgs/TransformStamped", "sensor_msgs/PointField"))
    fields = [field(name=name, offset=4 * n, datatype=7, count=1) for n, name in enumerate("xyz")]
    with open(path, "wb") as file:
        bag = BagWriter(file)
        connections = {}
        for topic, kind in kinds.items():
            head = {"topic": topic, "type": kind._type, "md5sum": kind._md5sum}
            head["message_definition"] = kind._full_text
            connections[topic] = bag.add_connection(topic, {key: text.encode() for key, text in head.items()})
        for tick in range(SECONDS * 10):
            second, tenth = divmod(tick, 10)
            stamp = 1000 + second, tenth * 100_000_000
            links = []
            for child in ["base"] + ["late"] * (second >= HALF):
                link = transform(child_frame_id=child)
                link.header.frame_id, (link.header.stamp.secs, link.header.stamp.nsecs) = "map", stamp
                link.transform.translation.x, link.transform.rotation.w = tick / 10, 1.0
                links.append(link)
            bag.write_message(connections["/tf"], *stamp, kinds["/tf"](links))
            for topic in ("/marks", "/odom", "/cloud"):
                made = kinds[topic]()
                made.header.frame_id, (made.header.stamp.secs, made.header.stamp.nsecs) = "map", stamp
                if topic == "/marks":
                    made.ns = "late" if second >= HALF else "early"
                    made.type = made.pose.orientation.w = 1
                    made.scale.x = made.scale.y = made.scale.z = made.color.a = 1.0
                elif topic == "/odom":
                    made.pose.pose.position.x, made.pose.pose.orientation.w = tick / 10, 1.0
                else:
                    made.height, made.width, made.point_step, made.fields = 1, POINTS, 12, fields
                    made.data = struct.pack("<3f", tick / 10, 1, 0) * POINTS
                bag.write_message(connections[topic], *stamp, made)
        bag.finish()


def opened(programs, text, width, height):
    """Open the Scene tab of rviz, with the text of a file. Return the server and the tab."""
    file = Path(programs.folder, "scene.rviz")
    file.write_text(text)
    server, address = programs.page("rviz", "-d", str(file))
    tab = programs.enter_context(running_chromium()).new_page(viewport={"width": width, "height": height})
    tab.on("pageerror", lambda error: print(error, flush=True))
    tab.on("requestfailed", lambda request: print(request.url, request.failure, flush=True))
    tab.goto(address, wait_until="commit")
    return psutil.Process(server.pid), tab


def heap_mb(session):
    """Return the sizes of a page's heap, after garbage collection, and of its arrays."""
    session.send("HeapProfiler.collectGarbage")
    usage = session.send("Runtime.getHeapUsage")
    return usage["usedSize"] / 1e6, usage.get("backingStorageSize", 0) / 1e6


def main():
    minutes = options_of(__doc__, minutes=60.0).minutes
    with Programs("roscore") as programs:
        folder = Path(programs.folder)
        make_bag(folder / "loop.bag")
        time.sleep(3)
        programs.start("rosparam", "set", "/use_sim_time", "true").wait()
        programs.start("rosbag", "play", "-q", "-l", "--clock", str(folder / "loop.bag"), **QUIET)
        server, tab = opened(programs, FILE, 1000, 700)
        try:
            tab.wait_for_function(STATE, timeout=120_000)
        except NeverShown:
            print(tab.evaluate("document.body.innerText"))
            return 1
        good = watch(tab, server, time.monotonic() + 60 * minutes)
    return 0 if good else 1


def watch(tab, server, end):
    """Print the figures of each loop until the time `end`. Return whether the run has passed."""
    session = tab.context.new_cdp_session(tab)
    history, stale, loops, was_late = [], 0, 0, False
    begin = time.monotonic()
    print(" minutes  loops  page MB  server MB  objects  pictures  stale", flush=True)
    while time.monotonic() < end:
        time.sleep(0.25)
        state = tab.evaluate(STATE)
        if state is None:
            continue
        is_first_half = state["second"] < HALF - 1
        stale += is_first_half and (state["late"] or state["newest"] > HALF)
        if not is_first_half or not was_late:
            was_late |= state["second"] > SECONDS - 3
            continue
        was_late = False
        loops += 1
        figures = heap_mb(session)[0], server.memory_info().rss / 1e6, state["objects"]
        row = f"{(time.monotonic() - begin) / 60:8.1f} {loops:6} {figures[0]:8.1f} {figures[1]:10.1f}"
        print(f"{row} {figures[2]:8} {state['pictures']:9} {stale:6}", flush=True)
        history.append(figures)
    if loops < WARM_UP_LOOPS + 2 * SOME_LOOPS:
        print(f"fewer than {WARM_UP_LOOPS + 2 * SOME_LOOPS} loops")
        return False
    # Minima over several loops are compared, because each figure includes memory that is only in use briefly.
    parts = history[WARM_UP_LOOPS:][:SOME_LOOPS], history[-SOME_LOOPS:]
    first, last = ([min(column) for column in zip(*part, strict=True)] for part in parts)
    print(f"page MB, server MB, objects: first {first}; last {last}")
    has_grown = any(now > GROWTH * before for before, now in zip(first[:2], last[:2], strict=True))
    return stale == 0 and not has_grown and last[2] <= first[2] + MORE_OBJECTS


if __name__ == "__main__":
    sys.exit(main())
