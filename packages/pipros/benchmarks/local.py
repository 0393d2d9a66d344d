#!/usr/bin/env python3
"""Nodes on one machine: TCP, Unix streams, shared memory, and subscribers without a copy, in one run.

    benchmarks/local.py [--only flow,fan,small,trip,service,idle] [--rounds 7] [--seconds 1] [--svg FILE]

A row of `flow` and `fan` is the processor time of the publisher and all subscribers together, in us for each
message, which hardly depends on what else the machine does. Round trips and calls are durations, which mean
little if other programs use more than some 5 % of the machine. The variants follow each other within each
round, and medians count. "off" is PIPROS_LOCAL=off; "stream" is PIPROS_SHARED_MEMORY=off; "shared" is the
default; "zero copy" is the default with `rospy.Subscriber(..., zero_copy=True)`. Messages of a megabyte use
`queue_size=None`, so that none is lost. roscpp has no such queue: its publisher sends at most eight messages
ahead. Its processor time is measured from outside. The ratios compare with "off"; `--svg` draws those of
large messages.
"""

import os
import resource
import statistics
import sys
import threading
import time
from functools import partial
from xml.sax.saxutils import escape

from scale import STYLE, text
from table import Load, line
from worlds import CppWorld, World, answer, finish, init, open_worlds, option_parser, ran_as_worker, say

SIZES = {"image": 1_000_000, "cloud": 8_000_000, "small": 64_000, "string": 16}
STEADY_S = 0.3


# ---- workers: in their own processes, with the public rospy API only


