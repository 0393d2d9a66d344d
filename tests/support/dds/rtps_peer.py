"""A peer on pipros for tests, with the command line of fast_peer.cpp, but a range of discovery.

rtps_peer.py DOMAIN LOCALHOST|SUBNET[,loss=0.05] pub TOPIC TYPE COUNT SIZE PERIOD_US reliable|latched
"""

from __future__ import annotations

import os
import random
import socket
import sys
import threading
import time
from struct import Struct

from pipros.basics.limits import Limits, process_limits
from pipros.ros2.rtps.domain import Discovery, DiscoveryRange
from pipros.ros2.rtps.outbox import Outgoing
from pipros.ros2.rtps.participant import Participant
from pipros.ros2.rtps.qos import Durability, Qos
from pipros.ros2.rtps.reader import Sample
from pipros.ros2.rtps.service_styles import PIPROS_MARK
from pipros.ros2.rtps.services import Client, Server
from pipros.ros2.rtps.sockets import RtpsSockets

CDR = b"\0\1\0\0"
_MESSAGE = Struct("<II")
_SUM = Struct("<q")
_ADD = Struct("<qq")


class LossySocket(socket.socket):
    """Drops a part of the datagrams that arrive."""

    def recvfrom(self, *arguments: int) -> tuple[bytes, tuple[str, int]]:
        while True:
            received = super().recvfrom(*arguments)
            if not is_lost():
                return received


class LossySockets(RtpsSockets):
    """Drops a part of the datagrams that are sent, and of those that arrive."""

    def __init__(self, where: Discovery, limits: Limits) -> None:
        super().__init__(where, limits)
        self.receiving = [LossySocket(fileno=os.dup(each.fileno())) for each in self.receiving]

    def send(self, datagrams: list[Outgoing]) -> None:  # type: ignore[override]
        super().send(each for each in datagrams if not is_lost())


LOSS = random.Random(1)  # noqa: S311
loss = 0.0


def is_lost() -> bool:
    return LOSS.random() < loss


def qos_of(word: str) -> Qos:
    latched = Qos(durability=Durability.TRANSIENT_LOCAL, depth=1)
    return latched if word == "latched" else Qos(depth=2000)


def wait_for_end() -> None:
    sys.stdin.read()


def report(sample: Sample) -> None:
    number, size = _MESSAGE.unpack_from(sample.payload, 4)
    right = sample.payload[12 : 12 + size] == bytes([number % 256]) * size
    print("got" if right else "wrong", number, size, flush=True)


def add(payload: bytes) -> bytes:
    a, b = _ADD.unpack_from(payload, 4)
    return CDR + _SUM.pack(a + b)


def main(domain: str, options: str, mode: str, name: str, *words: str) -> None:
    global loss
    where, _, part = options.partition(",loss=")
    loss = float(part or 0)
    discovery = Discovery(int(domain), DiscoveryRange(where))
    sockets = (LossySockets if loss else RtpsSockets)(discovery, process_limits())
    with Participant(discovery, f"enclave=/;{PIPROS_MARK}=test;".encode(), sockets=sockets) as participant:
        if mode == "pub":
            type_name, count, size, period_us, kind = words
            writer = participant.add_writer(name, type_name, qos_of(kind))
            print("ready", flush=True)
            if kind != "latched":
                assert writer.wait_for_readers(timeout_s=20)
            pause = threading.Event()
            for number in range(int(count)):
                body = bytes([number % 256]) * int(size)
                writer.write(CDR + _MESSAGE.pack(number, int(size)) + body)
                if int(period_us):
                    pause.wait(int(period_us) / 1e6)
            print("published", flush=True)
            wait_for_end()
        elif mode == "sub":
            type_name, kind = words
            participant.add_reader(name, type_name, qos_of(kind), report)
            print("ready", flush=True)
            wait_for_end()
        elif mode == "server":
            Server(participant, name, words[0] + "_Request_", words[0] + "_Response_", add)
            print("ready", flush=True)
            wait_for_end()
        elif mode == "client":
            client = Client(participant, name, words[0] + "_Request_", words[0] + "_Response_")
            assert client.wait_for_server(20)
            right, began = 0, time.monotonic()
            for number in range(int(words[1])):
                reply = client.call(CDR + _ADD.pack(number, 1000), 20.0)
                right += _SUM.unpack_from(reply, 4)[0] == number + 1000
            print("right", right, flush=True)
            print(f"{(time.monotonic() - began) / int(words[1]) * 1e6:.0f} us per call", flush=True)
            wait_for_end()


if __name__ == "__main__":
    main(*sys.argv[1:])
