"""Trials of Unix streams and shared memory: killed programs, a stopped one, and many large topics.

`python -m tests.support.local_trials [--kills 4000] [--only kills,stop,topics]` prints what it has counted,
and exits with 1 if a message was torn or lost, or if memory, a descriptor or a thread was left.
`script/long local` runs it.
"""

from __future__ import annotations

import argparse
import gc
import multiprocessing
import os
import random
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterable
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from pipros.basics.env import Environment
from pipros.basics.limits import process_limits
from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.node import Node
from tests.support.waiting import wait_until

Image: Any = load_message_class("sensor_msgs/Image")
SIZES = (300_000, 100, 1_000_000, 40_000)
TOPICS, TOPIC_BYTES = 100, 20_000_000
STOPPED_S = 60.0
PERIOD_S = 0.02
_MIB = 1024 * 1024

# The forked programs start from a process that has imported all this, and has no thread.
_context = multiprocessing.get_context("forkserver")


class Checker:
    """A callback that checks images: all bytes are right, and numbers of one publisher ascend.

    Attributes:
        count, torn: numbers of messages.
        missing: the messages that were lost between the first and the last one of a publisher.
        longest_gap_s: the longest time between two messages.
    """

    def __init__(self, keep: int = 0) -> None:
        self.count = self.torn = self.missing = 0
        self.longest_gap_s = 0.0
        self._last_s = 0.0
        self._kept: list[Any] = []
        self._keep = keep
        self._next: dict[str, int] = {}

    def __call__(self, message: Any) -> None:
        number = message.width
        data = bytes(message.data)
        if data != bytes([number % 256]) * len(data) or len(data) != message.step:
            self.torn += 1
        expected = self._next.get(message.encoding, number)
        self.torn += number < expected
        self.missing += max(number - expected, 0)
        self._next[message.encoding] = number + 1
        self.count += 1
        now_s = time.monotonic()
        if self._last_s:
            self.longest_gap_s = max(self.longest_gap_s, now_s - self._last_s)
        self._last_s = now_s
        self._kept = [*self._kept, message.data][-self._keep :] if self._keep else []

    def result(self) -> tuple[int, int, int, float]:
        self._kept.clear()
        return self.count, self.torn, self.missing, self.longest_gap_s


def image(number: int, sender: str, size: int) -> Any:
    return Image(width=number, encoding=sender, step=size, data=bytes([number % 256]) * size)


def node(uri: str, name: str) -> Node:
    made = Node(name, environment=Environment(master_uri=uri))
    made.start()
    return made


def subscribe(uri: str, name: str, topics: int, zero_copy: bool, pipe: Connection) -> None:
    """A program: check all images until told to stop, then report."""
    checker = Checker(keep=2 if zero_copy else 0)
    subscriber = node(uri, name)
    for number in range(topics):
        subscriber.subscribe(f"images{number}", Image, checker, zero_copy=zero_copy)
    pipe.send("ready")
    while pipe.recv() != "end":
        pipe.send(checker.count)
    pipe.send(checker.result())
    subscriber.shutdown()


def publish(uri: str, name: str, sender: str, pipe: Connection) -> None:
    """A program: publish until it is killed."""
    publisher = node(uri, name).advertise("images0", Image, queue_size=10)
    wait_until(lambda: publisher.connection_count >= 2)
    pipe.send("ready")
    number = 0
    while True:
        publisher.publish(image(number, sender, SIZES[number % len(SIZES)]))
        number += 1


class Program:
    """A forked program and its pipe."""

    def __init__(self, role: Callable[..., None], *arguments: object) -> None:
        self.pipe, other = _context.Pipe()
        self.process: BaseProcess = _context.Process(target=role, args=(*arguments, other), daemon=True)
        self.process.start()
        other.close()

    def answer(self, limit_s: float = 60) -> Any:
        if not self.pipe.poll(limit_s):
            raise TimeoutError(f"program {self.process.pid} does not answer")
        return self.pipe.recv()

    def ask(self, question: str) -> Any:
        self.pipe.send(question)
        return self.answer()

    def kill(self) -> None:
        self.process.kill()
        self.process.join(60)
        self.process.close()
        self.pipe.close()


