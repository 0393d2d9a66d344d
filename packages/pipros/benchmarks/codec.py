#!/usr/bin/env python3
"""Time to write and read messages: pipros and genuine genpy, in one run.

    script/bench codec [--rounds 3] [--only Image,Path]

The best round counts, so that other load affects both alike. "buffers" and "from bytes" are the methods that
pipros's transport calls, compared with genpy's `serialize` and `deserialize`.
"""

import functools
import io
import timeit

from worlds import compare, message, one_process, say

COUNTERPARTS = {  # the genpy operation that corresponds to each operation
    "serialize": "serialize",
    "buffers": "serialize",
    "deserialize": "deserialize",
    "from bytes": "deserialize",
}


def joint_state(name="joint"):
    from sensor_msgs.msg import JointState

    numbers = {field: [step * i for i in range(50)] for field, step in STEPS.items()}
    return JointState(name=[f"{name}_{i}" for i in range(50)], **numbers)


def two_joint_states():
    """Messages from two robots. pipros caches the last names that it read, but here they never repeat."""
    return joint_state(), joint_state("wrist")


def path():
    from geometry_msgs.msg import PoseStamped
    from nav_msgs.msg import Path

    message = Path(poses=[PoseStamped() for _ in range(1000)])
    for i, each in enumerate(message.poses):
        each.header.frame_id, each.pose.position.x = "map", 0.1 * i
    return message


def transforms():
    from geometry_msgs.msg import TransformStamped
    from tf2_msgs.msg import TFMessage

    message = TFMessage([TransformStamped(child_frame_id=f"link_{i}") for i in range(50)])
    for each in message.transforms:
        each.header.frame_id = "odom"
    return message


STEPS = {"position": 0.1, "velocity": 0.2, "effort": 0.3}
CASES = {
    "String 16 B": functools.partial(message, "string"),
    "Imu": functools.partial(message, "imu"),
    "JointState 50": joint_state,
    "JointState 50 from two robots": two_joint_states,
    "Image 1 MB": functools.partial(message, "image"),
    "PointCloud2 4 MB": functools.partial(message, "cloud"),
    "Path 1000": path,
    "TFMessage 50": transforms,
}


def microseconds(action):
    """Return the best time for one call."""
    timer = timeit.Timer(action)
    number, _ = timer.autorange()
    number = max(1, number // 10)
    return min(timer.repeat(5, number)) / number * 1e6


def worker_times(name):
    """Say the times for a message. Two messages are read in turn."""
    made = CASES[name]()
    one, other = made if isinstance(made, tuple) else (made, made)
    cls, data, others = type(one), serialized(one), serialized(other)
    times = {"serialize": microseconds(lambda: one.serialize(io.BytesIO()))}
    if other is one:
        times["deserialize"] = microseconds(lambda: cls().deserialize(data))
    else:
        times["deserialize"] = microseconds(lambda: (cls().deserialize(data), cls().deserialize(others))) / 2
    if hasattr(one, "_to_buffers"):
        times["buffers"] = microseconds(one._to_buffers)
        times["from bytes"] = microseconds(lambda: cls._from_bytes(data))
    say(**times)


def serialized(message):
    buff = io.BytesIO()
    message.serialize(buff)
    return buff.getvalue()


def measure(name, world, _seconds):
    times = one_process(world, __file__, "times", name)
    return {
        f"{operation} {name}: us": times.get(operation, times[counterpart])
        for operation, counterpart in COUNTERPARTS.items()
    }


if __name__ == "__main__":
    compare(__doc__, {name: functools.partial(measure, name) for name in CASES}, globals(), best=True)
