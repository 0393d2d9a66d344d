#!/usr/bin/env python3
"""Speed of the libraries built on rospy: pipros and the genuine libraries, in one run.

    script/bench libraries [--only tf,listener,filter,action,import] [--rounds 3] [--seconds 3]

The ratio is the factor by which pipros is better. Nothing else should be running; the load from other
programs is printed. If genuine ROS is not installed, only pipros is measured.
"""

import itertools
import random
import statistics
import time

from worlds import answer, compare, finish, imported_ms, init, one_process, say

FRAMES = 50
RATE_HZ = 100
GOALS = 100


# ---- workers: in their own processes


def per_operation(work, repetitions=3):
    """Return the median microseconds per operation of `work()`, which returns the number of operations."""
    taken = []
    for _ in range(repetitions):
        began = time.perf_counter()
        count = work()
        taken.append((time.perf_counter() - began) / count * 1e6)
    return statistics.median(taken)


def turned(parent, child, stamp, angle=0.0):
    """Return a transform with a rotation about z."""
    import math

    from geometry_msgs.msg import TransformStamped

    made = TransformStamped()
    made.header.stamp, made.header.frame_id, made.child_frame_id = stamp, parent, child
    made.transform.translation.x = 0.5
    made.transform.rotation.z, made.transform.rotation.w = math.sin(angle / 2), math.cos(angle / 2)
    return made


