"""A Foxglove server in the test's process, and a simple client."""

import contextlib
import json
import re
import struct
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from pipros.net.loop import BackgroundLoop
from pipros.node import Node
from pipros_bridges.admission import Admission
from pipros_bridges.bridge_server import BridgeServer
from pipros_bridges.foxglove.handler import SUBPROTOCOLS, FoxgloveHandler, Rules
from pipros_server.act_gate import ActGate

CONTROL = Rules(has_control=True, max_poll_s=0.2)


@contextlib.contextmanager
def serving(node: Node, rules: Rules = CONTROL, gate: ActGate | None = None) -> Iterator[str]:
    """Serve Foxglove clients with a node; yield the server's address. `gate` decides about their acts."""
    loop = BackgroundLoop("foxglove")
    loop.start()
    handler = FoxgloveHandler(node, loop, rules, gate=gate)
    server = BridgeServer(dict.fromkeys(SUBPROTOCOLS, handler), Admission(), limits=node.limits)
    loop.run(server.open("127.0.0.1", 0))
    handler.start()
    try:
        yield f"ws://127.0.0.1:{server.port}"
    finally:
        loop.run(server.close())
        handler.close()
        loop.stop()


class Client:
    """A client that keeps what it has received.

    Attributes:
        channels, services: the current offers of the server, by topic or service.
        news: all other messages in order, as JSON objects or binary data.
    """

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.channels: dict[str, Any] = {}
        self.services: dict[str, Any] = {}
        self.news: list[Any] = []

    def send(self, op: str, **fields: Any) -> None:
        self.socket.send(json.dumps({"op": op, **fields}))

    def receive(self, timeout_s: float = 60.0) -> Any:
        """Receive the next message, store it, and return it."""
        data = self.socket.recv(timeout=timeout_s)
        message = data if isinstance(data, bytes) else json.loads(data)
        if isinstance(message, bytes):
            self.news.append(message)
            return message
        match message["op"]:
            case "advertise":
                self.channels |= {each["topic"]: each for each in message["channels"]}
            case "unadvertise":
                ids = message["channelIds"]
                self.channels = {name: each for name, each in self.channels.items() if each["id"] not in ids}
            case "advertiseServices":
                self.services |= {each["name"]: each for each in message["services"]}
            case "unadvertiseServices":
                ids = message["serviceIds"]
                self.services = {name: each for name, each in self.services.items() if each["id"] not in ids}
            case _:
                self.news.append(message)
        return message

    def until(self, check: Callable[[], Any]) -> Any:
        """Receive messages until `check` returns a true value, and return this value."""
        end = time.monotonic() + 60
        while not (found := check()):
            self.receive(end - time.monotonic())
        return found

    def next(self, op: str, **fields: Any) -> Any:
        """Return the oldest message in `news` with this operation and these fields, and remove it.

        Receive further messages if there is none.
        """

        def find() -> Any:
            for message in self.news:
                if isinstance(message, dict) and {"op": op, **fields}.items() <= message.items():
                    self.news.remove(message)
                    return message
            return None

        return self.until(find)

    def next_binary(self, opcode: int) -> bytes:
        """Like `next` for a binary message. Return the bytes after the opcode."""

        def find() -> bytes | None:
            for message in self.news:
                if isinstance(message, bytes) and message[0] == opcode:
                    self.news.remove(message)
                    return message[1:]
            return None

        found: bytes = self.until(find)
        return found

    def subscribe(self, number: int, topic: str) -> Mapping[str, Any]:
        """Wait until a topic is offered, and subscribe to it."""
        channel: Mapping[str, Any] = self.until(lambda: self.channels.get(topic))
        self.send("subscribe", subscriptions=[{"id": number, "channelId": channel["id"]}])
        return channel

    def next_message(self) -> tuple[int, int, bytes]:
        """Return the subscription id, the time in ns and the body of the next message on a topic."""
        data = self.next_binary(1)
        return (*struct.unpack_from("<IQ", data), data[12:])

    def call(self, service: str, number: int, body: bytes, encoding: str = "ros1") -> None:
        offered = self.until(lambda: self.services.get(service))
        name = encoding.encode()
        self.socket.send(struct.pack("<BIII", 2, offered["id"], number, len(name)) + name + body)


@contextlib.contextmanager
def connected(address: str, subprotocol: str = SUBPROTOCOLS[0], **options: Any) -> Iterator[Client]:
    options = {"subprotocols": [Subprotocol(subprotocol)], "open_timeout": 60, **options}
    with connect(address, proxy=None, max_size=None, **options) as socket:
        yield Client(socket)


def only(pattern: str) -> tuple[re.Pattern[str]]:
    """Return a whitelist with one pattern."""
    return (re.compile(pattern),)
