#!/usr/bin/env python3
"""The speed of the DDS engine and the gateway, and of bare Cyclone DDS in C and bare Zenoh, in one run.

    script/bench ros2 [--rounds 3] [--only flow,gateway,trip] [--quick]

flow: messages of 20 bytes and of 1 MB, sent as fast as possible: messages per second that arrive.
trip: the median time from ROS 1 to ROS 2 through the gateway, and from pipros to pipros by DDS alone.
gateway: messages per second from ROS 1 to Cyclone DDS through the gateway; those of 1 MB five at a time.
The benchmark runs in its own network, so it needs root. It also needs the peers of tests/dds: python -m
tests.support.dds_peers lists their packages. Nothing else should be running.
"""

import contextlib
import functools
import glob
import json
import os
import queue
import re
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from programs import Programs
from table import options_of

from tests.support.waiting import wait_until

ROOT = os.path.abspath(os.path.join(os.path.realpath(__file__), "..", "..", "..", ".."))
PEERS = {
    os.path.basename(file): file
    for file in glob.glob(os.path.join(ROOT, "p*", "*", "tests", "support", "dds", "*"))
}
ROUTER = "tcp/127.0.0.1:7447"
TOPIC, MESSAGE = "rt/benchmark", "example_interfaces::msg::dds_::Blob_"
SERVICE = "example_interfaces::srv::dds_::AddTwoInts"
OURS, CYCLONE, FAST, ZENOH = "pipros", "Cyclone DDS", "Fast DDS", "Zenoh"
PAIRS = [
    *((OURS, OURS), (OURS, CYCLONE), (CYCLONE, OURS), (OURS, FAST), (FAST, OURS)),
    *((CYCLONE, CYCLONE), (ZENOH, ZENOH)),
]


class Program:
    """A running peer, whose output is written to a file."""

    def __init__(self, kind, mode, name, *words, loss=0.0):
        from tests.support.dds_peers import cyclone_peer, fast_peer

        dds_type = SERVICE if mode in ("server", "client") else MESSAGE
        rest = [mode, name, dds_type, *words]
        if kind == OURS:
            argv = [sys.executable, PEERS["rtps_peer.py"], "1", f"SUBNET,loss={loss}", *rest]
        elif kind == ZENOH:
            argv = [sys.executable, PEERS["bare_zenoh_peer.py"], ROUTER, *rest]
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


def in_own_network(arguments, work):
    """Return the exit code of `work()`, which is run in a new network with multicast."""
    if not arguments.inside:
        inside = [sys.executable, os.path.abspath(sys.argv[0]), *sys.argv[1:], "--inside"]
        return subprocess.run(["unshare", "--net", *inside], check=False).returncode
    for words in ("link set lo up", "link set lo multicast on", "route add 224.0.0.0/4 dev lo"):
        subprocess.run(["ip", *words.split()], check=True)
    return work()


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


@contextlib.contextmanager
def gateway():
    """Yield a ROS 1 node whose topics a gateway forwards to domain 1."""
    with Programs() as programs:
        package = Path(programs.folder, "example_interfaces")
        (package / "msg").mkdir(parents=True)
        (package / "package.xml").write_text("<package><name>example_interfaces</name></package>")
        (package / "msg" / "Blob.msg").write_text("uint32 number\nuint8[] data\n")
        own = {"ROS_PACKAGE_PATH": programs.folder, "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}
        os.environ.update(own)
        programs.environment.update(own)
        options = ("--domain", "1", "--distro", "humble", "--msgs", programs.folder)
        programs.start("pipros", "ros2", *options)
        yield programs.node()


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
    from pipros_ros2.rtps.domain import Discovery, DiscoveryRange
    from pipros_ros2.rtps.participant import Participant
    from pipros_ros2.rtps.qos import Qos

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


def measure(arguments):
    """Yield rows, each with a workload, a pair of implementations, and the figure."""
    wanted = arguments.only.split(",")
    count = 1000 if arguments.quick else 10_000
    for writer, reader in PAIRS:
        pair = f"{writer} to {reader}"
        for what, number, size in (("20 B", 2 * count, 20), ("150 x 1 MB", 150, 1_000_000)):
            if "flow" in wanted:
                options = {"count": number, "size": size, "period_us": 0, "timeout_s": 1.0}
                found = [rate(writer, reader, **options) for _ in range(arguments.rounds)]
                lost = f", {max(lost for lost, _ in found)} lost" if size > 20 else ""
                flow = statistics.median(flow for _, flow in found)
                yield f"{what} as fast as possible", pair, f"{flow:,.0f}/s{lost}"
    if "trip" in wanted:
        yield from trips(count // 10)
    if "gateway" in wanted:
        for size, number, ahead in ((20, 20 * count, 20 * count), (1_000_000, 150, 5)):
            measured = [through_gateway(size, number, ahead) for _ in range(arguments.rounds)]
            lost, flow = sorted(measured, key=lambda each: each[1])[len(measured) // 2]
            label = f"{number} x {size} B through the gateway"
            yield label, f"ROS 1 to {CYCLONE}", f"{flow:,.0f}/s, {lost} lost"


def main():
    arguments = options_of(__doc__, rounds=3, only="flow,gateway,trip", quick=False, inside=False)

    def work():
        router = zenoh_router()
        print("| workload | pair | figure |\n| --- | --- | ---: |")
        for row in measure(arguments):
            print("| " + " | ".join(row) + " |", flush=True)
        router.close()
        return 0

    return in_own_network(arguments, work)


if __name__ == "__main__":
    sys.exit(main())
