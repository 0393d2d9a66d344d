"""Reported faults of masters and of XML-RPC."""

import socket
from collections.abc import Iterator
from typing import Any

import pytest

from pipros.basics.errors import ProtocolError
from pipros.master.master import Master
from pipros.master.options import Probing
from pipros.net.master_client import MasterClient
from pipros.wire.http import HttpError, RequestReader, ResponseReader
from pipros.wire.xmlrpc import decode_call
from tests.support.constants import Constants
from tests.support.slaves import FakeSlave
from tests.support.waiting import wait_until

# ros_comm#2241, #2067: a node died, another one got its port and was shut down instead. The master still
# had the address of the dead node. When a node of the same name registered, it sent `shutdown` to that
# address, which another node had meanwhile.


@pytest.fixture
def master() -> Iterator[Master]:
    """A master that waits long for the answers of this process, which may be busy."""
    with Master(port=0, probing=Probing(answer_s=60.0)) as running:
        yield running


def register(master: Master, node: str, api: str) -> None:
    MasterClient(master.uri, node, timeout_s=10).register_publisher("/t", "x/Y", api)


def wait_until_all_is_delivered(master: Master) -> None:
    client = MasterClient(master.uri, "/test", timeout_s=10)

    def waiting() -> Any:
        return client.call("pipros.getStatistics")["notices_waiting"]

    wait_until(lambda: waiting() == 0)


@pytest.mark.parametrize("innocent_is_registered", [True, False])
def test_a_node_at_the_address_of_a_dead_one_lives_on(master: Master, innocent_is_registered: bool) -> None:
    # A Python node returns its name; for a C++ node the master uses its registration.
    innocent, successor = FakeSlave(name="" if innocent_is_registered else "/innocent"), FakeSlave(name="/n")
    register(master, "/n", innocent.api)
    if innocent_is_registered:
        register(master, "/innocent", innocent.api)
    register(master, "/n", successor.api)
    wait_until_all_is_delivered(master)
    assert innocent.told == []
    innocent.stop()
    successor.stop()


# CVE-2020-16124: lengths and integers beyond 32 bits wrapped around in the XML-RPC library of ROS.


TOO_LARGE = [2**31, 2**32 - 1, 2**32, 2**63, 2**64, 10**30]


@pytest.mark.parametrize("number", [*TOO_LARGE, *(-number for number in TOO_LARGE[1:])])
def test_an_integer_beyond_the_range_raises_instead_of_wrapping(number: int) -> None:
    value = f"<value><i4>{number}</i4></value>"
    call = f"<methodCall><methodName>m</methodName><params><param>{value}</param></params></methodCall>"
    with pytest.raises(ProtocolError):
        decode_call(call.encode())


@pytest.mark.parametrize(
    "length", [*map(str, TOO_LARGE), "-1", "-2147483648", "0x7fffffff", "1e9", "+5", " ", ""]
)
def test_an_impossible_length_is_refused_before_a_byte_is_stored(length: str) -> None:
    reader = RequestReader()
    reader.feed(f"POST / HTTP/1.1\r\nContent-Length: {length}\r\n\r\n".encode())
    with pytest.raises(HttpError):
        reader.next_request()
    with pytest.raises(HttpError):
        ResponseReader().feed(f"HTTP/1.1 200 OK\r\nContent-Length: {length}\r\n\r\n".encode())


# CVE-2021-37146: one crafted call kept the C++ XML-RPC server of ROS busy forever.


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
    with Master(port=0) as master, socket.create_connection(("127.0.0.1", master.port), 20) as peer:
        peer.sendall(sent)
        assert MasterClient(master.uri, "/other", timeout_s=10).get_pid()
        assert peer.recv(1) == b""
