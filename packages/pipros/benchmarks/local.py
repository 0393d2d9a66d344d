#!/usr/bin/env python3
"""Large messages between nodes on one machine: TCP, shared memory, and subscribers without a copy.

    script/bench local [--only windows,rates] [--rounds 10] [--seconds 1] [--windows 1,2,3,4,8,16] [--stuck 1]

`windows`: messages/s of 1 MB images with `queue_size=50`, of which the publisher is at most *w* ahead of the
subscriber's acknowledgements: the median, the slowest and the fastest run, and the processor time of both
nodes for each message. `--stuck` adds subscribers that never return from their callback. `rates`: the same
processor time for images that are published at 20 and 100 Hz. The variants follow each other within each
round. "off" is PIPROS_LOCAL=off. A run that loses a message on the way to the subscriber ends the benchmark.
`script/bench local --only windows --windows 16 --variants shared --rounds 1 --seconds 600 --stuck 1` is a
soak. The last row shows whether the host moved the processors apart: copies then take 18 times as long.
"""

import json
import mmap
import os
import statistics
import sys
import threading
import time

from table import Load, heed_interrupts, line, options_of
from worlds import World, answer, finish, init, message, say

STEADY_S = 0.3

# ---- workers: in their own processes, with the public rospy API only


def worker_source(window, rate, seconds, peers):
    """Publish for a while, then print the numbers of messages and the processor time."""
    rospy = init("source")
    from std_msgs.msg import Empty, Int32

    msg, acked, more = message("image"), [0], threading.Event()
    publisher = rospy.Publisher("flow", type(msg), queue_size=50)
    end = rospy.Publisher("end", Int32, queue_size=1, latch=True)
    begin = rospy.Publisher("begin", Empty, queue_size=1, latch=True)

    def on_ack(ack):
        acked[0] = ack.data
        more.set()

    rospy.Subscriber("ack", Int32, on_ack, tcp_nodelay=True)
    while publisher.get_num_connections() < peers or begin.get_num_connections() < 1:
        time.sleep(0.01)
    time.sleep(STEADY_S)
    sent, warm = 0, 1
    while sent < warm:
        publisher.publish(msg)
        sent += 1
        while acked[0] < sent:
            time.sleep(0.001)
    time.sleep(STEADY_S)
    begin.publish()
    began, cpu = time.monotonic(), time.process_time()
    while time.monotonic() < began + seconds:
        if rate:
            time.sleep(max(0.0, began + (sent - warm) / rate - time.monotonic()))
        more.clear()
        if sent - acked[0] >= window:
            more.wait(1.0)
            continue
        publisher.publish(msg)
        sent += 1
    cpu = time.process_time() - cpu
    while acked[0] < sent and time.monotonic() < began + seconds + 10:
        time.sleep(0.001)
    end.publish(sent)
    say(sent=sent - warm, lost=sent - acked[0], cpu=cpu, took=time.monotonic() - began)
    sys.stdin.read()


def worker_sink(zero_copy):
    """Acknowledge messages until the source announces its end."""
    rospy = init("sink")
    from std_msgs.msg import Empty, Int32

    seen, ended, cpu = [0], threading.Event(), [0.0]
    ack = rospy.Publisher("ack", Int32, queue_size=10)

    def on_begin(_):
        cpu[0] = time.process_time()

    def on_message(msg):
        msg.data[-1]
        seen[0] += 1
        ack.publish(seen[0])

    rospy.Subscriber("begin", Empty, on_begin)
    rospy.Subscriber("end", Int32, lambda _: ended.set())
    rospy.Subscriber("flow", type(message("image")), on_message, **({"zero_copy": True} if zero_copy else {}))
    ended.wait()
    say(cpu=time.process_time() - cpu[0])
    sys.stdin.read()


def worker_stuck():
    rospy = init("stuck")
    rospy.Subscriber("flow", type(message("image")), lambda _: time.sleep(1e6))
    sys.stdin.read()


# ---- the driver


def flow(world, zero_copy, window, rate, seconds, stuck):
    """Return messages/s, and the processor time in us for each message."""
    nodes = [world.start(__file__, "sink", zero_copy)]
    nodes += [world.start(__file__, "stuck") for _ in range(stuck)]
    nodes.append(world.start(__file__, "source", window, rate, seconds, len(nodes)))
    sent, seen = answer(nodes[-1]), answer(nodes[0])
    for process in nodes:
        finish(process)
    if sent["lost"]:
        raise SystemExit(f"{sent['lost']} of {sent['sent']} messages did not arrive")
    return sent["sent"] / sent["took"], (sent["cpu"] + seen["cpu"]) / sent["sent"] * 1e6


def copies(seconds=0.1, window=2, size=10**6):
    """Return how often a second one process copies 1 MB into shared memory, and another one out of it."""
    slots, counts = memoryview(mmap.mmap(-1, window * size)), memoryview(mmap.mmap(-1, 24)).cast("q")
    sent, end, given = 0, time.monotonic() + seconds, bytearray(size)
    reader = os.fork()
    while counts[2] == 0:
        if reader == 0 and counts[1] < counts[0]:
            slot = counts[1] % window * size
            given[:] = slots[slot : slot + size]
            counts[1] += 1
        elif reader and sent < counts[1] + window:
            slot = sent % window * size
            slots[slot : slot + size] = given
            sent += 1
            counts[0] = sent
        counts[2] |= reader and time.monotonic() > end
    if reader == 0:
        os._exit(0)
    os.waitpid(reader, 0)
    return sent / seconds


def main():
    more = {"windows": "1,2,3,4,8,16", "variants": "off,shared,zero copy", "stuck": 0, "worker": ""}
    options = options_of(__doc__, only="windows,rates", rounds=10, seconds=1.0, **more)
    if options.worker:
        role, *arguments = json.loads(options.worker)
        globals()[f"worker_{role}"](*arguments)
        return
    heed_interrupts()
    cases = []
    if "windows" in options.only:
        cases += [(f"window {window}: messages/s", int(window), 0) for window in options.windows.split(",")]
    if "rates" in options.only:
        cases += [(f"{rate} Hz", 50, rate) for rate in (20, 100)]
    names = options.variants.split(",")
    load, copied = Load(), []
    worlds = {
        name: World(name, sys.executable, {"PIPROS_LOCAL": "off"} if name == "off" else {}) for name in names
    }
    print(line(["1 MB images", *names]) + "\n" + line(["---", *["---:"] * len(names)]))
    try:
        for label, window, rate in cases:
            runs = {name: [] for name in names}
            for _ in range(options.rounds):
                copied.append(copies())
                for name in names:
                    arguments = (name == "zero copy", window, rate, options.seconds, options.stuck)
                    runs[name].append(flow(worlds[name], *arguments))
            cells = []
            for values in runs.values():
                rates, used = zip(*values)  # noqa: B905 # Python 3.8
                text = f"{statistics.median(rates):,.0f} ({min(rates):,.0f} to {max(rates):,.0f}), "
                cells.append(text * (not rate) + f"{statistics.median(used):,.0f} us")
            print(line([label, *cells]), flush=True)
    finally:
        for world in worlds.values():
            world.close()
    print(line(["two processes that only copy: messages/s", f"{min(copied):,.0f} to {max(copied):,.0f}"]))
    print(f"\n{options.rounds} runs; others used {load.percent():.0f} % of the machine, its workers included")


if __name__ == "__main__":
    main()
