#!/usr/bin/env python3
"""How fast `rosbag convert` converts many bags: MB of input per second of processor time.

    .venv/bin/python packages/pipros/benchmarks/bag_convert.py [--megabytes 100]

Two bags, of clouds, images and IMU messages in the proportion of a driving robot, are converted with two
processes. Processor time is used, because other load does not affect it much.
"""

import argparse
import contextlib
import io
import os
import resource
import tempfile
import time

FORMS = {
    "bag to MCAP, not compressed": ("bag", ["--compression", "none"]),
    "bag to MCAP, zstd": ("bag", []),
    "bag to ROS 2, MCAP, not compressed": ("bag", ["--ros2", "jazzy", "--compression", "none"]),
    "bag to ROS 2, SQLite": ("bag", ["--ros2", "jazzy", "--storage", "sqlite3"]),
    "MCAP to bag": ("mcap", []),
}


def write(path, megabytes):
    from sensor_msgs.msg import Image, Imu, PointCloud2

    import rosbag
    import rospy

    rest = megabytes * 1_000_000
    cloud = PointCloud2(width=20000, height=1, point_step=16, row_step=320000, data=os.urandom(320000))
    image = Image(width=640, height=480, encoding="rgb8", step=1920, data=os.urandom(921600))
    with rosbag.Bag(path, "w") as bag:
        tick = 0
        while rest > 0:
            tick += 1
            time = rospy.Time(100 + tick // 10, tick % 10 * 10**8)
            bag.write("/camera", image, time)
            bag.write("/cloud", cloud, time)
            for _ in range(10):
                bag.write("/imu", Imu(), time)
            rest -= len(image.data) + len(cloud.data) + 10 * 320


def processor_s():
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)


def main():
    from pipros_tools.cli.rosbag import main as rosbag

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--megabytes", type=int, default=100)
    size = parser.parse_args().megabytes
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for name in ("a.bag", "b.bag"):
            write(name, size)
        print("| conversion | MB per second of processor time | seconds |\n| --- | ---: | ---: |")
        for name, (suffix, options) in FORMS.items():
            before, began = processor_s(), time.monotonic()
            sources = [f"mcap/{each}.mcap" if suffix == "mcap" else f"{each}.bag" for each in "ab"]
            target = "mcap" if name == "bag to MCAP, zstd" else name.replace(" ", "_")
            with contextlib.redirect_stdout(io.StringIO()):
                code = rosbag(["convert", "--jobs", "2", "--output-dir", target, *options, *sources])
            if code:
                raise SystemExit(f"{name}: exit code {code}")
            used = processor_s() - before
            print(f"| {name} | {2 * size / used:.0f} | {time.monotonic() - began:.1f} |")


if __name__ == "__main__":
    main()
