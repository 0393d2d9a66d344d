#!/usr/bin/env python3
"""Workloads with scarce processors or busy threads: pipros and genuine rospy, in one run.

    benchmarks/contended.py [--only crowd,pinned,cpu,publisher,stream] [--rounds 3] [--seconds 2]

As in benchmarks/client.py, each workload is one script that uses the public rospy API and is run with each
implementation in turn.
"""

import statistics
import subprocess
import sys
import time

from worlds import answer, compare, finish, init, message, say

PUBLISHERS = 10
SUBSCRIBERS = 10
RATE_HZ = 200
STREAM_HZ = 25_000


# ---- workers: in their own processes, with the public rospy API only


def worker_source(seconds):
    """Publish without a pause."""
    rospy = init("source")
    msg = message("string")
    publisher = rospy.Publisher("flow", type(msg), queue_size=None)
    while not publisher.get_num_connections():
        time.sleep(0.01)
    say(ready=True)
    sys.stdin.readline()
    stop = time.monotonic() + seconds
    while time.monotonic() < stop:
        for _ in range(10):
            publisher.publish(msg)
    say(ended=True)
    sys.stdin.read()


def worker_paced(rate_hz, seconds, peers, pause_s=0.0005):
    """Publish at a rate. Above 1 / `pause_s`, messages are sent in groups. If `pause_s` is 0, they are evenly
    spaced, and the process fully uses one processor.
    """
    rospy = init("paced")
    msg = message("string")
    publisher = rospy.Publisher("flow", type(msg), queue_size=1000)
    while publisher.get_num_connections() < peers:
        time.sleep(0.01)
    say(ready=True)
    sys.stdin.readline()
    began, sent = time.monotonic(), 0
    while (passed := time.monotonic() - began) < seconds:
        while sent < passed * rate_hz:
            publisher.publish(msg)
            sent += 1
        if pause_s:
            time.sleep(max(sent / rate_hz - (time.monotonic() - began), pause_s))
    say(sent=sent)
    sys.stdin.read()


def worker_sink():
    """Count messages, and measure processor time, between the first message and a line of input."""
    rospy = init("sink")
    seen, first, last = [0], [0.0, 0.0], [0.0, 0.0]

    def on_message(_):
        seen[0] += 1
        if seen[0] == 1:
            first[:] = time.monotonic(), time.process_time()
        last[0] = time.monotonic()

    rospy.Subscriber("flow", type(message("string")), on_message)
    sys.stdin.readline()
    cpu = time.process_time() - first[1]
    say(
        seen=seen[0],
        rate=(seen[0] - 1) / max(last[0] - first[0], 1e-9),
        cpu=cpu,
    )


def worker_publisher():
    rospy = init("creator")
    from std_msgs.msg import String

    taken = []
    for number in range(300):
        began = time.perf_counter()
        rospy.Publisher(f"topic_{number}", String, queue_size=1)
        taken.append(time.perf_counter() - began)
    say(median=statistics.median(taken) * 1e3)


# ---- the driver


def tell(process):
    process.stdin.write("\n")
    process.stdin.flush()


def crowd(world, seconds):
    sink = world.start(__file__, "sink")
    sources = [world.start(__file__, "source", seconds) for _ in range(PUBLISHERS)]
    for source in sources:
        answer(source)
    for source in sources:
        tell(source)
    for source in sources:
        answer(source)
    tell(sink)
    rate = answer(sink)["rate"]
    for process in (*sources, sink):
        finish(process)
    return {f"{PUBLISHERS} processes to 1, without pauses, 16 B: messages/s": rate}


def paced(world, seconds, rate_hz, peers, *pause_s):
    """Return the microseconds of processor time that a subscriber uses per message."""
    sinks = [world.start(__file__, "sink") for _ in range(peers)]
    source = world.start(__file__, "paced", rate_hz, seconds, peers, *pause_s)
    answer(source)
    tell(source)
    answer(source)
    found = []
    for sink in sinks:
        tell(sink)
        found.append(answer(sink))
    for process in (source, *sinks):
        finish(process)
    return statistics.median(sink["cpu"] / max(sink["seen"], 1) for sink in found) * 1e6


def cpu(world, seconds):
    label = f"subscriber at {RATE_HZ} Hz, one of {SUBSCRIBERS}: us of processor time per message"
    return {label: paced(world, seconds, RATE_HZ, SUBSCRIBERS)}


def stream(world, seconds):
    label = f"subscriber at {STREAM_HZ:,} Hz"
    return {
        f"{label}, in groups: us of processor time per message": paced(world, seconds, STREAM_HZ, 1),
        f"{label}, evenly spaced: us of processor time per message": paced(world, seconds, STREAM_HZ, 1, 0),
    }


def pinned(world, seconds):
    """Measure a round trip with both ends on one processor."""
    pair = [world.work("echo", "string", 10), world.work("trip", "string", 10, seconds)]
    for process in pair:
        subprocess.run(["taskset", "-acp", "0", str(process.pid)], stdout=subprocess.DEVNULL, check=True)
    median = answer(pair[1])["median"]
    for process in reversed(pair):
        finish(process)
    return {"round trip 16 B, both ends on one processor: us": median * 1e6}


def publisher(world, _seconds):
    process = world.start(__file__, "publisher")
    value = answer(process)["median"]
    finish(process)
    return {"Publisher(): ms": value}


WORKLOADS = {"crowd": crowd, "pinned": pinned, "cpu": cpu, "publisher": publisher, "stream": stream}


if __name__ == "__main__":
    compare(__doc__, WORKLOADS, globals(), seconds=2.0)
