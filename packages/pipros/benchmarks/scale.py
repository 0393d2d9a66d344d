#!/usr/bin/env python3
"""Cost over scale of rospy and the master: pipros and genuine ROS, in one run.

    script/bench scale [--only size,subscribers,topics,nodes] [--rounds 3] [--seconds 2] [--svg FILE]

Processor time is that of whole processes, while messages are sent at a rate that both implementations reach;
a lost message is an error. `--svg` draws a chart. `--quick` measures the smaller half of each scale.
"""

import contextlib
import functools
import math
import os
import signal
import subprocess
import sys
import threading
import time
from xml.sax.saxutils import escape

from table import as_text
from worlds import answer, compare, finish, init, say

WORKER_S = 300  # no worker lives longer
END_S = 20  # time to unregister and end, before a worker is terminated
SETTLE_S = 0.3
WARM_UP, LEAST = 5, 20  # messages
BYTES = 1000  # of a message in the scale of subscribers
RATE_HZ = 50


# ---- workers: in their own processes, with the public rospy API only


def worker_source(size, count, rate_hz, peers):
    """Publish some messages to warm up, then `count` messages, evenly spaced."""
    rospy = init("source")
    from std_msgs.msg import UInt8MultiArray

    msg = UInt8MultiArray(data=os.urandom(size))
    publisher = rospy.Publisher("flow", UInt8MultiArray, queue_size=count)
    while publisher.get_num_connections() < peers:
        time.sleep(0.01)
    for number in (WARM_UP, count):
        began = time.monotonic()
        for sent in range(1, number + 1):
            publisher.publish(msg)
            time.sleep(max(began + sent / rate_hz - time.monotonic(), 0))
        say(sent=number)
        if number == WARM_UP:
            sys.stdin.readline()


def worker_sink(size, count):
    """Count messages. After a line of input, wait until all have arrived, and print their number."""
    rospy = init("sink")
    from std_msgs.msg import UInt8MultiArray

    seen, complete = [0], threading.Event()

    def on_message(msg):
        seen[0] += len(msg.data) == size
        if seen[0] == count + WARM_UP:
            complete.set()

    rospy.Subscriber("flow", UInt8MultiArray, on_message)
    sys.stdin.readline()
    complete.wait(END_S)
    say(seen=seen[0] - WARM_UP)


def worker_advertiser(count):
    """Print the time for creating publishers, then wait until each has a subscriber."""
    rospy = init("advertiser")
    from std_msgs.msg import String

    say(ready=True)
    sys.stdin.readline()
    began = time.perf_counter()
    publishers = [rospy.Publisher(f"topic_{number}", String, queue_size=1) for number in range(count)]
    say(took=time.perf_counter() - began)
    for publisher in publishers:
        while not publisher.get_num_connections():
            time.sleep(0.001)
    say(connected=True)


def worker_subscriber(count):
    rospy = init("subscriber")
    from std_msgs.msg import String

    say(ready=True)
    sys.stdin.readline()
    for number in range(count):
        rospy.Subscriber(f"topic_{number}", String, lambda _: None)


def worker_member(number):
    """Use topics as robots do: one that all nodes publish, one that all subscribe to, and a private one."""
    rospy = init("member")
    from std_msgs.msg import String

    publishing = ["report", f"own_{number}"] + ["order"] * (number == 0)
    for topic in publishing:
        rospy.Publisher(topic, String, queue_size=1)
    for topic in ["order"] + ["report"] * (number == 0):
        rospy.Subscriber(topic, String, lambda _: None)
    say(ready=True)


def worker_part(role, *arguments):
    """Run another worker, and unregister its node at the end of the input."""
    signal.alarm(WORKER_S)
    globals()[f"worker_{role}"](*arguments)
    sys.stdin.read()
    import rospy

    rospy.signal_shutdown("measured")


# ---- the driver


@contextlib.contextmanager
def workers(world):
    """Yield a function that starts a worker. At the end all workers unregister; after an error or Ctrl-C,
    they are terminated.
    """
    processes = []

    def start(role, *arguments):
        processes.append(world.start(__file__, "part", role, *arguments))
        return processes[-1]

    try:
        yield start
        for process in processes:
            process.stdin.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            for process in processes:
                process.wait(END_S)
    finally:
        finish(*processes)


