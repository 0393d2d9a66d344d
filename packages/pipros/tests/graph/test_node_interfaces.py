"""What other programs ask of a node: the slave API, logger levels, and settings of dynamic_reconfigure."""

import re
import socket
import struct
from typing import Any
from xmlrpc.client import ServerProxy

import pytest
from std_msgs.msg import String

from dynamic_reconfigure.msg import Config
from pipros.master.master import Master
from pipros.msg import load_message_class, load_service_class
from pipros.node.logger_services import serve_loggers
from pipros.wire.header import encode_header
from pipros_libraries.reconfiguring.server import Reconfigurable, Setting
from rospy import rosconsole
from rospy.logger_level_service_caller import LoggerLevelServiceCaller, ROSConsoleException
from tests.support.nodes import MakeNode
from tests.support.waiting import wait_until

# Replies of the slave API to invalid requests, and its description of the links.


def answer_to(node: object, data: bytes) -> bytes:
    """Return the bytes that the node sends after this beginning of a connection, until it closes."""
    with ServerProxy(node.uri) as slave:
        _, _, (_, host, port) = slave.requestTopic("/me", "/chat", [["TCPROS"]])
    with socket.create_connection((host, port), timeout=30) as connection:
        connection.sendall(data)
        return connection.recv(4096)


def test_a_node_returns_its_uri_and_refuses_publishers_without_one(make_node: MakeNode) -> None:
    node = make_node("told")
    with ServerProxy(node.uri) as slave:
        assert slave.getUri("/me") == [1, "", node.uri]
        assert slave.getUri() == [-1, "missing required caller_id parameter", ""]
        assert slave.publisherUpdate("/master", "/chat", ["http://127.0.0.1:1/"])[0] == 1
        for publishers in ("http://h:1", [5], ["x"], ["http://h:1", "y"], [""]):
            assert slave.publisherUpdate("/master", "/chat", publishers)[::2] == [-1, -1]


def test_a_refused_subscriber_is_sent_the_list_of_topics(make_node: MakeNode) -> None:
    node = make_node("refusing")
    node.advertise("/chat", String)
    header = {"topic": "/none", "md5sum": String._md5sum, "callerid": "/me", "type": "std_msgs/String"}
    refusal = answer_to(node, encode_header(header)).decode()
    assert "[/refusing] is not a publisher of [/none]. Topics are [['/chat', 'std_msgs/String']]" in refusal


def test_an_empty_header_closes_the_connection_silently(make_node: MakeNode) -> None:
    node = make_node("silent")
    node.advertise("/chat", String)
    assert answer_to(node, struct.pack("<I", 0)) == b""


def test_both_ends_of_a_link_name_transport_port_and_socket(make_node: MakeNode, transport: str) -> None:
    talker, listener = make_node("talker"), make_node("listener")
    publisher = talker.advertise("/chat", String)
    subscriber = listener.subscribe("/chat", String, lambda message: None)
    wait_until(lambda: publisher.connection_count == subscriber.connection_count == 1)
    pattern = re.compile(transport + r" connection on port (\d+) to \[(.*) on socket (\d+)\]")
    remarks = []
    for node in (talker, listener):
        with ServerProxy(node.uri) as slave:
            (link,) = slave.getBusInfo("/me")[2]
        assert link[3] == transport
        found = pattern.fullmatch(link[6])
        assert found is not None, link
        remarks.append(found)
    end = f":{remarks[1][1]}" if transport == "TCPROS" else "this machine"
    assert remarks[0][2].endswith(end)


# `rospy.logger_level_service_caller` and `rospy.rosconsole`, on a node in this process.


@pytest.fixture
def caller(master: Master, make_node: MakeNode, monkeypatch: pytest.MonkeyPatch) -> LoggerLevelServiceCaller:
    monkeypatch.setenv("ROS_MASTER_URI", master.uri)
    serve_loggers(make_node("listener"))
    return LoggerLevelServiceCaller()


def test_levels_are_read_and_set(caller: LoggerLevelServiceCaller, capsys) -> None:
    assert caller.get_node_names() == ["/listener"]
    assert caller.get_levels() == ["debug", "info", "warn", "error", "fatal"]
    logger = caller.get_loggers("/listener")[0]
    assert caller.send_logger_change_message("/listener", logger, "error")
    assert not caller.send_logger_change_message("/listener", logger, "ERROR")
    rosconsole.main(["rosconsole", "get", "/listener", logger])
    assert capsys.readouterr().out == "ERROR\n"
    assert caller.send_logger_change_message("/listener", logger, "info")


