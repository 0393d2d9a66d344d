#!/usr/bin/env python3
"""Cost over scale of rospy and the master: pipros and genuine ROS, in one run.

    script/bench scale [--only size,subscribers,topics,nodes] [--rounds 3] [--seconds 2] [--svg FILE]

As in script/bench client, every workload is one script that uses the public rospy API and is run with each
implementation in turn; the median of the rounds counts. Processor time is that of whole processes, user and
system, while messages are sent at a rate that both implementations reach; a lost message ends the benchmark
with an error. `--svg` draws a chart of the figures. `--quick` measures the smaller half of each scale.
"""

import contextlib
import dataclasses
import math
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from xml.sax.saxutils import escape

from table import as_text, markdown, write_json
from worlds import answer, finish, init, open_worlds, option_parser, ran_as_worker, say, taken_in_turn

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
        for process in processes:
            finish(process)


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


def by_size(world, seconds, size):
    rate_hz = 100 if size <= 32_000 else 20 if size <= 1_000_000 else 5
    label = f"message of {in_bytes(size)} at {rate_hz} Hz: us of processor time, both ends"
    return {label: sum(flow(world, seconds, size, rate_hz, 1))}


def by_subscribers(world, seconds, peers):
    label = f"subscribers, {peers}, 1 kB at {RATE_HZ} Hz: us of the publisher's processor time per message"
    return {label: flow(world, seconds, BYTES, RATE_HZ, peers)[0]}


def by_topics(world, _seconds, count):
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


def by_nodes(world, _seconds, count):
    with workers(world) as start:
        before = processor_s(world.master)
        for member in [start("member", number) for number in range(count)]:
            answer(member)
        time.sleep(SETTLE_S)
    used = processor_s(world.master) - before
    return {f"nodes, {count} at once: ms of the master's processor time per node": used / count * 1e3}


def in_bytes(count):
    """Return a size with its unit.

    >>> in_bytes(16), in_bytes(32_000), in_bytes(8_000_000)
    ('16 B', '32 kB', '8 MB')
    """
    factor, unit = next(pair for pair in ((10**6, "MB"), (10**3, "kB"), (1, "B")) if count >= pair[0])
    return f"{count // factor} {unit}"


@dataclasses.dataclass(frozen=True, slots=True)
class Panel:
    """A scale: `measure` returns a figure for each label at one point of it. The chart shows the first."""

    measure: Callable
    points: tuple[int, ...]
    title: str
    y_title: str
    x_title: str
    tick: Callable = str


PANELS = {
    "size": Panel(
        by_size,
        (16, 1_000, 32_000, 1_000_000, 8_000_000),
        "Message size",
        "processor time of both ends (us)",
        "size of each message (bytes)",
        lambda point: in_bytes(point).rstrip("B").replace(" ", ""),
    ),
    "subscribers": Panel(
        by_subscribers,
        (1, 2, 4, 8, 16),
        "Subscribers",
        "publisher's time per message (us)",
        f"subscribers, 1 kB at {RATE_HZ} Hz (count)",
    ),
    "topics": Panel(
        by_topics,
        (1, 10, 100, 500),
        "Topics",
        "time until all are connected (s)",
        "topics between two nodes (count)",
    ),
    "nodes": Panel(
        by_nodes,
        (1, 4, 16, 32),
        "Nodes",
        "master's time per node (ms)",
        "nodes that start together (count)",
    ),
}


# ---- the chart

WIDTH, HEIGHT = 960, 280
LEFT, RIGHT, TOP, BOTTOM = 48, 16, 52, 48  # margins around the axes of a panel
NAME_WIDTH = 46
PADDING = 18  # between the axes and the outermost points, for the names of the lines
STYLE = """
svg { color: #1c2733; font: 11px ui-sans-serif, system-ui, sans-serif; }
.ground { fill: #ffffff; }
text { fill: currentColor; }
.title { font-size: 14px; font-weight: 600; }
.axis { stroke: currentColor; fill: none; }
.grid { stroke: currentColor; stroke-opacity: .15; }
.mark { fill: currentColor; }
.name { font-weight: 600; }
polyline { stroke: currentColor; stroke-width: 2; fill: none; }
.genuine { color: #b4470c; }
.pipros { color: #0b62a8; }
@media (prefers-color-scheme: dark) {
svg { color: #e4eaf0; }
.ground { fill: #14191f; }
.genuine { color: #f2a25c; }
.pipros { color: #6db1f2; }
}
"""
STEPS = [float(f"{digit}e{power}") for power in range(-6, 9) for digit in (1, 2, 5)]


def chart(figures):
    """Return an SVG with a panel for each scale in `figures`: {scale: {world: {point: figure}}}."""
    width = WIDTH / len(figures)
    words = " ".join(described(PANELS[name], lines) for name, lines in figures.items())
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" version="1.1" viewBox="0 0 {WIDTH} {HEIGHT}"'
        f' width="{WIDTH}" height="{HEIGHT}" role="img" aria-labelledby="title desc">',
        '<title id="title">Cost over scale of genuine ROS 1 and pipros</title>',
        f'<desc id="desc">{escape(words)}</desc>',
        f'<style type="text/css">{STYLE}</style>',
        f'<rect class="ground" width="{WIDTH}" height="{HEIGHT}"/>',
    ]
    for place, (name, lines) in enumerate(figures.items()):
        parts.append(f'<g transform="translate({place * width:g},0)">')
        parts += drawn(PANELS[name], lines, width)
        parts.append("</g>")
    return "\n".join([*parts, "</svg>", ""])


