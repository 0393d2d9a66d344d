"""Misbehaving subscribers: raw TCPROS connections, read by the test or not at all."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Iterator

from pipros.node import Node
from pipros.wire.header import encode_header

BUFFER_BYTES = 16 * 1024
"""Small, so that little goes out to a subscriber that does not read."""


@contextlib.contextmanager
def raw_subscriber(node: Node, topic: str, name: str = "/raw") -> Iterator[socket.socket]:
    """A subscriber that has sent its header and reads nothing, not even the response."""
    with socket.socket() as sock:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER_BYTES)
        sock.settimeout(30)
        sock.connect(("127.0.0.1", node.endpoints.port))
        sock.sendall(encode_header({"topic": topic, "md5sum": "*", "callerid": name}))
        yield sock


@contextlib.contextmanager
def dripping_subscriber(node: Node, topic: str, name: str = "/drip") -> Iterator[socket.socket]:
    """A subscriber that reads some 40 KB a second for as long as the context lasts."""
    done = threading.Event()
    with raw_subscriber(node, topic, name) as sock:

        def drip() -> None:
            while not done.wait(0.05):
                with contextlib.suppress(OSError):
                    sock.recv(2048)

        thread = threading.Thread(target=drip, daemon=True)
        thread.start()
        try:
            yield sock
        finally:
            done.set()
            thread.join()
