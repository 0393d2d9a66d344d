#!/usr/bin/env python3
"""A long run of an RTPS participant whose peers start and end, to measure resources and lost messages.

    script/bench rtps_soak [--minutes 30]

This process has a writer at 50 Hz, a latched writer, a reader, and a service. Eight peers on pipros, Fast DDS
and Cyclone DDS subscribe, publish or call for a while; every third one is ended with SIGKILL. The exit status
is 1 if this process uses clearly more at the end than after the first minute, if a message was lost, if a
peer is not forgotten, or if a datagram revealed a defect. It needs root, and the peers of tests/dds.
"""

import random
import re
import sys
import threading
import time
from collections import Counter
from struct import pack, unpack_from

from ros2 import CYCLONE, FAST, MESSAGE, OURS, SERVICE, Program, in_own_network
from soak_resources import held
from table import options_of

CDR = b"\0\1\0\0"
COUNT = 8
KINDS = [OURS, FAST, CYCLONE]
JOBS = [
    ("sub", "rt/beat", "reliable"),
    ("sub", "rt/map", "latched"),
    ("pub", "rt/back", 1_000_000, 100, 10_000, "reliable"),
    ("pub", "rt/back", 1_000_000, 300_000, 200_000, "reliable"),
    ("client", "/add", 100),
]
LIFE_S = 5.0, 20.0
KILL_EVERY = 3
LINE_EVERY_S = 10.0
WARM_UP_S = 60.0
LEASES_S = 25.0  # Fast DDS announces 20 seconds
MEMORY_SLACK_MB = 20.0


def message(number, size):
    return CDR + pack("<II", number, size) + bytes([number % 256]) * size


class Gaps:
    """Counts the messages from remote writers that are missing after the first message of each."""

    def __init__(self):
        self.received = self.lost = 0
        self._last = {}

    def take(self, sample):
        (number,) = unpack_from("<I", sample.payload, 4)
        last = self._last.get(sample.writer, number - 1)
        self.lost += number - last - 1
        self._last[sample.writer] = number
        self.received += 1


class Visitors:
    """Keeps peers running, each for a while, and checks the output of the subscribers among them."""

    def __init__(self):
        self.started = self.killed = self.lost = self.wrong = 0
        self.ended = Counter()
        self._running = []

    def look(self):
        now = time.monotonic()
        for each in list(self._running):
            program, job, end = each
            is_starting = job[0] == "sub" and "ready" not in program.text()
            if is_starting and program.process.poll() is None:
                self._running[self._running.index(each)] = program, job, max(end, now + LIFE_S[0])
            elif now > end:
                self._running.remove(each)
                self._end(program, job)
        if len(self._running) < COUNT:
            self.started += 1
            job, kind = random.choice(JOBS), KINDS[self.started % len(KINDS)]  # noqa: S311
            end = now + random.uniform(*LIFE_S)  # noqa: S311
            self._running.append((Program(kind, *job), job, end))

    def _end(self, program, job, *, is_early=False):
        self.ended[job[0]] += 1
        if job[0] == "sub":
            numbers = [int(each) for each in re.findall(r"(?m)^got (\d+) \d+$", program.text())]
            if job[2] != "latched" and numbers:
                self.lost += numbers[-1] - numbers[0] + 1 - len(numbers)
            if not numbers and not is_early:
                self.wrong += 1
                print(f"nothing: {program.process.args}: {program.text()[-300:]}", flush=True)
        self.wrong += "wrong" in program.text()
        if self.ended.total() % KILL_EVERY == 0:
            self.killed += 1
            program.process.kill()
        program.close()

    def close(self):
        for program, job, _ in self._running:
            self._end(program, job, is_early=True)
        self._running.clear()


def soak(minutes):
    from pipros.net.workers import KEPT_IDLE
    from pipros_ros2.rtps.domain import Discovery, DiscoveryRange
    from pipros_ros2.rtps.participant import Participant
    from pipros_ros2.rtps.qos import DurabilityKind, Qos
    from pipros_ros2.rtps.services import RtpsServer

    def add(request):
        a, b = unpack_from("<qq", request, 4)
        return CDR + pack("<q", a + b)

    gaps, visitors = Gaps(), Visitors()
    with Participant(Discovery(1, DiscoveryRange.SUBNET)) as participant:
        beat = participant.add_writer("rt/beat", MESSAGE, Qos(depth=2000))
        latched = Qos(durability=DurabilityKind.TRANSIENT_LOCAL, depth=1)
        participant.add_writer("rt/map", MESSAGE, latched).write(message(0, 100_000))
        participant.add_reader("rt/back", MESSAGE, Qos(depth=2000), gaps.take)
        RtpsServer(participant, "/add", SERVICE + "_Request_", SERVICE + "_Response_", add)
        begin = time.monotonic()
        number, next_look, next_line, warm = 0, begin, begin + LINE_EVERY_S, None
        pause = threading.Event()
        print(" minutes     MB threads  files peers so far killed   received  lost", flush=True)
        while (now := time.monotonic()) < begin + minutes * 60:
            beat.write(message(number, 1_000_000 if number % 50 == 0 else 100))
            number += 1
            if now >= next_look:
                next_look = now + 0.5
                visitors.look()
            if warm is None and now > begin + WARM_UP_S:
                warm = held()
            if now >= next_line:
                next_line += LINE_EVERY_S
                visited = f"{visitors.started:12} {visitors.killed:6} {gaps.received:10}"
                held_now = "{:6.1f} {:7.0f} {:6.0f}".format(*held())
                lost = gaps.lost + visitors.lost
                print(f"{(now - begin) / 60:8.1f} {held_now} {visited} {lost:5}", flush=True)
            pause.wait(max(0.0, begin + number * 0.02 - time.monotonic()))
        visitors.close()
        is_alone = participant.wait_for(lambda engine: len(engine.peers) == 0, LEASES_S)
        after = held()
        failures = participant.failures
    if warm is None:
        raise SystemExit("the run must take longer than the first minute")
    print(f"after the first minute: {warm[0]:.1f} MB, {warm[1]:.0f} threads, {warm[2]:.0f} files")
    print(f"without peers:          {after[0]:.1f} MB, {after[1]:.0f} threads, {after[2]:.0f} files")
    print(f"defects: {failures}, subscribers with nothing or something wrong: {visitors.wrong}")
    max_threads = warm[1] + KEPT_IDLE  # the service keeps some of its threads
    is_steady = after[0] <= warm[0] + MEMORY_SLACK_MB and after[1] <= max_threads and after[2] <= warm[2]
    is_whole = gaps.lost + visitors.lost + visitors.wrong + failures == 0
    return 0 if is_steady and is_whole and is_alone else 1


def main():
    arguments = options_of(__doc__, minutes=30.0, inside=False)
    return in_own_network(arguments, lambda: soak(arguments.minutes))


if __name__ == "__main__":
    sys.exit(main())
