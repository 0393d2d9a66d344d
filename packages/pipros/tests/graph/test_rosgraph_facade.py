"""`rosgraph` and `rosmaster` as third-party code uses them."""

import io
import socket
import xmlrpc.client
from collections.abc import Iterator
from typing import Any

import pytest
from std_msgs.msg import String

import rosgraph
import rosgraph.impl.graph
import rosgraph.masterapi
import rosgraph.names
import rosgraph.network
import rosgraph.xmlrpc
import rosmaster
import rosmaster.master
from pipros.basics.env import Environment
from pipros.node import Node
from tests.support.waiting import wait_until


@pytest.fixture
def master(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    found = rosmaster.master.Master(port=0)
    found.start()
    monkeypatch.setenv("ROS_MASTER_URI", str(found.uri))
    yield found
    found.stop()


def test_the_master_is_used_through_its_api(master: Any) -> None:
    assert rosgraph.is_master_online()
    me = rosgraph.Master("tool")
    assert (me.caller_id, me.master_uri) == ("/tool", master.uri)
    assert me.registerPublisher("/t", "x/Y", "http://h:1/") == []
    assert me.registerService("/s", "rosrpc://h:2", "http://h:1/") == 1
    assert me.getSystemState() == [[["/t", ["/tool"]]], [], [["/s", ["/tool"]]]]
    assert me.getTopicTypes() == me.getPublishedTopics("/") == [["/t", "x/Y"]]
    assert (me.lookupNode("/tool"), me.lookupService("/s")) == ("http://h:1/", "rosrpc://h:2")
    me.setParam("/a/b", [1, 2])
    assert me.getParam("/a") == {"b": [1, 2]}
    assert me.hasParam("/a/b")
    assert (me.searchParam("a"), me.getParamNames()) == ("/a", ["/a/b"])
    me.deleteParam("/a")
    assert me.unregisterService("/s", "rosrpc://h:2") == me.unregisterPublisher("/t", "http://h:1/") == 1
    with me.handle as proxy:
        assert proxy.getUri("/x")[2] == me.getUri()
    assert master.ok()


def test_errors_are_those_that_ros_code_catches(master: Any) -> None:
    me = rosgraph.Master("/tool")
    with pytest.raises(rosgraph.MasterError, match=r"Parameter \[/nope\] is not set"):
        me.getParam("/nope")
    with pytest.raises(rosgraph.MasterFailure, match="invalid key"):
        me.searchParam("~x")
    with pytest.raises(rosgraph.masterapi.Error):
        me.lookupNode("/nope")
    with pytest.raises(xmlrpc.client.Fault, match="not supported"):
        me._call("nosuch")
    master.stop()
    assert not me.is_online()
    with pytest.raises(ConnectionRefusedError):
        me.getPid()


@pytest.mark.parametrize("uri", ["foo", "", "http://"])
def test_an_invalid_uri_is_refused(uri: str) -> None:
    with pytest.raises(ValueError, match="invalid master URI"):
        rosgraph.Master("/tool", master_uri=uri)


def test_names_follow_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    assert rosgraph.names.make_caller_id("a") == "/a/"
    monkeypatch.setenv("ROS_NAMESPACE", "robot")
    assert rosgraph.names.get_ros_namespace() == "/robot/"
    assert rosgraph.names.get_ros_namespace(argv=["__ns:=other"]) == "/other/"
    assert rosgraph.names.make_caller_id("a") == "/robot/a/"
    assert rosgraph.names.script_resolve_name("s", "~a") == "/robot/s/a"
    assert rosgraph.names.script_resolve_name("s", "a") == "/robot/a"
    assert rosgraph.names.script_resolve_name("s", "") == "/robot/"
    assert rosgraph.names.resolve_name("a", "/ns/n", {"/ns/a": "/z"}) == "/z"


def test_mappings_are_read_without_parameters(capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["a:=b", "_x:=1", "__name:=z", ":=", "a:=", "q:=r:=s", "1:=2", "~p:=3", "/a:=/b"]
    assert rosgraph.names.load_mappings(argv) == {"a": "b", "__name": "z", "~p": "3", "/a": "/b"}
    assert capsys.readouterr().err == "ERROR: Invalid remapping argument 'q:=r:=s'\n"
    assert rosgraph.myargv(["prog", "b:=c", "__x:=", ":="]) == ["prog"]


def test_none_is_not_a_legal_name() -> None:
    assert not rosgraph.names.is_legal_name(None)
    assert not rosgraph.names.is_legal_base_name(None)
    with pytest.raises(ValueError, match="name"):
        rosgraph.names.namespace(None)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="cannot turn"):
        rosgraph.names.make_global_ns("~a")


def test_anonymous_names_differ_and_are_legal() -> None:
    first, second = (rosgraph.names.anonymous_name("a.b-c") for _ in range(2))
    assert first != second
    assert rosgraph.names.is_legal_base_name(first)
    assert first.startswith("a_b_c_")


@pytest.mark.parametrize(
    ("env", "argv", "uri"),
    [
        ({}, [], "http://localhost:11311/"), ({"ROS_MASTER_URI": "http://h:1"}, [], "http://h:1"),
        ({"ROS_MASTER_URI": "http://h:1"}, ["__master:=http://x:2"], "http://x:2"),
    ],
)  # fmt: skip
def test_the_master_uri_is_read_from_arguments_or_environment(env, argv: list[str], uri: str) -> None:
    assert rosgraph.get_master_uri(env, argv) == uri


def test_a_master_argument_without_value_is_refused() -> None:
    with pytest.raises(ValueError, match="improperly specified"):
        rosgraph.get_master_uri({}, ["__master:="])


@pytest.mark.parametrize(
    ("url", "parts"),
    [
        ("http://h:1/", ("h", 1)), ("rosrpc://h:1", ("h", 1)), ("http://h/x", ("h", 80)),
        ("http://[::1]:5", ("::1", 5)),
    ],
)  # fmt: skip
def test_urls_are_split(url: str, parts: tuple[str, int]) -> None:
    assert rosgraph.network.parse_http_host_and_port(url) == parts


def test_addresses_follow_the_environment(monkeypatch, capsys: pytest.CaptureFixture[str]) -> None:
    network = rosgraph.network
    assert network.get_address_override() is None
    assert network.get_bind_address() == "127.0.0.1"
    monkeypatch.setenv("ROS_IP", "10.0.0.5")
    assert (
        network.get_host_name() == network.get_address_override() == network.get_local_address() == "10.0.0.5"
    )
    assert network.create_local_xmlrpc_uri(5) == "http://10.0.0.5:5/"
    assert network.get_bind_address() == "0.0.0.0"  # noqa: S104
    assert network.get_bind_address("localhost") == "127.0.0.1"
    monkeypatch.setenv("ROS_IP", "10.0.0.5:1")
    network.get_address_override()
    monkeypatch.setenv("ROS_HOSTNAME", "http://x")
    network.get_address_override()
    assert capsys.readouterr().err == (
        "invalid ROS_IP (port should not be included)\n"
        "invalid ROS_HOSTNAME (protocol should not be included)\n"
    )
    assert network.is_local_address("localhost")
    assert not network.is_local_address("192.0.2.77")
    assert "127.0.0.1" in network.get_local_addresses()


def test_connection_headers_are_written_and_read() -> None:
    network = rosgraph.network
    data = network.encode_ros_handshake_header({"callerid": "/n", "type": "x/Y"})
    assert network.decode_ros_handshake_header(data) == {"callerid": "/n", "type": "x/Y"}
    with pytest.raises(network.ROSHandshakeException, match="Incomplete header"):
        network.decode_ros_handshake_header(data[:8])
    left, right = socket.socketpair()
    with left, right:
        assert network.write_ros_handshake_header(left, {"callerid": "/n"}) == 19
        left.sendall(b"rest")
        buffer = io.BytesIO()
        assert network.read_ros_handshake_header(right, buffer, 7) == {"callerid": "/n"}
        left.shutdown(socket.SHUT_WR)
        with pytest.raises(network.ROSHandshakeException, match="terminated before"):
            network.read_ros_handshake_header(right, io.BytesIO(), 100)


class Greeter(rosgraph.xmlrpc.XmlRpcHandler):
    def __init__(self) -> None:
        self.events: list[str] = []

    def _ready(self, uri: str) -> None:
        self.events.append(f"ready at {uri}")

    def _shutdown(self, reason: str) -> None:
        self.events.append(f"ended: {reason}")

    def greet(self, name: str) -> str:
        return f"hello {name}"


def test_own_xml_rpc_nodes_serve_the_public_methods_of_their_handler() -> None:
    greeter = Greeter()
    node = rosgraph.xmlrpc.XmlRpcNode(0, greeter)
    node.start()
    with xmlrpc.client.ServerProxy(str(node.uri)) as proxy:
        assert proxy.greet("you") == "hello you"
        for name in ("_ready", "events", "__init__"):
            with pytest.raises(xmlrpc.client.Fault, match="not supported"):
                proxy.__getattr__(name)()
    node.shutdown("bye")
    node.shutdown("again")
    assert greeter.events == [f"ready at {node.uri}", "ended: bye"]


def test_an_xml_rpc_node_reports_a_port_that_is_in_use() -> None:
    first = rosgraph.xmlrpc.XmlRpcNode()
    first.start()
    errors: list[Exception] = []
    rosgraph.xmlrpc.XmlRpcNode(first.port, on_run_error=errors.append).start()
    assert isinstance(errors[0], OSError)
    with pytest.raises(OSError, match="in use"):
        rosgraph.xmlrpc.XmlRpcNode(first.port).start()
    first.shutdown("end of the test")


def test_the_graph_has_nodes_topics_connections_and_unreachable_nodes(master: Any) -> None:
    environment = Environment(master_uri=master.uri)
    rosgraph.Master("/ghost").registerPublisher("/chatter", "std_msgs/String", "http://127.0.0.1:9/")
    with Node("talker", environment=environment) as talker, Node("listener", environment=environment) as ear:
        publisher = talker.advertise("/chatter", String)
        subscriber = ear.subscribe("/chatter", String, lambda _: None)
        wait_until(lambda: publisher.connection_count == subscriber.connection_count == 1)
        graph = rosgraph.impl.graph.Graph()

        assert graph.update()
        assert not graph.update()

    assert graph.nn_nodes >= {"/ghost", "/talker", "/listener"}
    assert " /chatter" in graph.nt_nodes
    assert [str(edge) for edge in graph.nn_edges if edge.label == "/chatter"] == ["/talker->/listener"]
    connected = {str(edge) for edge in graph.nt_edges}
    registered = {str(edge) for edge in graph.nt_all_edges}
    assert connected >= {"/talker-> /chatter", " /chatter->/listener"}
    assert registered - connected >= {"/ghost-> /chatter"}
    assert {name: bad.type for name, bad in graph.bad_nodes.items()} == {
        "/ghost": rosgraph.impl.graph.BadNode.DEAD
    }


def test_edges_are_kept_once_and_found_from_both_ends() -> None:
    edges = rosgraph.impl.graph.EdgeList()
    assert edges.add_edges("/a", " /t", "b", "label")
    assert not edges.add_edges("/a", " /t", "o", "label")
    assert edges.add_edges("/b", " /t", "i")
    assert sorted(str(edge) for edge in edges) == [" /t->/a", " /t->/b", "/a-> /t"]

    edges.delete_all("/a")

    assert [str(edge) for edge in edges] == [" /t->/b"]
    assert (list(edges.edges_by_start), list(edges.edges_by_end)) == ([" /t|"], ["/b|"])
