"""Commands in the process of the test: rosnode ping, rosservice call, and the monitor of time servers."""

import socket
import struct
import threading
import time
from collections.abc import Iterator

import pytest
from roscpp.msg import Logger
from roscpp.srv import GetLoggers
from std_msgs.msg import String
from std_srvs.srv import Trigger

from diagnostic_common_diagnostics.nodes import ntp_monitor
from pipros.master.master import Master
from pipros.net.master_client import MasterClient
from pipros_libraries.diagnostics.items import ERROR, WARN
from pipros_tools.cli.rosservice import main
from pipros_tools.graph import ping as pinging
from pipros_tools.graph.nodes import node_names, unregister
from tests.support.nodes import MakeNode

# rosnode ping of nodes that answer, have exited, hang, are unreachable or have moved.


@pytest.fixture
def ping_client(master: Master) -> Iterator[MasterClient]:
    client = MasterClient(master.uri, "/rosnode")
    yield client
    client.close()


def register(master: Master, node: str, api: str) -> None:
    itself = MasterClient(master.uri, node)
    itself.register_publisher(f"{node}_topic", "std_msgs/String", api)
    itself.close()


PATIENT_S = 30.0  # the nodes of this process may be busy


def test_answers_are_timed_and_averaged(ping_client: MasterClient, make_node: MakeNode) -> None:
    make_node("talker").advertise("/chatter", String)
    lines: list[str] = []
    pauses: list[float] = []
    assert pinging.ping(
        ping_client, "/talker", count=2, say=lines.append, pause=pauses.append, timeout_s=PATIENT_S
    )
    assert lines[0] == "pinging /talker with a timeout of 30.0s"
    assert [line.partition("\t")[2][:5] for line in lines[1:3]] == ["time=", "time="]
    assert lines[3].startswith("ping average: ")
    assert pauses == [pinging.PERIOD_S]


def test_ctrl_c_ends_an_endless_ping_with_the_average(ping_client: MasterClient, make_node: MakeNode) -> None:
    make_node("talker").advertise("/chatter", String)
    lines: list[str] = []

    def interrupt_the_third(_pause_s: float) -> None:
        if len(lines) > 2:
            raise KeyboardInterrupt

    assert pinging.ping(
        ping_client, "/talker", count=None, say=lines.append, pause=interrupt_the_third, timeout_s=PATIENT_S
    )
    assert lines[-1].startswith("ping average: ")


def test_an_unresponsive_node_is_abandoned(ping_client: MasterClient, master: Master, capsys) -> None:
    with socket.create_server(("127.0.0.1", 0)) as deaf:
        register(master, "/deaf", f"http://127.0.0.1:{deaf.getsockname()[1]}/")
        assert not pinging.ping(ping_client, "/deaf", timeout_s=0.1)
    assert capsys.readouterr().err == "connection to [/deaf] timed out\n"


@pytest.mark.parametrize(
    ("api", "complaint"),
    [
        ("http://127.0.0.1:1/", "ERROR: connection refused to [http://127.0.0.1:1/]\n"),
        ("http://no-such-host.invalid:1/", "ERROR: Unknown host [no-such-host.invalid] for node [/lost]\n"),
    ],
)
def test_an_unreachable_node_is_explained(ping_client, master, capsys, api: str, complaint: str) -> None:
    register(master, "/lost", api)
    assert not pinging.ping(ping_client, "/lost")
    assert capsys.readouterr().err.startswith(complaint)


def test_cleanup_removes_every_registration_of_a_node(ping_client: MasterClient, master: Master) -> None:
    itself = MasterClient(master.uri, "/gone")
    itself.register_publisher("/a", "std_msgs/String", "http://127.0.0.1:1/")
    itself.register_subscriber("/b", "std_msgs/String", "http://127.0.0.1:1/")
    itself.register_service("/c", "rosrpc://127.0.0.1:1", "http://127.0.0.1:1/")
    itself.close()
    assert node_names(ping_client) == ["/gone"]
    unregister(ping_client, "/gone")
    assert node_names(ping_client) == []


# `rosservice call` with `--noarr` and `--nostr`, as in ROS 1.16.


@pytest.mark.parametrize(
    ("options", "service", "printed"),
    [
        ((), "/levels", 'loggers: \n  - \n    name: "ros"\n    level: "info"\n'),
        (("--noarr",), "/levels", 'loggers: "<array type: roscpp/Logger, length: 1>"\n'),
        (("--nostr",), "/ready", 'success: True\nmessage: "<string length: 11>"\n'),
    ],
)
def test_arrays_and_strings_of_responses_can_be_left_out(
    make_node: MakeNode, monkeypatch, capsys, options: tuple[str, ...], service: str, printed: str
) -> None:
    node = make_node("server")
    monkeypatch.setenv("ROS_MASTER_URI", node.master.uri)
    node.serve("/levels", GetLoggers, lambda _: GetLoggers._response_class([Logger("ros", "info")]))
    node.serve("/ready", Trigger, lambda _: Trigger._response_class(True, "all systems"))
    assert (main(["call", *options, service]), capsys.readouterr().out) == (0, printed)


# A time server on a socket, queried as by `ntp_monitor.py`.


def test_a_server_that_is_an_hour_ahead_and_one_that_sends_garbage() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as server:
        server.bind(("127.0.0.1", 0))
        port = server.getsockname()[1]

        def serve() -> None:
            asked, client = server.recvfrom(100)
            at = time.time() + 3600 + 2_208_988_800
            stamp = struct.pack(">II", int(at) & 0xFFFFFFFF, int((at % 1) * 2**32))
            head = struct.pack(">BB", 4 << 3 | 4, 1).ljust(24, b"\0")
            server.sendto(head + asked[40:48] + stamp + stamp, client)
            _, client = server.recvfrom(100)
            server.sendto(b"nonsense", client)

        thread = threading.Thread(target=serve)
        thread.start()
        ahead = ntp_monitor.check("127.0.0.1", 500, 1e12, port, deadline_s=30.0)
        nonsense = ntp_monitor.check("127.0.0.1", 500, 1e12, port, deadline_s=30.0)
        thread.join()

    assert (ahead.level, ahead.message) == (WARN, "NTP Offset Too High")
    assert abs(float(dict(ahead.values)["Offset (us)"]) / 1e6 - 3600) < 60
    assert nonsense.level == ERROR
    assert "must have at least 48 bytes, got 8" in nonsense.message


def test_a_missing_server_is_explained() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as closed:
        closed.bind(("127.0.0.1", 0))
        port = closed.getsockname()[1]

    report = ntp_monitor.check("127.0.0.1", 500, 5e6, port)

    assert (report.level, dict(report.values)["Offset (us)"]) == (ERROR, "N/A")
    assert ntp_monitor.check("a..b", 500, 5e6).level == ERROR
