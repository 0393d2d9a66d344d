"""Unix streams between the nodes of one machine: negotiation, the way back to TCP, kept connections."""

import gc
import socket
from collections.abc import Callable
from typing import Any
from xmlrpc.client import ServerProxy

import pytest
from std_msgs.msg import String
from std_srvs.srv import SetBool

from pipros.msg import load_message_class
from pipros.net import local_stream
from pipros.net.local_stream import PROTOCOL, VERSION
from pipros.node import Node
from pipros.node.service_link import NotDelivered, ServiceFailed, ServiceLink
from pipros.wire.handshake import WireType
from tests.support.nodes import Inbox, MakeNode, listening_log, wait_until_connected
from tests.support.waiting import wait_until

ON = SetBool._request_class(data=True)
INTERFACE = WireType(SetBool._type, SetBool._md5sum)


def answer(text: str) -> Callable[[Any], Any]:
    return lambda request: SetBool._response_class(success=request.data, message=text)


def transports(node: Node) -> list[str]:
    """Return the transports of a node's topic links, as it reports them."""
    with ServerProxy(node.uri) as slave:
        rows: Any = slave.getBusInfo("/test")
    return [row[3] for row in rows[2]]


def request_topic(node: Node, *protocols: list[object]) -> Any:
    with ServerProxy(node.uri) as slave:
        return slave.requestTopic("/test", "/chat", [*protocols])


