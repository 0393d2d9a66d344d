from __future__ import annotations

import socket

import pytest

from pipros.basics.errors import ProtocolError, Unreachable
from pipros.basics.limits import Limits
from pipros.master.master import Master
from pipros.net.master_client import MasterClient


@pytest.mark.parametrize(("host", "names_own_computer"), [("localhost", False), ("203.0.113.5", True)])
def test_a_master_on_another_computer_may_listen_on_its_own_only(
    monkeypatch: pytest.MonkeyPatch, host: str, names_own_computer: bool
) -> None:
    def refuse(*_: object, **__: object) -> object:
        raise Unreachable(f"http://{host}:11311/", "Connection refused")

    monkeypatch.setattr("pipros.net.master_client.RpcClient.call", refuse)
    with pytest.raises(Unreachable, match="Is roscore running there") as raised:
        MasterClient(f"http://{host}:11311/", "/me").call("getPid")
    assert ("accepts connections only from its own computer" in str(raised.value)) == names_own_computer


def test_a_request_that_the_master_refuses_while_it_arrives_gets_the_reason(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A broken pipe is not the reason: it only shows that the master reads no further."""

    def refused(sock: socket.socket, data: bytes) -> None:
        sock.send(data[:300])
        raise BrokenPipeError(32, "Broken pipe")

    with Master(port=0, limits=Limits(body_bytes=1000)) as master:
        client = MasterClient(master.uri, "/me")
        monkeypatch.setattr(socket.socket, "sendall", refused)
        with pytest.raises(ProtocolError, match=r"413 Content Too Large: .*the limit is 1000"):
            client.set_param("/a", "x" * 10_000)
        client.close()