def resources() -> dict[str, int]:
    """Return this process's threads, and its descriptors and mappings that streams and memory use."""
    gc.collect()
    found = {"threads": threading.active_count(), "sockets": 0, "pipes": 0, "memory": 0}
    for entry in os.listdir("/proc/self/fd"):
        try:
            target = os.readlink(f"/proc/self/fd/{entry}")
        except OSError:  # that of this list
            continue
        found["sockets"] += target.startswith("socket:")
        found["pipes"] += target.startswith("pipe:")
        found["memory"] += "memfd:pipros" in target
    found["memory"] += Path("/proc/self/maps").read_text().count("memfd:pipros")
    return found


def require(what: str, results: Iterable[bool]) -> None:
    if not all(results):
        raise AssertionError(what)


def kill_subscribers(kills: int, chance: random.Random) -> None:
    """Kill subscribers of one publisher, and publish meanwhile. A further subscriber must get everything."""
    with Master(port=0) as master, node(master.uri, "talker") as talker:
        publisher = talker.advertise("images0", Image, queue_size=None)
        good = Program(subscribe, master.uri, "good", 1, False)
        good.answer()
        wait_until(lambda: publisher.connection_count == 1)
        before, sent, slowest_s, done = resources(), [0], [0.0], threading.Event()

        def send() -> None:
            while not done.is_set():
                began_s = time.monotonic()
                publisher.publish(image(sent[0], "talker", SIZES[sent[0] % len(SIZES)]))
                slowest_s[0] = max(slowest_s[0], time.monotonic() - began_s)
                sent[0] += 1
                done.wait(0.001)

        sending = threading.Thread(target=send)
        sending.start()
        for number in range(kills):
            victim = Program(subscribe, master.uri, f"victim{number % 4}", 1, bool(number % 2))
            if number % 3:
                victim.answer()
            time.sleep(chance.uniform(0, 0.05))
            victim.kill()
        done.set()
        sending.join(60)
        memory = publisher.publication.memory
        assert memory is not None
        wait_until(lambda: publisher.connection_count == 1 and not memory.held_slots, 60)
        wait_until(lambda: good.ask("count") == sent[0], 60, what="all messages")
        count, torn, missing, _ = good.ask("end")
        good.process.join(60)
        good.kill()
        after = resources()
        publisher.unregister()
        wait_until(lambda: not resources()["memory"], 60, what="memory is freed")
        print(f"{kills} subscribers killed: {count} messages to another one, {torn} torn, {missing} lost;")
        print(f"  longest publish {slowest_s[0]:.2f} s; before {before}, after {after}", flush=True)
        require("torn or lost messages", [not torn, not missing, not sending.is_alive()])
        require("threads or pipes are left", [after[kind] <= before[kind] for kind in ("threads", "pipes")])


def kill_publishers(kills: int, chance: random.Random) -> None:
    """Kill publishers of two subscribers of this process, one of which keeps arrays of the memory."""
    with Master(port=0) as master, node(master.uri, "one") as one, node(master.uri, "two") as two:
        before = resources()
        checkers = Checker(), Checker(keep=3)
        first = one.subscribe("images0", Image, checkers[0])
        second = two.subscribe("images0", Image, checkers[1], zero_copy=True)
        for number in range(kills):
            program = Program(publish, master.uri, "talker", f"talker{number}")
            if number % 3:
                program.answer()
            time.sleep(chance.uniform(0, 0.05))
            program.kill()
        wait_until(lambda: not first.connection_count and not second.connection_count, 60)
        time_up = time.monotonic() + 60
        results = [checker.result() for checker in checkers]
        while resources()["memory"] and time.monotonic() < time_up:
            time.sleep(0.1)
        after = resources()
        print(f"{kills} publishers killed: {[count for count, *_ in results]} messages,", end=" ")
        print(f"{sum(torn for _, torn, *_ in results)} torn; before {before}, after {after}", flush=True)
        require("torn messages", [not torn and count > 0 for count, torn, *_ in results])
        require("memory is left", [not after["memory"]])
        first.unregister()
        second.unregister()
        wait_until(lambda: resources()["threads"] <= before["threads"], 60, what="threads have ended")
        wait_until(lambda: resources()["pipes"] <= before["pipes"], 60, what="pipes are closed")


