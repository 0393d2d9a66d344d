#!/usr/bin/env python3
"""How quick the engine for ROS 2 is, beside Cyclone DDS in C, in a network of its own (needs root).

    benchmarks/ros2.py [--rounds 3] [--only discovery,flow,rate,large,latched,service,idle] [--quick]

discovery: from the start of a subscriber to its first message from a publisher that runs, including the start
of the program.
rate: 100 bytes at 1 kHz, without and with 5 % of the datagrams of pipros lost: messages that did not arrive.
flow: messages of 20 bytes and of 1 MB as fast as they are sent, and those that arrived.
large: 8 MB at 10 Hz.
latched: from the start of a late subscriber to the latched message, including the start of the program.
service: the time of a call, without the start.
idle: the processor time and the memory of a participant with 200 writers and 200 readers.
It needs the peers of tests/dds: python -m tests.support.dds_peers lists the packages. Nothing else should run
meanwhile.
"""

import argparse
import contextlib
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, ROOT)
PEER = os.path.join(ROOT, "tests", "support", "dds", "rtps_peer.py")
TOPIC, MESSAGE = "rt/benchmark", "example_interfaces::msg::dds_::Blob_"
SERVICE = "example_interfaces::srv::dds_::AddTwoInts"
OURS, CYCLONE, FAST = "pipros", "Cyclone", "Fast"
PAIRS = [(OURS, OURS), (OURS, CYCLONE), (CYCLONE, OURS), (OURS, FAST), (FAST, OURS), (CYCLONE, CYCLONE)]

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
    """A peer whose output goes to a file."""

    def __init__(self, kind, mode, name, *words, loss=0.0):
        from tests.support.dds_peers import cyclone_peer, fast_peer

        dds_type = SERVICE if mode in ("server", "client") else MESSAGE
        rest = [mode, name, dds_type, *words]
        if kind == OURS:
            argv = [sys.executable, PEER, "1", f"SUBNET,loss={loss}", *rest]
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
        """Wait for a line that begins with the word; return the time."""
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
    """Return how many of the messages were lost, and how many arrived per second."""
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


def idle():
    shown = subprocess.run([sys.executable, "-c", IDLE], capture_output=True, text=True, check=True).stdout
    per_cent, megabytes = map(float, shown.split())
    return f"{per_cent:.1f} % of one processor, {megabytes:.0f} MB"


def measure(arguments):
    """Yield rows: a workload, a pair, and its figure."""
    wanted = arguments.only.split(",")
    count = 1000 if arguments.quick else 10_000
    for writer, reader in PAIRS:
        pair = f"{writer} to {reader}"
        is_ours = OURS in (writer, reader)
        if "discovery" in wanted:
            times = [discovery(writer, reader) for _ in range(arguments.rounds)]
            yield "start and discovery, worst", pair, max(times)
        if "latched" in wanted:
            yield (
                "start and latched message, worst",
                pair,
                max(latched(writer, reader) for _ in range(arguments.rounds)),
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
        for server, client in ((OURS, OURS), (FAST, OURS), (CYCLONE, OURS)):
            yield "service call, mean", f"{server} serves {client}", service(server, client, count // 10)
    if "idle" in wanted:
        yield "idle, two participants, 200 writers and readers", OURS, idle()


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--only", default="discovery,latched,rate,flow,large,service,idle")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if not arguments.inside:
        inside = [sys.executable, os.path.abspath(__file__), *sys.argv[1:], "--inside"]
        return subprocess.run(["unshare", "--net", *inside], check=False).returncode
    enter_network()
    print("| workload | pair | figure |\n| --- | --- | ---: |")
    for row in measure(arguments):
        print("| " + " | ".join(row) + " |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