def test_unknown_nodes_and_loggers_raise(caller: LoggerLevelServiceCaller, capsys) -> None:
    with pytest.raises(ROSConsoleException, match="node '/nobody' doesn't exist"):
        caller.get_loggers("/nobody")
    with pytest.raises(KeyError):
        caller.send_logger_change_message("/listener", "nothing", "info")
    with pytest.raises(SystemExit) as end:
        rosconsole.main(["rosconsole", "list", "/nobody"])
    assert end.value.code == 1
    with pytest.raises(SystemExit):
        rosconsole.error(3, "bad")
    assert capsys.readouterr().err.endswith("rosconsole: error: bad\n")


# Settings that clients of dynamic_reconfigure change, on a node without rospy.


SETTINGS = (
    Setting("enabled", True, description="Whether it works", level=1), Setting("radius", 0.5, 0, 10, level=2),
    Setting("width", 10, 0, level=4), Setting("origin", 0.0), Setting("footprint", "[]", level=8),
)  # fmt: skip


def parameter(kind: str, name: str, value: Any) -> Any:
    return load_message_class(f"dynamic_reconfigure/{kind}Parameter")(name, value)


def test_settings_are_read_clamped_described_and_changed(make_node: MakeNode) -> None:
    node, client = make_node("robot"), make_node("client")
    node.params.set("~costmap", {"enabled": 1, "radius": 50, "width": 2.6, "origin": "left"})
    calls: list[tuple[dict[str, Any], int]] = []
    server = Reconfigurable(
        node, "~costmap", SETTINGS, lambda values, level: calls.append((dict(values), level))
    )
    first = {"enabled": True, "radius": 10.0, "width": 3, "origin": 0.0, "footprint": "[]"}
    assert calls == [(first, 0xFFFFFFFF)]
    assert node.params.get("~costmap") == first

    descriptions: list[Any] = []
    updates: list[Any] = []
    description_class = load_message_class("dynamic_reconfigure/ConfigDescription")
    client.subscribe("/robot/costmap/parameter_descriptions", description_class, descriptions.append)
    client.subscribe("/robot/costmap/parameter_updates", Config, updates.append)
    wait_until(lambda: descriptions and updates, 30, "the latched messages")
    described = descriptions[0]
    assert [each.name for each in described.groups[0].parameters] == list(first)
    assert [each.type for each in described.groups[0].parameters] == [
        "bool", "double", "int", "double", "str",
    ]  # fmt: skip
    assert {each.name: each.value for each in described.max.doubles} == {
        "radius": 10.0, "origin": float("inf"),
    }  # fmt: skip
    assert [(each.name, each.value) for each in described.max.ints] == [("width", 2147483647)]
    assert [(each.name, each.value) for each in described.min.ints] == [("width", 0)]
    assert [(each.name, each.value) for each in described.dflt.strs] == [("footprint", "[]")]

    service_class: Any = load_service_class("dynamic_reconfigure/Reconfigure")
    request = service_class._request_class(
        Config(
            bools=[parameter("Bool", "enabled", False), parameter("Bool", "unknown", True)],
            ints=[parameter("Int", "width", -7), parameter("Int", "radius", 3)],
            doubles=[parameter("Double", "radius", 0.25), parameter("Double", "origin", float("nan"))],
        )
    )
    answer: Any = client.client("/robot/costmap/set_parameters", service_class).call(request)
    assert [(each.name, each.value) for each in answer.config.doubles] == [("radius", 0.25), ("origin", 0.0)]
    assert server.values == {**first, "enabled": False, "radius": 0.25, "width": 0}
    assert calls[1:] == [(server.values, 7)]
    assert node.params.get("~costmap/radius") == 0.25
    wait_until(lambda: any(not update.bools[0].value for update in updates), 30, "the update")


def test_the_result_of_the_function_replaces_the_settings(make_node: MakeNode) -> None:
    node = make_node("robot")
    server = Reconfigurable(node, "~", SETTINGS, lambda values, _: {**values, "radius": 2.0})

    server.update({"radius": 7.0, "footprint": "[[1, 1]]"})

    assert (server.values["radius"], server.values["footprint"]) == (2.0, "[[1, 1]]")
    assert node.params.get("~radius") == 2.0


@pytest.mark.parametrize(("value", "read"), [
    (2.5, 3), (-1, 0), (True, 10), ("3", 10), (float("nan"), 10), (float("inf"), 2**31 - 1),
    (1e300, 2**31 - 1),
])  # fmt: skip
def test_numbers_are_read_as_in_roscpp(value: Any, read: int) -> None:
    assert Setting("width", 10, 0).read(value) == read
