"""rosnode ping of nodes that answer, have exited, hang, are unreachable or have moved."""

from __future__ import annotations

import socket
from collections.abc import Iterator

import pytest

from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.net.master_client import MasterClient
from pipros_tools.graph import ping as pinging
from pipros_tools.graph.nodes import node_names, unregister
from tests.support.nodes import MakeNode

String = load_message_class("std_msgs/String")


@pytest.fixture
def client(master: Master) -> Iterator[MasterClient]:
    client = MasterClient(master.uri, "/rosnode")
    yield client
    client.close()


def register(master: Master, node: str, api: str) -> None:
    itself = MasterClient(master.uri, node)
    itself.register_publisher(f"{node}_topic", "std_msgs/String", api)
    itself.close()


PATIENT_S = 30.0  # the nodes of this process may be busy


def test_answers_are_timed_and_averaged(client: MasterClient, make_node: MakeNode) -> None:
    make_node("talker").advertise("/chatter", String)
    lines: list[str] = []
    pauses: list[float] = []
    assert pinging.ping(
        client, "/talker", count=2, say=lines.append, pause=pauses.append, timeout_s=PATIENT_S
    )
    assert lines[0] == "pinging /talker with a timeout of 30.0s"
    assert [line.partition("\t")[2][:5] for line in lines[1:3]] == ["time=", "time="]
    assert lines[3].startswith("ping average: ")
    assert pauses == [pinging.PERIOD_S]


def test_ctrl_c_ends_an_endless_ping_with_the_average(client: MasterClient, make_node: MakeNode) -> None:
    make_node("talker").advertise("/chatter", String)
    lines: list[str] = []

    def interrupt_the_third(_pause_s: float) -> None:
        if len(lines) > 2:
            raise KeyboardInterrupt

    assert pinging.ping(
        client, "/talker", count=None, say=lines.append, pause=interrupt_the_third, timeout_s=PATIENT_S
    )
    assert lines[-1].startswith("ping average: ")


def test_an_unresponsive_node_is_abandoned(
    client: MasterClient, master: Master, capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as deaf:
        register(master, "/deaf", f"http://127.0.0.1:{deaf.getsockname()[1]}/")
        assert not pinging.ping(client, "/deaf", timeout_s=0.1)
    assert capsys.readouterr().err == "connection to [/deaf] timed out\n"


@pytest.mark.parametrize(
    ("api", "complaint"),
    [
        ("http://127.0.0.1:1/", "ERROR: connection refused to [http://127.0.0.1:1/]\n"),
        ("http://no-such-host.invalid:1/", "ERROR: Unknown host [no-such-host.invalid] for node [/lost]\n"),
    ],
)
def test_an_unreachable_node_is_explained(
    client: MasterClient, master: Master, capsys: pytest.CaptureFixture[str], api: str, complaint: str
) -> None:
    register(master, "/lost", api)
    assert not pinging.ping(client, "/lost")
    assert capsys.readouterr().err == complaint


def test_cleanup_removes_every_registration_of_a_node(client: MasterClient, master: Master) -> None:
    itself = MasterClient(master.uri, "/gone")
    itself.register_publisher("/a", "std_msgs/String", "http://127.0.0.1:1/")
    itself.register_subscriber("/b", "std_msgs/String", "http://127.0.0.1:1/")
    itself.register_service("/c", "rosrpc://127.0.0.1:1", "http://127.0.0.1:1/")
    itself.close()
    assert node_names(client) == ["/gone"]
    unregister(client, "/gone")
    assert node_names(client) == []