def tell(process):
    process.stdin.write("\n")
    process.stdin.flush()


def processor_s(process):
    """Return the processor time that a process has used, with all its threads."""
    return time.clock_gettime(~process.pid << 3 | 2)  # the clock that clock_getcpuclockid(3) of Linux returns


def flow(world, seconds, size, rate_hz, peers):
    """Return the processor time per message, in us, of the publisher and of all subscribers."""
    count = max(int(rate_hz * seconds), LEAST)
    with workers(world) as start:
        sinks = [start("sink", size, count) for _ in range(peers)]
        source = start("source", size, count, rate_hz, peers)
        answer(source)
        time.sleep(SETTLE_S)
        before = [processor_s(process) for process in (source, *sinks)]
        tell(source)
        answer(source)
        for sink in sinks:
            tell(sink)
        seen = [answer(sink)["seen"] for sink in sinks]
        if seen != [count] * peers:
            raise SystemExit(
                f"{world.name}: of {count} messages of {size} bytes at {rate_hz} Hz, {seen} arrived"
            )
        used = [processor_s(process) - was for process, was in zip((source, *sinks), before, strict=True)]
    return used[0] / count * 1e6, sum(used[1:]) / count * 1e6


def by_size(size, world, seconds):
    rate_hz = 100 if size <= 32_000 else 20 if size <= 1_000_000 else 5
    label = f"message of {in_bytes(size)} at {rate_hz} Hz: us of processor time, both ends"
    return {label: sum(flow(world, seconds, size, rate_hz, 1))}


def by_subscribers(peers, world, seconds):
    label = f"subscribers, {peers}, 1 kB at {RATE_HZ} Hz: us of the publisher's processor time per message"
    return {label: flow(world, seconds, BYTES, RATE_HZ, peers)[0]}


def by_topics(count, world, _seconds):
    """Return the time until a second node is connected to all topics of a node, and the part to advertise."""
    with workers(world) as start:
        pair = start("advertiser", count), start("subscriber", count)
        for process in pair:
            answer(process)
        tell(pair[0])
        advertised = answer(pair[0])["took"]
        began = time.perf_counter()
        tell(pair[1])
        answer(pair[0])
        connected = time.perf_counter() - began
    return {
        f"topics, {count}: s until advertised and connected": advertised + connected,
        f"topics, {count}: s until advertised": advertised,
    }


def by_nodes(count, world, _seconds):
    with workers(world) as start:
        before = processor_s(world.master)
        for member in [start("member", number) for number in range(count)]:
            answer(member)
        time.sleep(SETTLE_S)
    used = processor_s(world.master) - before
    return {f"nodes, {count} at once: ms of the master's processor time per node": used / count * 1e3}


def short(count):
    """Return a number with three zeros, or six, as a letter: 32_000 as 32k."""
    return f"{count // 10**6}M" if count >= 10**6 else f"{count // 1000}k" if count >= 1000 else str(count)


def in_bytes(count):
    return short(count).rstrip("kM") + {"k": " kB", "M": " MB"}.get(short(count)[-1], " B")


