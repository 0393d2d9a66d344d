"""How long eight hostile browsers of `pipros serve` make a ninth client wait.

    script/bench hostile_browsers [--control] [--protocol page] [--attack pings] [--seconds 6]

For the page, rosbridge and Foxglove, a line for each attack shows the longest time between a question of the
ninth client and its answer, and the most processor time that the server used meanwhile: on an idle machine,
the answer takes about as long, because one thread at a time runs Python. Other programs and the attackers
themselves, for which this machine may have too few processors, lengthen only the first figure. The exit
status is 1 if the processor time of an answer exceeds `MAX_S`.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import multiprocessing
import os
import re
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from programs import Programs, cpu_s
from table import options_of, wait_for_port
from websockets.sync.client import ClientConnection, connect

HOSTILE = 8
MAX_S = 0.5
TOPICS = 150
TEXT, PING, CONTINUATION, FINAL, COMPRESSED = 1, 9, 0, 0x80, 0x40
SPAWN = multiprocessing.get_context("spawn")

Data = Iterator[bytes]


def frame(payload: bytes, opcode: int = TEXT, bits: int = FINAL) -> bytes:
    """Return a masked frame. The mask is zero, which costs the server as much as any other."""
    size = len(payload)
    head = bytes([bits | opcode])
    if size < 126:
        head += bytes([0x80 | size])
    elif size < 1 << 16:
        head += struct.pack("!BH", 0x80 | 126, size)
    else:
        head += struct.pack("!BQ", 0x80 | 127, size)
    return head + bytes(4) + payload


def texts(*messages: object) -> bytes:
    return b"".join(frame(json.dumps(each).encode()) for each in messages)


@dataclass(frozen=True)
class Protocol:
    """What clients of a protocol send.

    Attributes:
        path, subprotocol: of the WebSocket.
        question, answer: of the ninth client: a message, and what its answer contains.
        endless: subscriptions, or views, that begin and end without end.
        unread: requests whose answers are large; the attacker does not read them.
    """

    path: str
    subprotocol: str
    question: str
    answer: str
    endless: Callable[[], Data]
    unread: Callable[[], Data]


def views() -> Data:
    for number in itertools.count():
        names = ({"name": f"/t{number}_{each}"} for each in range(TOPICS))
        opened = [{"id": each, "view": "topic", "args": name} for each, name in enumerate(names)]
        yield texts(*opened)


def graph_views() -> Data:
    for _ in itertools.count():
        yield texts(*({"id": each, "view": "graph", "args": {"mode": "all"}} for each in range(TOPICS)))


def rosbridge_topics() -> Data:
    for number in itertools.count():
        names = [{"topic": f"/t{number}_{each}", "type": "std_msgs/String"} for each in range(TOPICS)]
        yield texts(*({"op": op, **name} for name in names for op in ("subscribe", "unsubscribe")))


def rosbridge_questions() -> Data:
    for number in itertools.count():
        yield texts({"op": "call_service", "service": "/rosapi/topics", "id": str(number)})


def foxglove_channels() -> Data:
    for number in itertools.count():
        first = number * TOPICS
        pairs = [{"id": first + each, "channelId": 1 + each % 4} for each in range(TOPICS)]
        yield texts(
            {"op": "subscribe", "subscriptions": pairs},
            {"op": "unsubscribe", "subscriptionIds": [each["id"] for each in pairs]},
        )


def foxglove_parameters() -> Data:
    for number in itertools.count():
        yield texts(
            {"op": "subscribeConnectionGraph"},
            {"op": "getParameters", "parameterNames": [], "id": str(number)},
            {"op": "unsubscribeConnectionGraph"},
        )


PROTOCOLS = {
    "page": Protocol("/live", "", '{"id": 7, "action": "about"}', '"id":7', views, graph_views),
    "rosbridge": Protocol(
        "/",
        "",
        '{"op": "call_service", "service": "/rosapi/get_time"}',
        "service_response",
        rosbridge_topics,
        rosbridge_questions,
    ),
    "foxglove": Protocol(
        "/",
        "foxglove.websocket.v1",
        '{"op": "getParameters", "parameterNames": ["/rosdistro"], "id": "7"}',
        "parameterValues",
        foxglove_channels,
        foxglove_parameters,
    ),
}


def repeated(data: bytes) -> Data:
    return itertools.repeat(data * max(1, 65_536 // len(data)))


ONE_BYTE = [frame(b" ", CONTINUATION, 0) for _ in range(1000)]
ATTACKS: dict[str, Callable[[Protocol], Data]] = {
    "empty": lambda _: repeated(frame(b"{}")),
    "pings": lambda _: repeated(frame(b"", PING)),
    "long_pings": lambda _: repeated(frame(b"x" * 125, PING)),
    "bytes": lambda _: repeated(frame(b"x" * 900_000)),
    "many_values": lambda _: repeated(frame(b'{"op": "publish", "args": [' + b"1," * 9_999 + b"1]}")),
    "fragments": lambda _: repeated(
        frame(b"{", bits=0) + b"".join(ONE_BYTE) + frame(b"}", CONTINUATION)
    ),
    "bombs": lambda _: repeated(frame(b"\xaa" * 1000, bits=FINAL | COMPRESSED)),
    "endless": lambda protocol: protocol.endless(),
    "unread": lambda protocol: protocol.unread(),
    "strangers": lambda _: iter(()),
}  # fmt: skip
UNREAD = ("unread",)


def raw_socket(port: int, protocol: Protocol, token: str) -> socket.socket:
    """Return a WebSocket that has logged in, as a socket: attackers need little time for each frame."""
    found = socket.create_connection(("127.0.0.1", port), timeout=60)
    lines = [
        f"GET {protocol.path} HTTP/1.1",
        f"Host: 127.0.0.1:{port}",
        "Upgrade: websocket",
        "Connection: Upgrade",
        "Sec-WebSocket-Version: 13",
        "Sec-WebSocket-Key: MDAwMDAwMDAwMDAwMDAwMA==",
        f"Origin: http://127.0.0.1:{port}",
        *([f"Sec-WebSocket-Protocol: {protocol.subprotocol}"] if protocol.subprotocol else []),
        "\r\n",
    ]
    found.sendall("\r\n".join(lines).encode())
    while b"\r\n\r\n" not in (head := found.recv(4096, socket.MSG_PEEK)):
        if not head:
            found.close()
            raise ConnectionError("the server has closed the connection without an answer")
    if protocol.path == "/live":
        found.sendall(texts({"token": token}))
    return found


def drain(connection: socket.socket) -> None:
    with contextlib.suppress(OSError):
        while connection.recv(1 << 20):
            pass


def cut(connection: socket.socket) -> None:
    with contextlib.suppress(OSError):
        connection.shutdown(socket.SHUT_RDWR)


def attack_once(name: str, protocol: Protocol, port: int, token: str, end_s: float) -> None:
    """Attack until `end_s`; connect again as soon as the server disconnects the attacker."""
    while time.monotonic() < end_s:
        with contextlib.suppress(OSError), raw_socket(port, protocol, token) as connection:
            end = threading.Timer(end_s - time.monotonic(), cut, [connection])
            end.daemon = True
            end.start()
            if name not in UNREAD:
                threading.Thread(target=drain, args=(connection,), daemon=True).start()
            for data in ATTACKS[name](protocol):
                connection.sendall(data)
                if time.monotonic() > end_s:
                    break
            end.cancel()


def attack_together(name: str, kind: str, port: int, token: str, seconds: float) -> None:
    """Run the attackers in their own process: in the same process, they would delay the ninth client."""
    os.nice(5)  # their own processor time must not delay the ninth client
    arguments = (name, PROTOCOLS[kind], port, token, time.monotonic() + seconds)
    threads = [threading.Thread(target=attack_once, args=arguments) for _ in range(HOSTILE)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def longest_answer(
    client: ClientConnection, protocol: Protocol, pid: int, end_s: float
) -> tuple[float, float]:
    """Ask until `end_s`. Return the longest time of an answer, and the server's most processor time, in s."""
    longest_s = most_s = 0.0
    while time.monotonic() < end_s:
        began_s, before_s = time.monotonic(), cpu_s(pid)
        client.send(protocol.question)
        while True:
            answer = client.recv(120)
            if isinstance(answer, str) and protocol.answer in answer.replace(" ", ""):
                break
        longest_s = max(longest_s, time.monotonic() - began_s)
        most_s = max(most_s, cpu_s(pid) - before_s)
        time.sleep(0.05)
    return longest_s, most_s