def worker_tf():
    import rospy
    import tf2_ros

    buffer = tf2_ros.Buffer(rospy.Duration(10), debug=False)
    sent = [
        turned(f"f{d}", f"f{d + 1}", rospy.Time(100 + i // 50, i % 50 * 20000000), 0.1 + i * 0.001)
        for i in range(500)
        for d in range(8)
    ]

    def insert():
        buffer.clear()
        for each in sent:
            buffer.set_transform(each, "benchmark")
        return len(sent)

    set_us = per_operation(insert)
    stamps = [rospy.Time.from_sec(random.Random(i).uniform(101, 109)) for i in range(1000)]  # noqa: S311
    for index in range(30):  # five arms of six moving links each
        parent = "f8" if index % 6 == 0 else f"link{index - 1}"
        for i in range(500):
            made = turned(parent, f"link{index}", rospy.Time(100 + i // 50, i % 50 * 20000000), i * 0.001)
            buffer.set_transform(made, "benchmark")
    look, can = buffer.lookup_transform, buffer.can_transform

    def ask(question, times, targets=("f8",)):
        asked = [(target, stamp) for stamp in times for target in targets]

        def work():
            for target, stamp in asked:
                question("f0", target, stamp)
            return len(asked)

        return per_operation(work)

    links = [f"link{index}" for index in range(30)]
    say(
        **{
            "set_transform: us": set_us,
            "lookup_transform over 8 frames, latest: us": ask(look, [rospy.Time(0)] * 1000),
            "lookup_transform over 8 frames, interpolated: us": ask(look, stamps),
            "lookup_transform over 8 frames, the same stamp again: us": ask(look, stamps[:1] * 1000),
            "lookup_transform of 30 links at one stamp: us per link": ask(look, stamps[:50], links),
            "can_transform over 8 frames: us": ask(can, stamps),
        }
    )


def worker_send_frames():
    """Publish a robot's transforms on /tf, all in one message."""
    from tf2_msgs.msg import TFMessage

    rospy = init("frames")
    publisher = rospy.Publisher("/tf", TFMessage, queue_size=100)
    names = [f"frame_{n}" for n in range(FRAMES + 1)]
    rate, turn = rospy.Rate(RATE_HZ), 0
    say(ready=True)
    while not rospy.is_shutdown():
        turn += 1
        now = rospy.Time.now()
        publisher.publish([turned(names[n], names[n + 1], now, 0.001 * turn) for n in range(FRAMES)])
        rate.sleep()


def worker_listener(seconds):
    """Print the processor time that a TransformListener uses, in percent of the elapsed time."""
    rospy = init("listener")
    import tf2_ros

    buffer = tf2_ros.Buffer()
    listener = tf2_ros.TransformListener(buffer)
    while not buffer.can_transform("frame_0", f"frame_{FRAMES}", rospy.Time(0)):
        time.sleep(0.02)
    time.sleep(0.3)
    cpu, began = time.process_time(), time.monotonic()
    time.sleep(seconds)
    used, passed = time.process_time() - cpu, time.monotonic() - began
    assert rospy.Time.now() - buffer.get_latest_common_time("frame_0", f"frame_{FRAMES}") < rospy.Duration(10)
    listener.unregister()
    say(percent=100 * used / passed)


def worker_filter():
    init("filter")
    from sensor_msgs.msg import Imu

    import message_filters
    import rospy

    def fed(kind, *slop):
        """Return the time of a filter whose inputs get messages with equal, or similar, stamps."""
        inputs = [message_filters.SimpleFilter() for _ in range(3)]
        made, seen, begin = getattr(message_filters, kind)(inputs, 10, *slop), [], itertools.count(100, 100)
        made.registerCallback(lambda *_: seen.append(1))

        def feed():
            start = next(begin)
            for i in range(2000):
                for k, one in enumerate(inputs):
                    message = Imu()
                    late = k * 1000000 if slop else 0
                    message.header.stamp = rospy.Time(start + i // 100, i % 100 * 10000000 + late)
                    one.signalMessage(message)
            return 6000

        taken = per_operation(feed)
        assert seen
        return {f"{kind}, 3 inputs: us per message": taken}

    say(**fed("TimeSynchronizer"), **fed("ApproximateTimeSynchronizer", 0.005))


def action_server():
    import actionlib
    from actionlib.msg import TestAction

    server = actionlib.SimpleActionServer(
        "go", TestAction, lambda _: server.set_succeeded(), auto_start=False
    )
    server.start()
    return server


def worker_action_server():
    rospy = init("server")
    server = action_server()  # noqa: F841 # which keeps it
    say(ready=True)
    rospy.spin()


def worker_action_client(alone):
    rospy = init("client")
    import actionlib
    from actionlib.msg import TestAction, TestGoal

    server = action_server() if alone else None  # noqa: F841
    client = actionlib.SimpleActionClient("go", TestAction)
    client.wait_for_server()
    client.send_goal_and_wait(TestGoal(1), rospy.Duration(5))
    # Goals in genuine actionlib take either a millisecond or a tenth of a second, so only the mean is
    # meaningful.
    began = time.perf_counter()
    for number in range(GOALS):
        client.send_goal_and_wait(TestGoal(number), rospy.Duration(5))
    say(mean=(time.perf_counter() - began) / GOALS * 1e3)


# ---- the driver


def listener(world, seconds):
    sender = world.start(__file__, "send_frames")
    answer(sender)
    try:
        label = f"tf listener, {FRAMES} frames at {RATE_HZ} Hz: % of a processor"
        return {label: one_process(world, __file__, "listener", seconds)["percent"]}
    finally:
        finish(sender)


def action(world, _seconds):
    one = one_process(world, __file__, "action_client", True)["mean"]
    server = world.start(__file__, "action_server")
    answer(server)
    try:
        two = one_process(world, __file__, "action_client", False)["mean"]
    finally:
        finish(server)
    return {"send_goal_and_wait, one process: ms": one, "send_goal_and_wait, two processes: ms": two}


def imports(world, _seconds):
    return {
        f"import {name}, whole process: ms": min(imported_ms(world, name) for _ in range(5))
        for name in ("tf2_ros", "actionlib")
    }


def alone(role):
    return lambda world, _seconds: one_process(world, __file__, role)


WORKLOADS = {
    "tf": alone("tf"), "listener": listener, "filter": alone("filter"), "action": action, "import": imports
}  # fmt: skip


if __name__ == "__main__":
    compare(__doc__, WORKLOADS, globals(), seconds=3.0)