def described(panel, lines):
    """Return a sentence with the first and last figures of a panel, for screen readers."""
    first, *_, last = sorted(lines["pipros"])
    ends = [f"{world} {as_text(line[first])} to {as_text(line[last])}" for world, line in lines.items()]
    scale = f"{panel.x_title} from {panel.tick(first)} to {panel.tick(last)}"
    return f"{panel.title}: {panel.y_title}, {scale}: {', '.join(ends)}."


def drawn(panel, lines, width):
    """Return the elements of one panel."""
    points = sorted(lines["pipros"])
    values = [value for line in lines.values() for value in line.values()]
    low = max(step for step in STEPS if step <= min(values))
    high = min(step for step in STEPS if step > max(values))
    right, bottom = width - RIGHT, HEIGHT - BOTTOM

    def x(point):
        share = math.log(point / points[0]) / math.log(points[-1] / points[0])
        return LEFT + PADDING + share * (right - LEFT - 2 * PADDING)

    def y(value):
        return bottom - PADDING - math.log(value / low) / math.log(high / low) * (bottom - TOP - 2 * PADDING)

    parts = [
        text(LEFT - 40, 18, panel.title, "title"),
        text(LEFT - 40, 36, panel.y_title),
        text((LEFT + right) / 2, HEIGHT - 10, panel.x_title, anchor="middle"),
        f'<path class="axis" d="M{LEFT},{TOP} V{bottom} H{right:g}"/>',
    ]
    steps = [step for step in STEPS if low <= step <= high]
    if len(steps) > 7:
        steps = [step for step in steps if math.log10(step).is_integer()]
    for step in steps:
        parts.append(f'<path class="grid" d="M{LEFT},{y(step):.1f} H{right:g}"/>')
        parts.append(text(LEFT - 5, y(step) + 4, as_text(step), anchor="end"))
    for point in points:
        parts.append(f'<path class="axis" d="M{x(point):.1f},{bottom} v4"/>')
        parts.append(text(x(point), bottom + 16, panel.tick(point), anchor="middle"))
    spots = {
        world: [(x(point), y(value)) for point, value in sorted(line.items())]
        for world, line in lines.items()
    }
    upper = min(spots, key=lambda world: spots[world][-1][1])
    for world, line in spots.items():
        joined = " ".join(f"{left:.1f},{top:.1f}" for left, top in line)
        parts.append(f'<polyline class="{world}" points="{joined}"/>')
        parts += [marker(world, *spot) for spot in line]
        parts.append(name(world, spots, above=world == upper))
    return parts


def marker(world, left, top):
    """Return the mark of a point; its shape tells the lines apart without colours."""
    if world == "pipros":
        return f'<circle class="mark {world}" cx="{left:.1f}" cy="{top:.1f}" r="3.5"/>'
    return f'<rect class="mark {world}" x="{left - 3:.1f}" y="{top - 3:.1f}" width="6" height="6"/>'


def name(world, spots, above):
    """Return a line's name: of the upper line above its highest end, of the lower line below its lowest end.

    The line does not cross it there, whether it rises or falls, and the name avoids the marks of both lines.
    """
    first, *_, last = spots[world]
    outer = min if above else max
    end = outer(first, last, key=lambda spot: spot[1])
    top = outer(y for line in spots.values() for x, y in line if abs(x - end[0]) < NAME_WIDTH)
    anchor, nudge = ("start", -7) if end == first else ("end", 7)
    return text(end[0] + nudge, top + (-9 if above else 17), world, f"name {world}", anchor)


def text(left, top, words, kind="", anchor="start"):
    attributes = f' class="{kind}"' if kind else ""
    attributes += f' text-anchor="{anchor}"' if anchor != "start" else ""
    return f'<text x="{left:.1f}" y="{top:.1f}"{attributes}>{escape(words)}</text>'


def main():
    parser = option_parser(__doc__, PANELS, 2.0)
    parser.add_argument("--quick", action="store_true", help="the smaller half of each scale")
    parser.add_argument("--svg", help="also draw a chart into this file")
    options = parser.parse_args()
    if ran_as_worker(options, globals()):
        return
    rows, figures = [], {}
    with open_worlds(tuned=False) as worlds:
        for scale in options.only.split(",") if options.only else PANELS:
            panel, lines = PANELS[scale], {world.name: {} for world in worlds}
            for point in panel.points[: (len(panel.points) + 1) // 2 if options.quick else None]:
                found = taken_in_turn(panel.measure, worlds, options.rounds, options.seconds, point)
                for world, line in lines.items():
                    line[point] = found[0].figure(world)
                rows += found
                print(".", end="", file=sys.stderr, flush=True)
            figures[scale] = lines
    print(f"\n{markdown(rows)}")
    if options.json:
        write_json(options.json, rows)
    if options.svg:
        with open(options.svg, "w") as file:
            file.write(chart(figures))


if __name__ == "__main__":
    main()
