"""Trials of Unix streams and shared memory: thousands of killed programs.

`python -m tests.support.local_trials [--kills 4000]` prints what it has counted, and fails if a message was
torn or lost, or if memory, a descriptor or a thread was left. `script/long local` runs it.
`tests.graph.test_shared_memory` has subscribers that are stopped, and topics beyond the limit.
"""

import argparse
import contextlib
import gc
import multiprocessing
import os
import random
import threading
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.node import Node
from tests.support.waiting import wait_until

Image: Any = load_message_class("sensor_msgs/Image")
SIZES = (300_000, 100, 1_000_000, 40_000)

# The forked programs start from a process that has imported all this, and has no thread.
_context = multiprocessing.get_context("forkserver")


class Checker:
    """A callback that checks images: all bytes are right, and numbers of one publisher ascend.

    Attributes:
        count, torn: numbers of messages.
        missing: the messages that were lost between the first and the last one of a publisher.
    """

    def __init__(self, keep: int = 0) -> None:
        self.count = self.torn = self.missing = 0
        self.kept: list[Any] = []
        self._keep = keep
        self._next: dict[str, int] = {}

    def __call__(self, message: Any) -> None:
        number, data = message.width, bytes(message.data)
        expected = self._next.get(message.encoding, number)
        self.torn += data != bytes([number % 256]) * len(data) or len(data) != message.step
        self.torn += number < expected
        self.missing += max(number - expected, 0)
        self._next[message.encoding] = number + 1
        self.count += 1
        self.kept = [*self.kept, message.data][-self._keep :] if self._keep else []


def node(uri: str, name: str) -> Node:
    made = Node(name, environment=Environment(master_uri=uri))
    made.start()
    return made


def image(number: int, sender: str) -> Any:
    data = bytes([number % 256]) * SIZES[number % len(SIZES)]
    return Image(width=number, encoding=sender, step=len(data), data=data)


def subscribe(uri: str, name: str, zero_copy: bool, pipe: Connection) -> None:
    """A program: check all images, and report whenever asked."""
    checker = Checker(keep=2 if zero_copy else 0)
    node(uri, name).subscribe("images", Image, checker, zero_copy=zero_copy)
    pipe.send("ready")
    while pipe.recv():
        pipe.send((checker.count, checker.torn, checker.missing))


def publish(uri: str, name: str, sender: str, pipe: Connection) -> None:
    """A program: publish until it is killed."""
    publisher = node(uri, name).advertise("images", Image, queue_size=10)
    wait_until(lambda: publisher.connection_count >= 2)
    pipe.send("ready")
    number = 0
    while True:
        publisher.publish(image(number, sender))
        number += 1


class Program:
    """A forked program and its pipe."""

    def __init__(self, role: Callable[..., None], *arguments: object) -> None:
        self.pipe, other = _context.Pipe()
        self.process: BaseProcess = _context.Process(target=role, args=(*arguments, other), daemon=True)
        self.process.start()
        other.close()

    def answer(self) -> Any:
        if not self.pipe.poll(60):
            raise TimeoutError(f"program {self.process.pid} does not answer")
        return self.pipe.recv()

    def kill(self) -> None:
        self.process.kill()
        self.process.join(60)
        self.process.close()
        self.pipe.close()


def kill_all(kills: int, chance: random.Random, start: Callable[[int], Program]) -> None:
    """Start programs and kill each after a moment, two of three of them when they are ready."""
    for number in range(kills):
        victim = start(number)
        if number % 3:
            victim.answer()
        time.sleep(chance.uniform(0, 0.05))
        victim.kill()


def resources() -> dict[str, int]:
    """Return this process's threads, and its descriptors and mappings that streams and memory use."""
    gc.collect()
    found = {"threads": threading.active_count(), "pipes": 0}
    found["memory"] = Path("/proc/self/maps").read_text().count("memfd:pipros")
    for entry in os.listdir("/proc/self/fd"):
        with contextlib.suppress(OSError):  # that of this list is closed
            target = os.readlink(f"/proc/self/fd/{entry}")
            found["pipes"] += target.startswith("pipe:")
            found["memory"] += "memfd:pipros" in target
    return found


def kill_subscribers(kills: int, chance: random.Random) -> None:
    """Kill subscribers of one publisher, and publish meanwhile. A further subscriber must get everything."""
    with Master(port=0) as master, node(master.uri, "talker") as talker:
        publisher = talker.advertise("images", Image, queue_size=None)
        good = Program(subscribe, master.uri, "good", False)
        good.answer()
        wait_until(lambda: publisher.connection_count == 1)
        before, done, slowest_s = resources(), threading.Event(), [0.0]

        def send() -> None:
            while not done.wait(0.001):
                began_s = time.monotonic()
                publisher.publish(image(len(slowest_s), "talker"))
                slowest_s.append(time.monotonic() - began_s)

        sending = threading.Thread(target=send)
        sending.start()
        name = "victim{}".format
        kill_all(kills, chance, lambda n: Program(subscribe, master.uri, name(n % 4), bool(n % 2)))
        done.set()
        sending.join(60)
        memory: Any = publisher.publication.memory
        wait_until(lambda: publisher.connection_count == 1 and not memory.held_slots, 60)

        def report() -> Any:
            good.pipe.send(True)
            return good.answer()

        wait_until(lambda: report()[0] == len(slowest_s) - 1, 60, what="all messages")
        count, torn, missing = report()
        good.kill()
        wait_until(lambda: not publisher.connection_count, 60)
        after = resources()
        publisher.unregister()
        wait_until(lambda: not resources()["memory"], 60, what="memory is freed")
        print(f"{kills} subscribers killed: {count} messages to another one, {torn} torn, {missing} lost;")
        print(f"  longest publish {max(slowest_s):.2f} s; before {before}, after {after}", flush=True)
        assert not torn, "torn messages"
        assert not missing, "lost messages"
        assert all(after[kind] <= before[kind] for kind in ("threads", "pipes")), "threads or pipes are left"


def kill_publishers(kills: int, chance: random.Random) -> None:
    """Kill publishers of two subscribers of this process, one of which keeps arrays of the memory."""
    with Master(port=0) as master, node(master.uri, "one") as one, node(master.uri, "two") as two:
        before, checkers = resources(), (Checker(), Checker(keep=3))
        first = one.subscribe("images", Image, checkers[0])
        second = two.subscribe("images", Image, checkers[1], zero_copy=True)
        kill_all(kills, chance, lambda number: Program(publish, master.uri, "talker", f"talker{number}"))
        wait_until(lambda: not first.connection_count and not second.connection_count, 60)
        checkers[1].kept.clear()
        wait_until(lambda: not resources()["memory"], 60, what="memory is freed")
        print(f"{kills} publishers killed: {[each.count for each in checkers]} messages,", end=" ")
        print(f"{sum(each.torn for each in checkers)} torn; before {before}, after {resources()}", flush=True)
        assert all(not each.torn and each.count > 0 for each in checkers), "torn messages"
        first.unregister()
        second.unregister()
        wait_until(lambda: resources()["threads"] <= before["threads"], 60, what="threads have ended")
        wait_until(lambda: resources()["pipes"] <= before["pipes"], 60, what="pipes are closed")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=4000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    _context.set_forkserver_preload(["tests.support.local_trials"])
    chance = random.Random(options.seed)  # noqa: S311
    kill_subscribers(options.kills // 2, chance)
    kill_publishers(options.kills // 2, chance)


if __name__ == "__main__":
    main()