def used_s():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def message(kind):
    if kind == "string":
        from std_msgs.msg import String

        return String(data="x" * SIZES[kind])
    from sensor_msgs.msg import Image, PointCloud2

    data = bytes(range(256)) * (SIZES[kind] // 256)
    return PointCloud2(data=data) if kind == "cloud" else Image(data=data)


def options_of(zero_copy):
    return {"zero_copy": True} if zero_copy else {}


def worker_source(kind, queue, seconds, peers):
    """Publish for a while, then print the processor time per message."""
    rospy = init("source")
    from std_msgs.msg import Empty

    msg = message(kind)
    publisher = rospy.Publisher("flow", type(msg), queue_size=queue)
    end = rospy.Publisher("end", Empty, queue_size=1, latch=True)
    while publisher.get_num_connections() < peers or end.get_num_connections() < peers:
        time.sleep(0.01)
    time.sleep(STEADY_S)
    for _ in range(20):
        publisher.publish(msg)
    sent, stop, used = 0, time.monotonic() + seconds, used_s()
    while time.monotonic() < stop:
        for _ in range(10):
            publisher.publish(msg)
        sent += 10
    used = used_s() - used
    time.sleep(STEADY_S)
    end.publish()
    time.sleep(STEADY_S)
    say(sent=sent, us=used / sent * 1e6)


def worker_sink(kind, zero_copy):
    """Count messages until the source announces its end."""
    rospy = init("sink")
    from std_msgs.msg import Empty

    seen, ended, times, used = [0], threading.Event(), [0.0, 0.0], [0.0, 0.0]

    def on_message(msg):
        msg.data[-1]
        seen[0] += 1
        if seen[0] == 20:
            times[0], used[0] = time.monotonic(), used_s()

    def on_last(msg):
        on_message(msg)
        if seen[0] % 10 == 0:
            times[1], used[1] = time.monotonic(), used_s()

    rospy.Subscriber("end", Empty, lambda _: ended.set())
    rospy.Subscriber("flow", type(message(kind)), on_last, **options_of(zero_copy))
    ended.wait()
    count = max(1, seen[0] // 10 * 10 - 20)
    say(us=(used[1] - used[0]) / count * 1e6, rate=count / max(1e-9, times[1] - times[0]), seen=seen[0])


def worker_echo(kind, zero_copy):
    rospy = init("echo")
    kind_of = type(message(kind))
    back = rospy.Publisher("back", kind_of, queue_size=10)
    rospy.Subscriber("forth", kind_of, back.publish, tcp_nodelay=True, **options_of(zero_copy))
    sys.stdin.read()


def worker_trip(kind, seconds, zero_copy):
    """Send messages on a round trip, each after the previous one has returned. Print the median time."""
    rospy = init("trip")
    msg, returned, times = message(kind), threading.Event(), []
    publisher = rospy.Publisher("forth", type(msg), queue_size=10)
    rospy.Subscriber("back", type(msg), lambda _: returned.set(), tcp_nodelay=True, **options_of(zero_copy))
    while not returned.is_set():
        publisher.publish(msg)
        returned.wait(0.1)
    time.sleep(STEADY_S)
    stop = time.monotonic() + seconds
    while time.monotonic() < stop:
        returned.clear()
        began = time.perf_counter()
        publisher.publish(msg)
        returned.wait(1)
        times.append(time.perf_counter() - began)
    say(us=statistics.median(times) * 1e6)


def worker_server():
    rospy = init("server")
    from std_srvs.srv import Empty

    rospy.Service("empty", Empty, lambda _: [])
    say(ready=True)
    for _ in sys.stdin:
        say(used=used_s())


def worker_caller(seconds):
    rospy = init("caller")
    from std_srvs.srv import Empty

    rospy.wait_for_service("empty")
    proxy, times = rospy.ServiceProxy("empty", Empty), []
    proxy()
    say(ready=True)
    sys.stdin.readline()
    used, stop = used_s(), time.monotonic() + seconds
    while time.monotonic() < stop:
        began = time.perf_counter()
        proxy()
        times.append(time.perf_counter() - began)
    say(us=statistics.median(times) * 1e6, used=used_s() - used, calls=len(times))


def worker_idle():
    rospy = init("idle")
    from std_msgs.msg import String

    publisher = rospy.Publisher("chat", String, queue_size=10)
    publisher.publish("hello")
    time.sleep(STEADY_S)
    with open("/proc/self/status") as file:
        fields = dict(row.split(":", 1) for row in file)
    say(mb=int(fields["VmRSS"].split()[0]) / 1024)


# ---- the driver


class Variant:
    """A world, and whether its subscribers take no copies."""

    def __init__(self, name, world, zero_copy=False):
        self.name, self.world, self.zero_copy = name, world, zero_copy

    def start(self, role, *arguments):
        return self.world.start(__file__, role, *arguments)


def processor_s(process):
    """Return the processor time of a process, as the kernel counts it."""
    with open(f"/proc/{process.pid}/stat") as file:
        ticks = file.read().rpartition(")")[2].split()[11:13]
    return sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")


def flow(variant, seconds, kind, peers, queue, of_publisher=False):
    """Return the processor time of one message at all nodes, or at its publisher, in us."""
    if isinstance(variant.world, CppWorld):
        return flow_in_cpp(variant.world, seconds, kind, peers)
    sinks = [variant.start("sink", kind, variant.zero_copy) for _ in range(peers)]
    source = variant.start("source", kind, queue, seconds, peers)
    published = answer(source)["us"]
    taken = [answer(sink)["us"] for sink in sinks]
    for process in (source, *sinks):
        finish(process)
    return published if of_publisher else published + sum(taken)


def flow_in_cpp(world, seconds, kind, peers):
    seconds = max(seconds, 2.0)
    sinks = [world.work("sink", kind, 8) for _ in range(peers)]
    source = world.work("source", kind, 50, 8, seconds, peers)
    time.sleep(1.0)  # its workers connect, and begin
    processes = [source, *sinks]
    began, before = time.monotonic(), [processor_s(process) for process in processes]
    time.sleep(seconds / 2)
    used = sum(map(processor_s, processes)) - sum(before)
    passed = time.monotonic() - began
    answer(source)
    rate = statistics.mean(answer(sink)["rate"] for sink in sinks)
    for process in processes:
        finish(process)
    return used / passed / rate * 1e6


def trip(variant, seconds, kind):
    if isinstance(variant.world, CppWorld):
        echo, measuring = variant.world.work("echo", kind, 10), variant.world.work("trip", kind, 10, seconds)
        us = answer(measuring)["median"] * 1e6
    else:
        echo = variant.start("echo", kind, variant.zero_copy)
        measuring = variant.start("trip", kind, seconds, variant.zero_copy)
        us = answer(measuring)["us"]
    finish(measuring)
    finish(echo)
    return us


def service(variant, seconds, is_processor_time):
    server, caller = variant.start("server"), variant.start("caller", seconds)
    answer(server), answer(caller)
    before = ask_used(server) + processor_s(variant.world.master)
    caller.stdin.write("go\n")
    caller.stdin.flush()
    measured = answer(caller)
    used = measured["used"] + ask_used(server) + processor_s(variant.world.master) - before
    finish(caller)
    finish(server)
    return used / measured["calls"] * 1e6 if is_processor_time else measured["us"]


def ask_used(server):
    server.stdin.write("used\n")
    server.stdin.flush()
    return answer(server)["used"]


def idle(variant, _seconds):
    process = variant.start("idle")
    megabytes = answer(process)["mb"]
    finish(process)
    return megabytes


# Each row: its group, its label, how it is measured, and the goals for "shared" and "zero copy".
ROWS = (
    ("flow", "1 MB image, one to one", partial(flow, kind="image", peers=1, queue=None), 1.4, 2.8),
    ("flow", "8 MB cloud, one to one", partial(flow, kind="cloud", peers=1, queue=None), 1.7, 2.5),
    ("fan", "1 MB image to five", partial(flow, kind="image", peers=5, queue=None), 3.0, 6.0),
    ("fan", "8 MB cloud to five", partial(flow, kind="cloud", peers=5, queue=None), 2.4, 8.0),
    (
        "fan",
        "8 MB cloud to five, publisher",
        partial(flow, kind="cloud", peers=5, queue=None, of_publisher=True),
        4.0,
        None,
    ),
    ("flow", "64 kB image, one to one", partial(flow, kind="small", peers=1, queue=None), 1.0, None),
    ("small", "16 B, queue_size=1000", partial(flow, kind="string", peers=1, queue=1000), 1.0, None),
    (
        "small",
        "16 B to ten, queue_size=1000, publisher",
        partial(flow, kind="string", peers=10, queue=1000, of_publisher=True),
        None,
        None,
    ),
    ("trip", "round trip 1 MB, time", partial(trip, kind="image"), 1.3, 1.8),
    ("trip", "round trip 16 B, time", partial(trip, kind="string"), 1.25, None),
    ("service", "plain service call, time", partial(service, is_processor_time=False), 2.0, None),
    ("service", "plain service call, processor time", partial(service, is_processor_time=True), 3.0, None),
    ("idle", "idle talker: MB", idle, None, None),
)
WIDTH = 760  # of the chart
VARIANTS = ("genuine", "roscpp", "off", "stream", "shared", "zero copy")


def is_able(variant, measure):
    """Return whether a variant has an equivalent of a row."""
    arguments = measure.keywords if isinstance(measure, partial) else {}
    is_large = arguments.get("kind") in ("image", "cloud")
    if variant.name == "roscpp":
        # its workers send images of 1 MiB
        return arguments.get("kind") == "image" and not arguments.get("of_publisher")
    return variant.name != "zero copy" or is_large


def cell(values, off):
    if not values:
        return ""
    median = statistics.median(values)
    return f"{median:,.3g}" if median < 1000 else f"{median:,.0f}", statistics.median(off) / median


def chart(rows):
    """Return an SVG with a bar for each ratio in `rows`: (label, {variant: ratio})."""
    left, right, bar, gap = 190, 110, 14, 14
    scale = (WIDTH - left - right) / max(max(ratios.values()) for _, ratios in rows)
    words = "; ".join(
        f"{label}: " + ", ".join(f"{name} {ratio:.1f}" for name, ratio in ratios.items())
        for label, ratios in rows
    )
    parts, top = [], 44
    for label, ratios in rows:
        parts.append(text(left - 10, top + bar * len(ratios) / 2 + 4, label, anchor="end"))
        for place, (name, ratio) in enumerate(ratios.items()):
            y = top + place * bar
            kind = "genuine" if name in ("genuine", "roscpp") else "pipros"
            width = round(ratio * scale, 1)
            parts.append(f'<rect class="mark {kind}" x="{left}" y="{y}" width="{width}" height="{bar - 3}"/>')
            parts.append(text(left + ratio * scale + 5, y + 10, f"{ratio:.1f} x {name}"))
        top += bar * len(ratios) + gap
    title = "Large messages: the cost of pipros through TCP (off), divided by the cost of each"
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" version="1.1" viewBox="0 0 {WIDTH} {top}"'
            f' width="{WIDTH}" height="{top}" role="img" aria-labelledby="title desc">',
            f'<title id="title">{title}</title>',
            f'<desc id="desc">{escape(words)}</desc>',
            f'<style type="text/css">{STYLE}</style>',
            f'<rect class="ground" width="{WIDTH}" height="{top}"/>',
            text(10, 22, title, "title"),
            *parts,
            "</svg>",
            "",
        ]
    )