def measure(name: str, kind: str, pid: int, port: int, token: str, seconds: float) -> bool:
    """Print the line of one attack. Return whether the ninth client was answered in time."""
    protocol = PROTOCOLS[kind]
    options = {"subprotocols": [protocol.subprotocol]} if protocol.subprotocol else {}
    url = f"ws://127.0.0.1:{port}{protocol.path}"
    with connect(url, max_size=None, origin=f"http://127.0.0.1:{port}", proxy=None, **options) as client:
        if protocol.path == "/live":
            client.send(json.dumps({"token": token}))
        alone_s, _ = longest_answer(client, protocol, pid, time.monotonic() + seconds / 3)
        attackers = SPAWN.Process(
            target=attack_together, args=(name, kind, port, token, seconds), daemon=True
        )
        attackers.start()
        answer_s, work_s = longest_answer(client, protocol, pid, time.monotonic() + seconds + 1)
        attackers.join()
    is_good = work_s <= MAX_S
    print(
        f"{kind:9} {name:11} answer {answer_s:5.2f} s, server's processor {work_s:5.2f} s, "
        f"before {alone_s:5.2f} s, load {os.getloadavg()[0]:4.1f}{'' if is_good else '  TOO MUCH'}",
        flush=True,
    )
    return is_good


def main() -> int:
    options = options_of(__doc__, control=False, protocol="", attack="", seconds=6.0)
    with Programs() as programs:
        control = ["--control"] * options.control
        server = programs.start("pipros", "serve", "--port", "0", *control, stderr=subprocess.PIPE)
        found = re.search(r":(\d+)/#token=(\S+)", server.stderr.readline())
        port, token = int(found[1]), found[2]
        wait_for_port(port)
        threading.Thread(target=server.stderr.read, daemon=True).start()
        time.sleep(3)  # until rosapi is offered and the first imports are done
        results = [
            measure(name, kind, server.pid, port, token, options.seconds)
            for kind in PROTOCOLS
            for name in ATTACKS
            if options.protocol in kind and options.attack in name
        ]
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main())
