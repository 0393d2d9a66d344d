#!/usr/bin/env python3
"""The speed of the DDS engine and the gateway, and of bare Cyclone DDS in C and bare Zenoh, in one run.

    benchmarks/ros2.py [--rounds 3] [--only discovery,flow,...] [--quick]

discovery: from the start of a subscriber to its first message from a publisher that runs, including the start
of the program. --rounds 50 is the acceptance run.
latched: the same for a late subscriber and the latched message; bare Zenoh keeps none.
rate: 100 bytes at 1 kHz, without and with 5 % of the datagrams to and from pipros lost: messages that did not
arrive.
flow: messages of 20 bytes and of 1 MB, sent as fast as possible: messages per second that arrive.
large: 8 MB at 10 Hz.
service: the mean time of a call, without the start; and four clients of each vendor at once.
trip: the median time from ROS 1 to ROS 2 through the gateway, and from pipros to pipros by DDS alone.
gateway: messages per second from ROS 1 to Cyclone DDS through the gateway; those of 1 MB five at a time.
end: how long `close` takes, and when a peer notices the end, announced or by SIGKILL.
idle: the processor time and the memory of two participants with 200 writers and 200 readers.
The benchmark runs in its own network, so it needs root. It also needs the peers of tests/dds: python -m
tests.support.dds_peers lists their packages. Nothing else should be running.
"""

import argparse
import contextlib
import functools
import json
import os
import queue
import re
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = os.path.abspath(os.path.join(__file__, "..", "..", "..", ".."))
sys.path.insert(0, ROOT)
PEERS = os.path.join(ROOT, "build", "tests", "support", "dds")
ROUTER = "tcp/127.0.0.1:7447"
TOPIC, MESSAGE = "rt/benchmark", "example_interfaces::msg::dds_::Blob_"
SERVICE = "example_interfaces::srv::dds_::AddTwoInts"
OURS, CYCLONE, FAST, ZENOH = "pipros", "Cyclone DDS", "Fast DDS", "Zenoh"
PAIRS = [
    *((OURS, OURS), (OURS, CYCLONE), (CYCLONE, OURS), (OURS, FAST), (FAST, OURS)),
    *((CYCLONE, CYCLONE), (ZENOH, ZENOH)),
]

IDLE = """
import sys, time, psutil
from pipros.ros2.rtps.domain import Discovery
from pipros.ros2.rtps.participant import Participant
from pipros.ros2.rtps.qos import Qos
with Participant(Discovery(3)) as participant, Participant(Discovery(3)) as peer:
    for number in range(200):
        participant.add_writer(f"rt/a{number}", "T", Qos())
        participant.add_reader(f"rt/b{number}", "T", Qos(), print)
    me = psutil.Process()
    time.sleep(3)
    before = sum(me.cpu_times()[:2])
    time.sleep(10)
    print((sum(me.cpu_times()[:2]) - before) * 10, me.memory_info().rss / 1e6)
"""


class Program:
    """A running peer, whose output is written to a file."""

    def __init__(self, kind, mode, name, *words, loss=0.0):
        from tests.support.dds_peers import cyclone_peer, fast_peer

        dds_type = SERVICE if mode in ("server", "client") else MESSAGE
        rest = [mode, name, dds_type, *words]
        if kind == OURS:
            argv = [sys.executable, f"{PEERS}/rtps_peer.py", "1", f"SUBNET,loss={loss}", *rest]
        elif kind == ZENOH:
            argv = [sys.executable, f"{PEERS}/bare_zenoh_peer.py", ROUTER, *rest]
        elif kind == FAST:
            argv = [fast_peer(), "1", "udp", *rest]
        else:
            argv = [cyclone_peer(), "1", mode, name, *words]
        self.output = tempfile.NamedTemporaryFile("w+")  # noqa: SIM115
        self.began = time.perf_counter()
        self.process = subprocess.Popen(
            list(map(str, argv)), stdin=subprocess.PIPE, stdout=self.output, stderr=subprocess.STDOUT
        )

    def text(self):
        with open(self.output.name) as text:
            return text.read()

    def wait_for(self, word, timeout_s=60):
        """Wait for a line that begins with `word`. Return the time at which it was found."""
        end = time.perf_counter() + timeout_s
        while time.perf_counter() < end:
            if re.search(f"(?m)^{word}", self.text()):
                return time.perf_counter()
            time.sleep(0.002)
        raise SystemExit(f"no line {word}: {self.text()[-500:]}")

    def count(self):
        return self.text().count("got ")

    def close(self):
        self.process.stdin.close()
        try:
            self.process.wait(1)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.output.close()


