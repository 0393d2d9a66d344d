"""CVE-2021-37146: one crafted call kept the C++ XML-RPC server of ROS busy forever."""

from __future__ import annotations

import socket

import pytest

from pipros.master.master import Master
from pipros.net.master_client import MasterClient
from tests.support.constants import Constants

CRAFTED = {
    "shorter than announced": b"POST / HTTP/1.1\r\nContent-Length: 500\r\n\r\n<methodCall><methodName>m",
    "nothing announced": b"POST / HTTP/1.1\r\nContent-Length: 500\r\n\r\n",
    "half a head": b"POST / HTTP/1.1\r\nContent-Le",
    "half a chunk": b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nff\r\nabc",
    "no chunk": b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n",
}


@pytest.mark.parametrize("sent", CRAFTED.values(), ids=CRAFTED)
def test_an_endless_request_is_aborted_while_others_are_answered(sent: bytes, constants: Constants) -> None:
    constants(WHOLE_REQUEST_S=0.2)
    with (
        Master(port=0) as master,
        socket.create_connection(("127.0.0.1", master.port), 20) as peer,
    ):
        peer.sendall(sent)
        assert MasterClient(master.uri, "/other", timeout_s=10).get_pid()
        assert peer.recv(1) == b""
