#!/usr/bin/env python3
"""Time to write, open and read bags: pipros and genuine rosbag, in one run.

    script/bench bags [--rounds 3] [--only none,index]

Each implementation runs in its own Python, on the disk of TMPDIR. They alternate, round by round, and the
best round of each counts, so that other load affects both alike.
"""

import functools
import os
import tempfile
import time

from worlds import compare, one_process, say

PARTS = ("none", "bz2", "lz4", "images", "index")


def timed(work):
    """Return the microseconds per operation of `work()`, which returns the number of operations."""
    start = time.perf_counter()
    count = work()
    return (time.perf_counter() - start) / count * 1e6


def write(path, topics, message, count, compression="none"):
    import rosbag
    import rospy

    def work():
        with rosbag.Bag(path, "w", compression=compression) as bag:
            for i in range(count):
                stamp = rospy.Time(100 + i // 1000, i % 1000 * 1000000)
                bag.write(topics[i % len(topics)], message, stamp)
        return count

    return work


def read(path, **options):
    import rosbag

    def work():
        with rosbag.Bag(path) as bag:
            return sum(1 for _ in bag.read_messages(**options))

    return work


def count_messages(path):
    import rosbag

    with rosbag.Bag(path) as bag:
        return min(1, bag.get_message_count())


def figures_of(part, folder):
    """Return one part's figures by name."""
    from sensor_msgs.msg import Image, Imu
    from std_msgs.msg import String

    import rospy

    path = os.path.join(folder, part + ".bag")
    if part == "images":
        figures = {}
        # random bytes cannot be compressed, and steps of brightness can
        for suffix, data in (("", os.urandom(921600)), (", lz4", bytes(range(256)) * 3600)):
            image = Image(height=480, width=640, encoding="rgb8", step=1920, data=data)
            compression = suffix.removeprefix(", ") or "none"
            path = os.path.join(folder, f"{compression}.bag")  # emptying the other bag would take its time
            figures["write Image 0.9 MB" + suffix] = timed(write(path, ["/camera"], image, 100, compression))
            figures["read Image 0.9 MB" + suffix] = timed(read(path))
        return figures
    if part == "index":
        topics = [f"/imu{i}" for i in range(20)]
        figures = {"write Imu, 20 topics": timed(write(path, topics, Imu(), 200000))}
        span = {"start_time": rospy.Time(150), "end_time": rospy.Time(250)}
        figures["open, 200,000 messages"] = timed(lambda: count_messages(path))
        figures["read raw Imu"] = timed(read(path, raw=True))
        figures["read one of 20 topics, half of the time range"] = timed(read(path, topics=["/imu7"], **span))
        return figures
    return {
        "write String, compression " + part: timed(
            write(path, ["/chatter"], String("message number 1"), 20000, part)
        ),
        "read String, compression " + part: timed(read(path)),
    }


def worker_bag(part):
    with tempfile.TemporaryDirectory() as folder:
        say(**{f"bag: {name}: us": value for name, value in figures_of(part, folder).items()})


def measure(part, world, _seconds):
    return one_process(world, __file__, "bag", part)


if __name__ == "__main__":
    workloads = {part: functools.partial(measure, part) for part in PARTS}
    compare(__doc__, workloads, globals(), best=True)