@contextlib.contextmanager
def running(*argv, **options):
    program = Program(*argv, **options)
    try:
        yield program
    finally:
        program.close()


def zenoh_router():
    import zenoh

    config = zenoh.Config()
    for key, value in {
        "mode": "router",
        "listen/endpoints": [ROUTER],
        "connect/endpoints": [],
        "scouting/multicast/enabled": False,
        "transport/shared_memory/enabled": False,
    }.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


def enter_network():
    """Set up multicast in a new network."""
    for words in ("link set lo up", "link set lo multicast on", "route add 224.0.0.0/4 dev lo"):
        subprocess.run(["ip", *words.split()], check=True)


def discovery(writer, reader):
    with running(writer, "pub", TOPIC, 100_000, 20, 1000, "reliable") as talker:
        talker.wait_for("ready")
        with running(reader, "sub", TOPIC, "reliable") as listener:
            return f"{listener.wait_for('got') - listener.began:.2f} s"


def latched(writer, reader):
    with running(writer, "pub", TOPIC, 1, 20, 0, "latched") as talker:
        talker.wait_for("published")
        with running(reader, "sub", TOPIC, "latched") as listener:
            return f"{listener.wait_for('got') - listener.began:.2f} s"


def rate(writer, reader, loss=0.0, count=10_000, size=100, period_us=1000, timeout_s=5.0):
    """Return the number of lost messages, and the number that arrived per second."""
    with running(reader, "sub", TOPIC, "reliable", loss=loss) as listener:
        listener.wait_for("ready")
        with running(writer, "pub", TOPIC, count, size, period_us, "reliable", loss=loss) as talker:
            began = listener.wait_for("got")
            talker.wait_for("published", 120)
            last, changed_at = 0, time.perf_counter()
            while last < count and time.perf_counter() - changed_at < timeout_s:
                if (arrived := listener.count()) != last:
                    last, changed_at = arrived, time.perf_counter()
                time.sleep(0.01)
    return count - last, last / max(changed_at - began, 1e-3)


def service(server, client, count):
    with running(server, "server", "/add") as offered:
        offered.wait_for("ready")
        with running(client, "client", "/add", count) as caller:
            caller.wait_for(f"right {count}", 120)
            caller.wait_for("\\d+ us")
            return re.search(r"\d+ us", caller.text())[0]


def crowd(count):
    """Let eight clients call a service concurrently. Return text: how many calls returned the right sum."""
    with contextlib.ExitStack() as stack:
        stack.enter_context(running(OURS, "server", "/add")).wait_for("ready")
        callers = [
            stack.enter_context(running(kind, "client", "/add", count)) for kind in [FAST, CYCLONE] * 4
        ]
        for caller in callers:
            caller.wait_for("right", 120)
        right = sum(int(re.search(r"right (\d+)", caller.text())[1]) for caller in callers)
    return f"{right} of {8 * count} correct"


