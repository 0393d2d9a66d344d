"""Misbehaving subscribers: TCPROS connections that read slowly or not at all."""

import contextlib
import socket
import threading
from collections.abc import Iterator

from pipros.node import Node
from pipros.wire.header import encode_header

BUFFER_BYTES = 16 * 1024
"""Receive buffer of a subscriber. It is small, so that the publisher soon cannot send any more."""


@contextlib.contextmanager
def raw_subscriber(node: Node, topic: str, name: str = "/raw") -> Iterator[socket.socket]:
    """Yield the socket of a subscriber that has sent its header. Nothing is read, not even the response."""
    with socket.socket() as sock:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER_BYTES)
        sock.settimeout(30)
        sock.connect(("127.0.0.1", node.endpoints.port))
        sock.sendall(encode_header({"topic": topic, "md5sum": "*", "callerid": name}))
        yield sock


@contextlib.contextmanager
def dripping_subscriber(node: Node, topic: str) -> Iterator[socket.socket]:
    """Yield the socket of a subscriber that reads about 40 KB per second within the block."""
    done = threading.Event()
    with raw_subscriber(node, topic, "/drip") as sock:

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
