"""Python's documentation warns about small gzip bodies that expand to gigabytes in `xmlrpc`."""

from __future__ import annotations

import gzip
import socket

from pipros.master.master import Master
from pipros.wire.xmlrpc import encode_call


def test_a_compressed_body_is_refused_and_never_unpacked(master: Master) -> None:
    body = gzip.compress(encode_call("setParam", ("/x", "/bomb", "0" * 1_000_000)))
    head = f"POST / HTTP/1.1\r\nContent-Encoding: gzip\r\nContent-Length: {len(body)}\r\n\r\n"
    with socket.create_connection(("127.0.0.1", master.port), 10) as peer:
        peer.sendall(head.encode() + body)
        assert peer.recv(1000).startswith(b"HTTP/1.1 415")