@contextlib.contextmanager
def gateway():
    """Yield a ROS 1 node whose topics a gateway forwards to domain 1."""
    from pipros.basics.env import Environment
    from pipros.master.master import Master
    from pipros.node import Node

    folder = tempfile.mkdtemp()
    package = os.path.join(folder, "example_interfaces")
    os.makedirs(os.path.join(package, "msg"))
    with open(os.path.join(package, "package.xml"), "w") as file:
        file.write("<package><name>example_interfaces</name></package>")
    with open(os.path.join(package, "msg", "Blob.msg"), "w") as file:
        file.write("uint32 number\nuint8[] data\n")
    own = {"ROS_HOME": folder, "ROS_PACKAGE_PATH": folder, "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}
    os.environ.update(own)
    with Master(port=0) as master:
        command = [os.path.join(os.path.dirname(sys.executable), "pipros"), "ros2", "--domain", "1"]
        environment = os.environ | {"ROS_MASTER_URI": master.uri}
        process = subprocess.Popen(
            [*command, "--distro", "humble", "--msgs", folder], env=environment, stdout=subprocess.DEVNULL
        )
        try:
            with Node("talker", environment=Environment(master_uri=master.uri)) as node:
                yield node
        finally:
            process.terminate()
            process.wait()


def through_gateway(size, count, ahead):
    """Return the number of lost messages from ROS 1, and the number that arrived per second.

    At most `ahead` messages are in transit at a time, because the gateway keeps only the last ten of a topic.
    """
    from pipros.msg import load_message_class

    with gateway() as node:
        blob = load_message_class("example_interfaces/Blob")
        with running(CYCLONE, "sub", "rt/a", "reliable") as listener:
            publisher = node.advertise("/a", blob, queue_size=0)
            wait_until(lambda: publisher.connection_count)
            while not listener.count():  # until the whole path exists
                publisher.publish(blob(0, b""))
                time.sleep(0.05)
            began = changed_at = time.perf_counter()
            published = last = 0
            while last < count and time.perf_counter() - changed_at < 3:
                while published < min(count, last + ahead):
                    publisher.publish(blob(published, bytes([published % 256]) * size))
                    published += 1
                if (arrived := listener.text().count(f" {size}\n")) != last:
                    last, changed_at = arrived, time.perf_counter()
                # Polling takes processor time from the gateway: poll often only while messages must follow.
                time.sleep(0.001 if published < count else 0.02)
    return count - last, last / (changed_at - began)


def trips(count):
    """Yield rows with the median times through the gateway, and by DDS alone, within this process."""
    from pipros.msg import load_message_class
    from pipros.ros2.rtps.domain import Discovery, DiscoveryRange
    from pipros.ros2.rtps.participant import Participant
    from pipros.ros2.rtps.qos import Qos

    discovery, qos = Discovery(1, DiscoveryRange.SUBNET), Qos(depth=1000)

    def measure_trip(send, arrived):
        times = []
        for _ in range(count):
            began = time.perf_counter()
            send()
            times.append(arrived.get(timeout=10) - began)
            time.sleep(0.002)
        return f"{statistics.median(times) * 1e3:.2f} ms"

    with gateway() as node, Participant(discovery) as here, Participant(discovery) as there:
        blob = load_message_class("example_interfaces/Blob")
        arrived = queue.SimpleQueue()
        for size in (20, 1_000_000):
            name = f"trip{size}"
            here.add_reader(f"rt/{name}", MESSAGE, qos, lambda _: arrived.put(time.perf_counter()))
            publisher = node.advertise(f"/{name}", blob, queue_size=0)
            wait_until(lambda publisher=publisher: publisher.connection_count)
            message = blob(1, bytes(size))
            while arrived.empty():
                publisher.publish(message)
                time.sleep(0.05)
            time.sleep(0.5)
            while not arrived.empty():
                arrived.get()
            figure = measure_trip(functools.partial(publisher.publish, message), arrived)
            yield f"median latency of {size} B", "ROS 1 to ROS 2 through the gateway", figure
            here.add_reader(f"rt/direct{size}", MESSAGE, qos, lambda _: arrived.put(time.perf_counter()))
            writer = there.add_writer(f"rt/direct{size}", MESSAGE, qos)
            assert writer.wait_for_readers()
            yield (
                f"median latency of {size} B",
                f"{OURS} to {OURS}, DDS alone",
                measure_trip(lambda size=size, writer=writer: writer.write(bytes(size + 12)), arrived),
            )


def ends():
    from pipros.ros2.rtps.domain import Discovery, DiscoveryRange
    from pipros.ros2.rtps.events import PeerChanged
    from pipros.ros2.rtps.participant import Participant
    from pipros.ros2.rtps.qos import Qos

    discovery = Discovery(1, DiscoveryRange.SUBNET)
    changes = queue.SimpleQueue()
    seen = lambda event: changes.put(event.is_present) if isinstance(event, PeerChanged) else None  # noqa: E731
    with Participant(discovery, on_event=seen):
        ending = Participant(discovery)
        for number in range(100):
            ending.add_writer(f"rt/a{number}", "T", Qos())
            ending.add_reader(f"rt/b{number}", "T", Qos(), print)
        changes.get(timeout=10)
        began = time.perf_counter()
        ending.close()
        closed = time.perf_counter()
        changes.get(timeout=20)
        yield "closing 200 endpoints", OURS, f"{closed - began:.2f} s"
        yield "detection of an announced shutdown", OURS, f"{time.perf_counter() - began:.2f} s"
        for kind in (OURS, CYCLONE, FAST):
            with running(kind, "sub", TOPIC, "reliable") as listener:
                listener.wait_for("ready")
                changes.get(timeout=10)
                listener.process.kill()
                began = time.perf_counter()
                changes.get(timeout=30)
                yield (
                    "detection of SIGKILL",
                    f"{kind}, detected by {OURS}",
                    f"{time.perf_counter() - began:.1f} s",
                )


def wait_until(condition, timeout_s=20.0):
    end = time.perf_counter() + timeout_s
    while not condition():
        if time.perf_counter() > end:
            raise SystemExit("nothing connected in time")
        time.sleep(0.005)


def idle():
    shown = subprocess.run([sys.executable, "-c", IDLE], capture_output=True, text=True, check=True).stdout
    per_cent, megabytes = map(float, shown.split())
    return f"{per_cent:.1f} % of one processor, {megabytes:.0f} MB"


def seconds(figure):
    return float(figure.removesuffix(" s"))


def measure(arguments):
    """Yield rows, each with a workload, a pair of implementations, and the figure."""
    wanted = arguments.only.split(",")
    count = 1000 if arguments.quick else 10_000
    for writer, reader in PAIRS:
        pair = f"{writer} to {reader}"
        is_ours = OURS in (writer, reader)
        if "discovery" in wanted:
            times = [discovery(writer, reader) for _ in range(arguments.rounds)]
            yield f"start and discovery, slowest of {arguments.rounds}", pair, max(times, key=seconds)
        if "latched" in wanted and writer != ZENOH:  # bare Zenoh keeps no messages
            yield (
                f"start and latched message, slowest of {arguments.rounds}",
                pair,
                max((latched(writer, reader) for _ in range(arguments.rounds)), key=seconds),
            )
        if "rate" in wanted:
            yield f"{count} x 100 B at 1 kHz", pair, f"{rate(writer, reader, count=count)[0]} lost"
            if is_ours:
                lost, _ = rate(writer, reader, 0.05, count=count)
                yield f"{count} x 100 B at 1 kHz, 5 % loss", pair, f"{lost} lost"
        if "flow" in wanted:
            flows = [
                rate(writer, reader, count=2 * count, size=20, period_us=0, timeout_s=1.0)
                for _ in range(arguments.rounds)
            ]
            yield "20 B as fast as possible", pair, f"{statistics.median(flow for _, flow in flows):,.0f}/s"
            images = [
                rate(writer, reader, count=150, size=1_000_000, period_us=0, timeout_s=1.0)
                for _ in range(arguments.rounds)
            ]
            lost = max(lost for lost, _ in images)
            yield (
                "150 x 1 MB as fast as possible",
                pair,
                f"{statistics.median(flow for _, flow in images):,.0f}/s, {lost} lost",
            )
        if "large" in wanted:
            lost, _ = rate(writer, reader, count=30, size=8_000_000, period_us=100_000)
            yield "30 x 8 MB at 10 Hz", pair, f"{lost} lost"
    if "service" in wanted:
        for server, client in ((OURS, OURS), (FAST, OURS), (CYCLONE, OURS), (ZENOH, ZENOH)):
            pair = f"{server} serves {client}"
            yield "mean time of a service call", pair, service(server, client, count // 10)
        yield "calls by 4 Fast DDS and 4 Cyclone DDS clients", OURS, crowd(count // 10)
    if "trip" in wanted:
        yield from trips(count // 10)
    if "gateway" in wanted:
        for size, number, ahead in ((20, 20 * count, 20 * count), (1_000_000, 150, 5)):
            measured = [through_gateway(size, number, ahead) for _ in range(arguments.rounds)]
            lost, flow = sorted(measured, key=lambda each: each[1])[len(measured) // 2]
            yield (
                f"{number} x {size} B through the gateway",
                f"ROS 1 to {CYCLONE}",
                f"{flow:,.0f}/s, {lost} lost",
            )
    if "end" in wanted:
        yield from ends()
    if "idle" in wanted:
        yield "idle, two participants, 200 writers and readers", OURS, idle()


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--only", default="discovery,latched,rate,flow,large,service,trip,gateway,end,idle")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if not arguments.inside:
        inside = [sys.executable, os.path.abspath(__file__), *sys.argv[1:], "--inside"]
        return subprocess.run(["unshare", "--net", *inside], check=False).returncode
    enter_network()
    router = zenoh_router()
    print("| workload | pair | figure |\n| --- | --- | ---: |")
    for row in measure(arguments):
        print("| " + " | ".join(row) + " |", flush=True)
    router.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