@pytest.fixture(autouse=True)
def _with_unix_streams(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("PIPROS_LOCAL", raising=False)


# -- topics ---------------------------------------------------------------------------


def test_a_publisher_serves_both_transports_at_once(make_node: MakeNode, monkeypatch) -> None:
    talker, near, far = make_node("talker"), make_node("near"), make_node("far")
    publisher = talker.advertise("chat", String, queue_size=10, latch=True)
    publisher.publish(String(data="latched"))
    inboxes = Inbox(), Inbox()
    near.subscribe("chat", String, inboxes[0])
    wait_until_connected(publisher, 1)
    monkeypatch.setenv("PIPROS_LOCAL", "off")
    far.subscribe("chat", String, inboxes[1])
    wait_until_connected(publisher, 2)
    publisher.publish(String(data="live"))
    for inbox in inboxes:
        assert [message.data for message in inbox.wait(2)] == ["latched", "live"]
    assert sorted(transports(talker)) == [PROTOCOL, "TCPROS"]


def test_tcpros_is_offered_first_and_unknown_protocols_are_skipped(make_node: MakeNode) -> None:
    node = make_node("talker")
    node.advertise("/chat", String)
    tcp = ["TCPROS", *node.endpoints.address]
    here = local_stream.machine_token()
    assert request_topic(node, [PROTOCOL, VERSION, "another machine"], ["TCPROS"])[2] == tcp
    assert request_topic(node, [PROTOCOL, "v2", here], ["TCPROS"])[2] == tcp
    assert request_topic(node, [PROTOCOL], ["TCPROS"])[2] == tcp
    for offers in ((["TCPROS"], [PROTOCOL, VERSION, here]), ([PROTOCOL, VERSION, here], ["TCPROS"])):
        assert request_topic(node, *offers)[2][:2] == [PROTOCOL, VERSION]
    assert local_stream.offer()[0] == ["TCPROS"]


def test_a_subscriber_without_the_stream_uses_tcp(make_node: MakeNode, monkeypatch) -> None:
    talker, listener = make_node("talker"), make_node("listener")
    publisher = talker.advertise("chat", String)
    monkeypatch.setattr(talker.endpoints, "local_name", "pipros-without-a-listener")
    inbox = Inbox.of(listener, "chat", String)
    wait_until_connected(publisher, 1)
    publisher.publish(String(data="hello"))
    assert [message.data for message in inbox.wait(1)] == ["hello"]
    assert transports(listener) == ["TCPROS"]


def test_a_stream_to_another_user_is_closed(make_node: MakeNode, monkeypatch: pytest.MonkeyPatch) -> None:
    talker, listener = make_node("talker"), make_node("listener")
    publisher = talker.advertise("chat", String)
    monkeypatch.setattr(local_stream, "is_from_same_user", lambda _: False)
    listener.subscribe("chat", String, Inbox())
    wait_until_connected(publisher, 1)
    assert transports(talker) == transports(listener) == ["TCPROS"]
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as stranger:
        stranger.settimeout(30)
        stranger.connect(f"\0{talker.endpoints.local_name}")
        assert stranger.recv(1) == b""


def test_a_publisher_that_refuses_says_why_as_over_tcp(make_node: MakeNode) -> None:
    log, lines = listening_log()
    talker, listener = make_node("talker"), make_node("listener", log=log)
    talker.advertise("chat", String)
    listener.subscribe("chat", load_message_class("std_msgs/Int32"), Inbox())
    wait_until(lambda: lines)
    assert "md5sum" in lines[0], lines
    assert talker.connections.accepted == 0


def test_a_short_burst_to_a_subscriber_that_does_not_read_loses_nothing(make_node: MakeNode) -> None:
    talker, listener = make_node("talker"), make_node("listener")
    publisher = talker.advertise("chat", String, queue_size=10)
    inbox = Inbox.of(listener, "chat", String)
    wait_until_connected(publisher, 1)
    for number in range(2000):
        publisher.publish(String(data=str(number)))
    assert [message.data for message in inbox.wait(2000)] == [str(number) for number in range(2000)]


# -- services -------------------------------------------------------------------------


def test_plain_calls_share_a_connection_and_their_header(make_node: MakeNode, transport: str) -> None:
    server, client = make_node("server"), make_node("client")
    headers: list[dict[str, str]] = []

    def handle(request: Any) -> Any:
        headers.append(dict(request._connection_header))
        return answer("done")(request)

    server.serve("set", SetBool, handle)
    proxy = client.client("set", SetBool)
    for _ in range(3):
        assert proxy.call(ON).message == "done"
    assert headers == 3 * [{"service": "/set", "md5sum": SetBool._md5sum, "callerid": "/client"}]
    assert server.connections.accepted == (1 if transport == PROTOCOL else 3)
    proxy.close()
    wait_until(lambda: not len(server.connections))


def test_a_call_after_the_server_closed_the_idle_connection_succeeds(make_node: MakeNode) -> None:
    server, client = make_node("server"), make_node("client")
    service = server.serve("set", SetBool, answer("done"))
    proxy = client.client("set", SetBool)
    for _ in range(20):
        assert proxy.call(ON).message == "done"
        server.connections.close_all()
    assert service.calls == 20


def test_a_request_sent_before_the_server_ends_the_connection_is_answered(make_node: MakeNode) -> None:
    server, client = make_node("server"), make_node("client")
    is_ending: list[bool] = []

    def handle(request: Any) -> Any:
        server.connections.close_all()
        is_ending.append(True)
        return answer("done")(request)

    service = server.serve("set", SetBool, handle)
    link = ServiceLink(server.endpoints.service_uri, "/set", client.name, INTERFACE, deadline=None)
    assert link.call("/set", ON, None)
    with pytest.raises(ServiceFailed) as failure:
        link.call("/set", ON, None)
    assert isinstance(failure.value, NotDelivered), "the server reads no second request"
    assert service.calls == 1


def test_a_kept_connection_is_not_used_for_a_server_that_was_replaced(make_node: MakeNode) -> None:
    client = make_node("client")
    proxy = client.client("set", SetBool)
    first = make_node("first").serve("set", SetBool, answer("first"))
    assert proxy.call(ON).message == "first"
    second = make_node("second")
    replacement = second.serve("set", SetBool, answer("second"))
    assert proxy.call(ON).message == "second"
    second.endpoints.stop_serving(replacement)
    with pytest.raises(ServiceFailed, match=r"service \[/set\] unavailable"):
        proxy.call(ON)
    assert first.calls == 1


def test_calls_with_extra_fields_have_a_connection_each(make_node: MakeNode) -> None:
    server, client = make_node("server"), make_node("client")
    server.serve("set", SetBool, answer("done"))
    proxy = client.client("set", SetBool, headers={"secret": "x"})
    for _ in range(3):
        proxy.call(ON)
    assert server.connections.accepted == 3
    wait_until(lambda: not len(server.connections))


def test_a_client_that_is_collected_closes_its_connections(make_node: MakeNode) -> None:
    server, client = make_node("server"), make_node("client")
    server.serve("set", SetBool, answer("done"))
    proxy = client.client("set", SetBool)
    proxy.call(ON)
    assert len(server.connections) == 1
    del proxy
    gc.collect()
    wait_until(lambda: not len(server.connections))