#: For each scale: a function that returns figures by label for a point; the points; the titles in the chart,
#: which shows the first figure.
SCALES = {
    "size": (
        by_size, (16, 1_000, 32_000, 1_000_000, 8_000_000),
        "Message size", "processor time of both ends (us)", "size of each message (bytes)",
    ),
    "subscribers": (
        by_subscribers, (1, 2, 4, 8, 16),
        "Subscribers", "publisher's time per message (us)", f"subscribers, 1 kB at {RATE_HZ} Hz (count)",
    ),
    "topics": (
        by_topics, (1, 10, 100, 500),
        "Topics", "time until all are connected (s)", "topics between two nodes (count)",
    ),
    "nodes": (
        by_nodes, (1, 4, 16, 32), "Nodes", "master's time per node (ms)", "nodes that start together (count)"
    ),
}  # fmt: skip
WORKLOADS = {
    f"{name} {point}": functools.partial(scale[0], point)
    for name, scale in SCALES.items()
    for point in scale[1]
}
QUICK = {
    f"{name} {point}" for name, scale in SCALES.items() for point in scale[1][: (len(scale[1]) + 1) // 2]
}


# ---- the chart

WIDTH, HEIGHT, LEFT, TOP, BOTTOM = 960, 260, 24, 78, 200
STYLE = """
svg { color: #1c2733; font: 11px ui-sans-serif, system-ui, sans-serif; }
.ground { fill: #ffffff; }
text, circle { fill: currentColor; }
.title { font-size: 14px; font-weight: 600; }
polyline { stroke: currentColor; stroke-width: 2; fill: none; }
polyline.genuine { stroke-dasharray: 5 3; }
.genuine { color: #b4470c; }
.pipros { color: #0b62a8; }
@media (prefers-color-scheme: dark) {
svg { color: #e4eaf0; }
.ground { fill: #14191f; }
.genuine { color: #f2a25c; }
.pipros { color: #6db1f2; }
}
"""


def chart(figures):
    """Return an SVG with a panel for each scale in `figures`: {scale: {world: {point: figure}}}."""
    width, parts, words = WIDTH / len(figures), [], []
    for place, (scale, lines) in enumerate(figures.items()):
        _, _, title, y_title, x_title = SCALES[scale]
        points = sorted(lines["pipros"])
        first, last = points[0], points[-1]
        ends = [f"{world} {as_text(line[first])} to {as_text(line[last])}" for world, line in lines.items()]
        words.append(
            f"{title}: {y_title}, {x_title} from {short(first)} to {short(last)}: {', '.join(ends)}."
        )
        parts.append(f'<g transform="translate({place * width:g},0)">')
        parts += [text(LEFT, 18, title, "title"), text(LEFT, 34, y_title), text(LEFT, HEIGHT - 12, x_title)]
        parts += [text(LEFT + 60 * n, 50, world, world) for n, world in enumerate(lines)]
        parts += drawn(points, lines, width)
        parts.append("</g>")
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" version="1.1" viewBox="0 0 {WIDTH} {HEIGHT}"'
            f' width="{WIDTH}" height="{HEIGHT}" role="img" aria-labelledby="title desc">',
            '<title id="title">Cost over scale of genuine ROS 1 and pipros</title>',
            f'<desc id="desc">{escape(" ".join(words))}</desc>',
            f'<style type="text/css">{STYLE}</style>',
            f'<rect class="ground" width="{WIDTH}" height="{HEIGHT}"/>',
            *parts,
            "</svg>\n",
        ]
    )


def drawn(points, lines, width):
    """Return the lines of a panel, with a logarithmic height, and each point labelled with its figure."""
    logs = [math.log(value) for line in lines.values() for value in line.values()]
    low, high = min(logs), max(logs)
    step = (width - 3 * LEFT) / max(len(points) - 1, 1)
    spots = {point: LEFT + 12 + number * step for number, point in enumerate(points)}
    parts = [text(left, HEIGHT - 30, short(point), anchor="middle") for point, left in spots.items()]
    for world, line in lines.items():
        tops = {
            at: BOTTOM - (math.log(value) - low) / (high - low) * (BOTTOM - TOP) for at, value in line.items()
        }
        joined = " ".join(f"{spots[at]:.1f},{tops[at]:.1f}" for at in points)
        parts.append(f'<polyline class="{world}" points="{joined}"/>')
        for at in points:
            is_upper = line[at] == max(each[at] for each in lines.values())
            parts.append(f'<circle class="{world}" cx="{spots[at]:.1f}" cy="{tops[at]:.1f}" r="3.5"/>')
            parts.append(
                text(spots[at], tops[at] + (-8 if is_upper else 17), as_text(line[at]), world, "middle")
            )
    return parts


def text(left, top, words, kind="", anchor="start"):
    kind = f' class="{kind}"' if kind else ""
    return f'<text x="{left:.1f}" y="{top:.1f}"{kind} text-anchor="{anchor}">{escape(words)}</text>'


def main():
    options, rows = compare(__doc__, WORKLOADS, globals(), quick=QUICK, svg="")
    if options.svg and rows:
        figures = {}
        for name, (row, *_) in rows.items():
            scale, point = name.split()
            for world in row.values:
                figures.setdefault(scale, {}).setdefault(world, {})[int(point)] = row.figure(world)
        with open(options.svg, "w") as file:
            file.write(chart(figures))


if __name__ == "__main__":
    main()