def main():
    parser = option_parser(__doc__, dict.fromkeys(row[0] for row in ROWS), 1.0)
    parser.set_defaults(rounds=7)
    parser.add_argument("--svg", help="also draw a chart into this file")
    options = parser.parse_args()
    if ran_as_worker(options, globals()):
        return
    chosen = [row for row in ROWS if not options.only or row[0] in options.only.split(",")]
    lines = [line(["us, unless noted", *VARIANTS, "goals"]), line(["---"] + ["---:"] * (len(VARIANTS) + 1))]
    load, drawn = Load(), []
    with open_worlds(tuned=False, roscpp=True) as worlds:
        by_name = {world.name: world for world in worlds}
        more = [
            World("off", sys.executable, {"PIPROS_LOCAL": "off"}),
            World("stream", sys.executable, {"PIPROS_SHARED_MEMORY": "off"}),
            World("shared", sys.executable, {}),
        ]
        worlds += more
        variants = [Variant(name, by_name[name]) for name in ("genuine", "roscpp") if name in by_name]
        variants += [Variant(world.name, world) for world in more]
        variants.append(Variant("zero copy", by_name["pipros"], zero_copy=True))
        for _, label, measure, *goals in chosen:
            values = {}
            for _ in range(options.rounds):
                for variant in variants:
                    if is_able(variant, measure):
                        values.setdefault(variant.name, []).append(measure(variant, options.seconds))
            cells, ratios = [], {}
            for name in VARIANTS:
                if name not in values:
                    cells.append("")
                    continue
                figure, ratio = cell(values[name], values["off"])
                cells.append(figure if name == "off" else f"{figure} ({ratio:.2f} x)")
                ratios[name] = ratio
            wanted = " / ".join(f"{goal:g} x" for goal in goals if goal is not None)
            lines.append(line([label, *cells, wanted]))
            print(lines[-1], file=sys.stderr, flush=True)
            if "zero copy" in ratios:
                drawn.append((label.removesuffix(", time"), ratios))
    print("\n".join(lines))
    print(
        f"\n{options.rounds} rounds; others used {load.percent():.0f} % of the machine, its workers included"
    )
    if options.svg and drawn:
        with open(options.svg, "w") as file:
            file.write(chart(drawn))


if __name__ == "__main__":
    main()
