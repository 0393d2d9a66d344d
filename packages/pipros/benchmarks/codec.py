#!/usr/bin/env python3
"""Time to write and read messages: pipros and genuine genpy, in one run.

    script/bench codec [--rounds 5] [--only Image,Path]

Both run in the Python of genuine ROS. They alternate, round by round, and the best round of each counts, so
that other load affects both alike. "buffers" is pipros's list of buffers, which its transport sends, compared
with `serialize(buff)`, genpy's only method. Similarly, "from bytes" is the method that the transport calls
for a received message.
"""

import argparse
import io
import json
import os
import subprocess
import sys
import timeit

from table import Row, markdown, write_json

PYTHON = "/usr/bin/python3"
REPOSITORY = os.path.abspath(os.path.join(os.path.realpath(__file__), "..", "..", "..", ".."))
SOURCES = os.path.join(REPOSITORY, "build", "src")
SOURCE_PATH = os.pathsep.join(
    [SOURCES, *(os.path.join(REPOSITORY, "build", part) for part in ("facades", "internals"))]
)
TARGETS = {  # the required minimum ratios to genuine genpy, for serialize, buffers and deserialize
    "String 16 B": (1.2, None, 1.2),
    "Imu": (1.5, None, 1.5),
    "JointState 50": (2, None, 1.5),
    "JointState 50 from two robots": (2, None, 1.5),
    "Image 1 MB": (8, 100, 1),
    "PointCloud2 4 MB": (8, 300, 1),
    "Path 1000": (1.5, None, 2),
    "TFMessage 50": (1.5, None, 2),
}
COUNTERPARTS = {  # the genpy operation that corresponds to each operation
    "serialize": "serialize",
    "buffers": "serialize",
    "deserialize": "deserialize",
    "from bytes": "deserialize",
}


def string():
    from std_msgs.msg import String

    return String("0123456789abcdef")


def imu():
    from sensor_msgs.msg import Imu

    message = Imu()
    message.header.frame_id = "imu_link"
    message.orientation_covariance = [0.1 * i for i in range(9)]
    return message


def joint_state(name="joint"):
    from sensor_msgs.msg import JointState

    message = JointState()
    message.name = [f"{name}_{i}" for i in range(50)]
    message.position = [0.1 * i for i in range(50)]
    message.velocity = [0.2 * i for i in range(50)]
    message.effort = [0.3 * i for i in range(50)]
    return message


def two_joint_states():
    """Messages from two robots. pipros caches the last names that it read, but the names never repeat
    here.
    """
    return joint_state(), joint_state("wrist")


def image():
    from sensor_msgs.msg import Image

    message = Image(height=512, width=683, encoding="rgb8", step=2049, data=os.urandom(1 << 20))
    message.header.frame_id = "camera"
    return message


def point_cloud():
    from sensor_msgs.msg import PointCloud2, PointField

    fields = [PointField(name, 4 * i, 7, 1) for i, name in enumerate("xyz")]
    return PointCloud2(fields=fields, point_step=16, height=1, width=1 << 18, data=os.urandom(4 << 20))


def path():
    from geometry_msgs.msg import PoseStamped
    from nav_msgs.msg import Path

    message = Path()
    for i in range(1000):
        pose = PoseStamped()
        pose.header.frame_id = "map"
        pose.pose.position.x = 0.1 * i
        message.poses.append(pose)
    return message


def transforms():
    from geometry_msgs.msg import TransformStamped
    from tf2_msgs.msg import TFMessage

    message = TFMessage()
    for i in range(50):
        transform = TransformStamped()
        transform.header.frame_id = "odom"
        transform.child_frame_id = f"link_{i}"
        message.transforms.append(transform)
    return message


MAKERS = (string, imu, joint_state, two_joint_states, image, point_cloud, path, transforms)
CASES = dict(zip(TARGETS, MAKERS, strict=True))


def microseconds(action):
    """Return the best time for one call."""
    timer = timeit.Timer(action)
    number, _ = timer.autorange()
    number = max(1, number // 10)
    return min(timer.repeat(5, number)) / number * 1e6


def measure(names):
    return {name: measure_one(CASES[name]()) for name in names}


def measure_one(made):
    """Return the times for a message. Two messages are read in turn."""
    message, other = made if isinstance(made, tuple) else (made, None)
    cls = type(message)
    data = serialized(message)
    times = {"serialize": microseconds(lambda: message.serialize(io.BytesIO()))}
    if other is None:
        times["deserialize"] = microseconds(lambda: cls().deserialize(data))
    else:
        others = serialized(other)
        both = microseconds(lambda: (cls().deserialize(data), cls().deserialize(others)))
        times["deserialize"] = both / 2
    if hasattr(message, "_to_buffers"):
        times["buffers"] = microseconds(message._to_buffers)
        times["from bytes"] = microseconds(lambda: cls._from_bytes(data))
    return times


def serialized(message):
    buff = io.BytesIO()
    message.serialize(buff)
    return buff.getvalue()


def run(is_genuine, names):
    environment = {"PATH": "/usr/bin:/bin", "HOME": os.environ.get("HOME", "/")}
    options = [] if is_genuine else ["-S"]  # -S excludes Debian's packages, including genpy
    if not is_genuine:
        environment["PYTHONPATH"] = SOURCE_PATH
    command = [PYTHON, *options, os.path.abspath(__file__), "--measure", ",".join(names)]
    answer = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)  # noqa: S603
    return json.loads(answer.stdout)


def rows_of(rounds, names):
    """Return a row for each case and operation, with the required ratio."""
    taken = {True: [], False: []}
    for _ in range(rounds):
        for is_genuine, results in taken.items():
            results.append(run(is_genuine, names))
    rows = []
    for name in names:
        for (operation, counterpart), goal in zip(COUNTERPARTS.items(), (*TARGETS[name], None), strict=True):
            values = {
                "genuine": [times[name][counterpart] for times in taken[True]],
                "pipros": [times[name][operation] for times in taken[False]],
            }
            rows.append(Row(f"{operation} {name}: us", values, goal=goal, best=True))
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--only", default="", help="parts of case names, separated by commas")
    parser.add_argument("--json", help="also write the rows to this file")
    parser.add_argument("--measure", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.measure:
        if SOURCES in sys.path:
            import pipros.startup  # noqa: F401 # as pipros.pth does it
        json.dump(measure(arguments.measure.split(",")), sys.stdout)
        return
    wanted = arguments.only.split(",")
    names = [name for name in CASES if any(part in name for part in wanted)]
    rows = rows_of(arguments.rounds, names)
    print(markdown(rows, "wanted", verdict))
    if arguments.json:
        write_json(arguments.json, rows)


def verdict(row):
    return "" if row.goal is None else f"{row.goal} {'ok' if row.ratio() >= row.goal else 'MISSED'}"


if __name__ == "__main__":
    main()
