"""Memory and pauses that hostile clients of `pipros serve` cause, alone and as twenty.

    script/bench hostile_clients [--control]

Another client calls a service of rosapi all the time. For each attack, a line shows the growth of the server,
how much was left 10 s after the attackers had gone, the longest time that the other client waited, the same
before the attack, and the load of the machine. The exit status is 1 if a figure exceeds what
docs/reference/security.md promises. Of the pause, only the excess over the one before the attack counts.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import logging
import multiprocessing
import os
import socket
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

import psutil
from programs import QUIET, Programs
from table import free_port, options_of, wait_for_port
from websockets.exceptions import WebSocketException
from websockets.sync.client import ClientConnection, connect

CONTROL_S = 10.0
ATTACK_S = 10.0
RETURNED_S = 10.0
MAX_MIB = {1: 64, 20: 256}
LEFT_MIB = {1: 16, 20: 64}
"""Memory that allocators may keep for later: Python returns a block of 1 MiB only when all of it is free."""
MAX_PAUSE_S = 0.5

SPAWN = multiprocessing.get_context("spawn")

Attack = Callable[[ClientConnection], None]


def long_ids(client: ClientConnection) -> None:
    for number in range(20):
        client.send(json.dumps({"op": "subscribe", "topic": "/a", "id": f"{number}" + "x" * 900_000}))


def repetitions(client: ClientConnection) -> None:
    for number in range(20_000):
        client.send(json.dumps({"op": "subscribe", "topic": f"/t{number % 500}", "queue_length": number}))


def many_values(client: ClientConnection) -> None:
    for values in ("[]," * 300_000, "{}," * 300_000, "1," * 450_000):
        client.send(f'{{"op": "publish", "topic": "/a", "msg": {{"data": [{values}1]}}}}')


def unfinished(client: ClientConnection) -> None:
    client.send(time.sleep(0.001) or "x" * 65_536 for _ in itertools.count())


def empty_fragments(client: ClientConnection) -> None:
    client.send(itertools.repeat(""))


def unread_answers(client: ClientConnection) -> None:
    client.recv_messages.pause()  # stop reading, until the end, for which the client waits
    threading.Timer(ATTACK_S, client.recv_messages.resume).start()
    for number in range(100_000):
        client.send(json.dumps({"op": "call_service", "service": "/rosapi/topics", "id": number}))


def latched_messages(client: ClientConnection) -> None:
    for number in range(100):
        topic = {"topic": f"/latched{number}", "type": "std_msgs/String"}
        client.send(json.dumps({"op": "advertise", "latch": True, **topic}))
        client.send(json.dumps({"op": "publish", **topic, "msg": {"data": "x" * 900_000}}))


ATTACKS: tuple[Attack, ...] = (
    long_ids, repetitions, many_values, unfinished, empty_fragments, unread_answers, latched_messages
)  # fmt: skip


@dataclass
class Waits:
    """The longest time that the other client waited for a response since the last `reset`."""

    longest_s: float = 0.0
    is_over: bool = False

    def run(self, port: int) -> None:
        with connect(f"ws://127.0.0.1:{port}", max_size=None, open_timeout=60) as client:
            while not self.is_over:
                began_s = time.monotonic()
                client.send('{"op": "call_service", "service": "/rosapi/get_time"}')
                client.recv(120)
                self.longest_s = max(self.longest_s, time.monotonic() - began_s)
                time.sleep(0.02)


def memory_mib(pid: int) -> float:
    return float(psutil.Process(pid).memory_info().rss) / (1 << 20)


def attack_once(attack: Attack, port: int) -> None:
    with contextlib.suppress(WebSocketException, OSError, EOFError):
        client = connect(f"ws://127.0.0.1:{port}", max_size=None, open_timeout=60, close_timeout=0.1)
        with client:
            # closing the socket would not end the connection while a thread sends
            def end() -> None:
                with contextlib.suppress(OSError):
                    client.socket.shutdown(socket.SHUT_RDWR)

            ended = threading.Timer(ATTACK_S, end)
            ended.start()
            attack(client)
            ended.join()


def attack_together(attack: Attack, count: int, port: int) -> None:
    """Run the attackers in their own process: in the same process, they would delay the other client."""
    logging.getLogger("websockets").setLevel(logging.CRITICAL)  # ends of connections are expected
    threads = [threading.Thread(target=attack_once, args=(attack, port)) for _ in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def measure(attack: Attack, count: int, pid: int, port: int, waits: Waits) -> bool:
    """Print the line of one attack. Return whether all figures are within the limits."""
    waits.longest_s = 0.0
    time.sleep(CONTROL_S)
    control_s, waits.longest_s = waits.longest_s, 0.0
    before = memory_mib(pid)
    attackers = SPAWN.Process(target=attack_together, args=(attack, count, port), daemon=True)
    attackers.start()
    most = before
    end_s = time.monotonic() + ATTACK_S + RETURNED_S
    while time.monotonic() < end_s:
        most = max(most, memory_mib(pid))
        time.sleep(0.05)
    attackers.join()
    grown, left = most - before, memory_mib(pid) - before
    pause_s = waits.longest_s
    is_good = grown <= MAX_MIB[count] and left <= LEFT_MIB[count] and pause_s - control_s <= MAX_PAUSE_S
    print(
        f"{attack.__name__:16} {count:3} clients: +{grown:4.0f} MiB, {left:4.0f} MiB left, "
        f"longest pause {pause_s:5.2f} s, before {control_s:5.2f} s, load {os.getloadavg()[0]:4.1f}"
        f"{'' if is_good else '  TOO MUCH'}",
        flush=True,
    )
    return is_good


def main() -> int:
    options = options_of(__doc__, control=False)
    port = free_port()
    with Programs() as programs:
        server = programs.start(
            "pipros", "serve", "--port", str(port), *["--control"] * options.control, **QUIET
        )
        wait_for_port(port)
        waits = Waits()
        other = threading.Thread(target=waits.run, args=(port,), daemon=True)
        other.start()
        time.sleep(3)  # until rosapi is offered and the first imports are done
        results = [measure(attack, n, server.pid, port, waits) for n in MAX_MIB for attack in ATTACKS]
        waits.is_over = True
        other.join(120)
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main())