def stop_one() -> None:
    """Stop one subscriber for a minute beside two good ones."""
    with Master(port=0) as master, node(master.uri, "talker") as talker:
        publisher = talker.advertise("images0", Image, queue_size=10)
        programs = [
            Program(subscribe, master.uri, f"listener{number}", 1, number == 1) for number in range(3)
        ]
        for program in programs:
            program.answer()
        wait_until(lambda: publisher.connection_count == 3)
        *good, stopped = programs
        pid, number, slowest_s, used = stopped.process.pid, 0, 0.0, 0
        assert pid is not None
        end_s = time.monotonic() + STOPPED_S
        os.kill(pid, signal.SIGSTOP)
        while time.monotonic() < end_s:
            began_s = time.monotonic()
            publisher.publish(image(number, "talker", SIZES[number % len(SIZES)]))
            slowest_s = max(slowest_s, time.monotonic() - began_s)
            if (memory := publisher.publication.memory) is not None:
                used = max(used, memory.used_bytes)
            number += 1
            time.sleep(PERIOD_S)
        os.kill(pid, signal.SIGCONT)
        while stopped.ask("count") == 0:
            publisher.publish(image(number, "talker", 100))
            number += 1
        for program in good:
            wait_until(lambda: program.ask("count") == number, 60, what="all messages")  # noqa: B023
        results = [program.ask("end") for program in programs]
        for program in programs:
            program.kill()
        print(f"a subscriber stopped for {STOPPED_S:.0f} s: {number} messages,", end=" ")
        print(f"longest publish {slowest_s:.2f} s,", end=" ")
        print(f"at most {used / _MIB:.0f} MiB shared; received, torn, lost, longest pause:", flush=True)
        for name, (count, torn, missing, gap_s) in zip(("good", "good", "stopped"), results, strict=True):
            print(f"  {name:8} {count:6} {torn:3} {missing:5} {gap_s:6.2f} s", flush=True)
        require("torn or lost messages", [not any(row[1:3]) for row in results[:2]])
        require("torn messages", [not results[2][1]])


def many_topics() -> None:
    """Publish large messages on many topics of one node to two programs."""
    bound = process_limits().shared_bytes
    with Master(port=0) as master, node(master.uri, "talker") as talker:
        publishers = [talker.advertise(f"images{n}", Image, queue_size=None) for n in range(TOPICS)]
        programs = [Program(subscribe, master.uri, f"listener{n}", TOPICS, bool(n)) for n in range(2)]
        for program in programs:
            program.answer()
        wait_until(lambda: all(each.connection_count == 2 for each in publishers), 60)
        used, rounds = 0, 5
        for number in range(rounds):
            for topic, publisher in enumerate(publishers):
                publisher.publish(image(number, f"topic {topic}", TOPIC_BYTES))
                memories = [each.publication.memory for each in publishers]
                used = max(used, sum(memory.used_bytes for memory in memories if memory is not None))
        for program in programs:
            wait_until(lambda: program.ask("count") == rounds * TOPICS, 60, what="all messages")  # noqa: B023
        results = [program.ask("end") for program in programs]
        for program in programs:
            program.kill()
        print(f"{TOPICS} topics of {TOPIC_BYTES // 10**6} MB: at most {used / _MIB:.0f} MiB shared", end=" ")
        print(f"of {bound / _MIB:.0f}; received, torn, lost: {[row[:3] for row in results]}", flush=True)
        require("torn or lost messages", [not any(row[1:3]) for row in results])
        require("more memory than the bound", [0 < used <= bound])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=4000)
    parser.add_argument("--only", default="kills,stop,topics")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    _context.set_forkserver_preload(["tests.support.local_trials"])
    chance = random.Random(options.seed)  # noqa: S311
    print(f"seed {options.seed}", flush=True)
    parts = options.only.split(",")
    if "kills" in parts:
        kill_subscribers(options.kills // 2, chance)
        kill_publishers(options.kills // 2, chance)
    if "stop" in parts:
        stop_one()
    if "topics" in parts:
        many_topics()
    return 0


if __name__ == "__main__":
    sys.exit(main())
