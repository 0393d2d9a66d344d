"""Print as JSON the results of tf2_py for invalid transforms and queries.

Arguments: a seed and a number, which change nothing. Runs under either implementation. Times before zero, and
those after 2106, are left out: they end the process of genuine tf2_py.
"""

import itertools
import json
import math
import os
import sys

from examine_buffer import outcome
from geometry_msgs.msg import TransformStamped

import rospy
import tf2_py

QUATERNIONS = [
    (0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 2.0), (0.0, 0.0, 0.0, -1.0), (0.5, 0.5, 0.5, 0.5),
    (0.0, 0.0, math.nan, 1.0), (0.0, math.inf, 0.0, 1.0), (1e-200, 0.0, 0.0, 1.0), (1e200, 0.0, 0.0, 0.0),
]  # fmt: skip
NUMBERS = [0.0, math.nan, -1e308, 1e308]
FRAMES = ["a", "/a", "//a", "", "/", "a/b", " ", "ä", "a" * 3000]


TIMES = [rospy.Time(0), rospy.Time(5)]


def transform(parent="a", child="b", time=TIMES[1], x=1.0, q=(0.0, 0.0, 0.0, 1.0)):
    message = TransformStamped()
    message.header.frame_id, message.child_frame_id, message.header.stamp = parent, child, time
    message.transform.translation.x = x
    rotation = message.transform.rotation
    rotation.x, rotation.y, rotation.z, rotation.w = q
    return message


def told(*messages, is_static=False):
    """Return the contents of a buffer after some transforms were set."""
    buffer = tf2_py.BufferCore(rospy.Duration(10))
    insert = buffer.set_transform_static if is_static else buffer.set_transform
    answers = [outcome(insert, message, "me") for message in messages]
    answers.append(sorted(buffer._getFrameStrings()))
    answers.append(outcome(buffer.lookup_transform_core, "a", "b", rospy.Time(0)))
    return answers


def main():
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # tf2 prints there what it refuses
    answers = [told(transform(q=q)) for q in QUATERNIONS]
    answers += [told(transform(x=x)) for x in NUMBERS]
    answers += [told(transform(parent, child)) for parent, child in itertools.product(FRAMES, FRAMES)]
    answers += [told(transform(time=time), is_static=static) for time in TIMES for static in (False, True)]
    answers.append(told(transform("a", "b"), transform("b", "a")))
    answers.append(told(transform("a", "b"), transform("b", "c"), transform("c", "a"), is_static=True))
    buffer = tf2_py.BufferCore()
    buffer.set_transform(transform(), "me")
    for target, source, time in itertools.product(FRAMES, FRAMES, TIMES):
        answers.append(outcome(buffer.lookup_transform_core, target, source, time))
        answers.append(outcome(buffer.can_transform_core, target, source, time))
    json.dump(answers, sys.stdout)


if __name__ == "__main__":
    main()
