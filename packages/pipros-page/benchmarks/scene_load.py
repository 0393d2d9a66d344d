#!/usr/bin/env python3
"""A long run of the Scene tab with 2,000 markers and a cloud of 1,000,000 points, both ten times a second.

    script/bench scene_load [--minutes 10]

Needs Chromium and Playwright. The heap, the arrays and the server's memory are printed each minute. The exit
status is 1 if the minimum of one of them in the second half exceeds that in the first by a tenth and 1 MB.
"""

import itertools
import math
import sys
from io import BytesIO

import numpy as np
from programs import QUIET, Programs
from scene_soak import heap_mb, opened
from sensor_msgs.msg import PointCloud2, PointField
from table import options_of
from visualization_msgs.msg import Marker, MarkerArray

import rospy

POINTS = 1_000_000
FILE = """\
Visualization Manager:
  Displays:
    - {Class: rviz/MarkerArray, Name: Markers, Marker Topic: /many}
    - {Class: rviz/PointCloud2, Name: Cloud, Topic: /million, Style: Points, Size (Pixels): 2}
  Global Options: {Fixed Frame: map}
Window Geometry: {Hide Left Dock: true}
"""
IS_DRAWN = """(name) => {
  const scene = document.querySelector(".tab-scene")?.scene;
  const display = scene?.all().find((each) => each.name === name);
  if (!display) return false;
  scene.mostPoints = 1000000;
  scene.hasNewClouds = true;
  scene.invalidate();
  return scene.figures.pictures > 0 && (display.root.children.length > 0 || display.shown?.size > 0);
}"""
DRAW_ALWAYS = """() => {
  const { scene } = document.querySelector(".tab-scene");
  const draw = scene.draw.bind(scene);
  scene.draw = () => {
    draw();
    scene.invalidate();
  };
  scene.invalidate();
}"""
STATE = """() => {
  const { scene } = document.querySelector(".tab-scene");
  return [scene.figures.pictures, ...scene.all().map((display) => display.received)];
}"""


def cloud():
    """Return a wavy square of points with intensities, 16 bytes each."""
    side, n = math.isqrt(POINTS), np.arange(POINTS)
    x, y = (n % side) / side * 10 - 5, (n // side) / side * 10 - 5
    columns = np.stack([x, y, np.sin(x) * np.cos(y), n % 97], axis=1).astype("<f4")
    names = ("x", "y", "z", "intensity")
    fields = [PointField(name, 4 * at, PointField.FLOAT32, 1) for at, name in enumerate(names)]
    made = PointCloud2(height=1, width=POINTS, fields=fields, point_step=16, is_dense=True)
    made.header.frame_id, made.row_step, made.data = "map", 16 * POINTS, columns.tobytes()
    return made


def markers(moment):
    """Return cubes, spheres and cylinders in a moving grid."""
    found = []
    for n in range(2000):
        marker = Marker(ns="obstacles", id=n, type=1 + n % 3, action=Marker.ADD)
        marker.header.frame_id = "map"  # without a stamp: at the newest pose of the frame
        place = marker.pose.position
        place.x, place.y, place.z = n % 45 / 6 - 4, n // 45 / 6 - 4, 0.2 * math.sin(moment + n)
        marker.pose.orientation.w = 1.0
        marker.scale.x = marker.scale.y = marker.scale.z = 0.1
        marker.color.r, marker.color.g, marker.color.b, marker.color.a = (n % 7) / 7, 0.6, (n % 5) / 5, 1.0
        found.append(marker)
    return MarkerArray(markers=found)


class Serialized(MarkerArray):
    """A message serialized in advance, because doing so ten times a second would take a whole processor."""

    def serialize(self, buff):
        buff.write(self.body)


def send(topic):
    """Run a node that publishes markers or clouds."""
    rospy.init_node(topic)
    made = [cloud()] if topic == "million" else [Serialized() for _ in range(10)]
    for step, message in enumerate(made if topic == "many" else ()):
        buffer = BytesIO()
        markers(step * 0.3).serialize(buffer)
        message.body = buffer.getvalue()
    out, messages = rospy.Publisher(topic, type(made[0]), queue_size=1), itertools.cycle(made)
    rospy.Timer(rospy.Duration(0.1), lambda _: out.publish(next(messages)))
    rospy.spin()


def soak(tab, server, minutes):
    """Print the three memories each minute. Return whether they do not grow."""
    session, history = tab.context.new_cdp_session(tab), []
    print(" minute  heap MB  arrays MB  server MB  pictures  markers  clouds", flush=True)
    for minute in range(1, minutes + 1):
        tab.wait_for_timeout(60_000)
        history.append([*heap_mb(session), server.memory_info().rss / 1e6])
        pictures, *received = tab.evaluate(STATE)
        row = "{:7}{:9.1f}{:11.1f}{:11.1f}{:10}{:9}{:8}".format(minute, *history[-1], pictures, *received)
        print(row, flush=True)
    middle = max(2, (len(history) + 1) // 2)
    halves = (history[1:middle] or history, history[middle:] or history)
    first, second = ([min(values) for values in zip(*half, strict=True)] for half in halves)
    return all(later <= 1.1 * earlier + 1 for earlier, later in zip(first, second, strict=True))


def main():
    minutes = options_of(__doc__, minutes=10).minutes
    with Programs("roscore") as programs:
        for topic in ("many", "million"):
            programs.start(sys.executable, __file__, "--send", topic, **QUIET)
        server, tab = opened(programs, FILE, 1440, 900)
        tab.set_default_timeout(180_000)
        for name in ("Cloud", "Markers"):
            tab.wait_for_function(IS_DRAWN, arg=name)
        tab.evaluate(DRAW_ALWAYS)
        return 0 if soak(tab, server, minutes) else 1


if __name__ == "__main__":
    sys.exit(send(sys.argv[2]) if sys.argv[1:2] == ["--send"] else main())
