"""Services between nodes of one process, over real connections."""

import socket
import struct
import threading
from collections.abc import Callable
from typing import Any

import pytest
from std_srvs.srv import Empty, SetBool

from pipros.net.master_client import MasterClient
from pipros.net.workers import Workers
from pipros.node.endpoints import NameInUse
from pipros.node.open_calls import OpenCalls
from pipros.node.service_client import ServiceClient
from pipros.node.service_link import CallTimeout, ServiceFailed
from pipros.node.timings import NodeTimings
from pipros.wire.header import encode_header
from tests.support.nodes import MakeNode, listening_log
from tests.support.waiting import wait_until

ON = SetBool._request_class(data=True)

pytestmark = pytest.mark.usefixtures("transport")


def answer(text: str) -> Callable[[Any], Any]:
    return lambda request: SetBool._response_class(success=request.data, message=text)


def test_a_call_is_answered(make_node: MakeNode) -> None:
    server, client = make_node("server"), make_node("client")
    server.serve("set", SetBool, answer("done"))
    response = client.client("/set", SetBool).call(ON)
    assert (response.success, response.message) == (True, "done")


def test_a_persistent_client_keeps_its_connection_and_survives_errors(make_node: MakeNode) -> None:
    log, lines = listening_log()
    server, client = make_node("server", log=log), make_node("client")
    headers: list[Any] = []

    def handle(request: Any) -> Any:
        headers.append(request._connection_header)
        if not request.data:
            raise ValueError("only true")
        return SetBool._response_class(success=True)

    server.serve("set", SetBool, handle)
    proxy = client.client("set", SetBool, persistent=True, headers={"origin": "x"})
    assert proxy.call(ON).success
    with pytest.raises(
        ServiceFailed, match=r"responded with an error: b'error processing request: only true'"
    ):
        proxy.call(SetBool._request_class(data=False))
    assert proxy.call(ON).success
    assert headers[0] is headers[2]
    assert headers[0]["origin"] == "x"
    assert lines == ["Error processing request: only true"]
    proxy.close()


def test_a_persistent_client_connects_again_after_its_server_was_gone(make_node: MakeNode) -> None:
    client = make_node("client")
    proxy = client.client("set", SetBool, persistent=True)
    for number in range(2):
        server = make_node("server")
        server.serve("set", SetBool, answer(str(number)))
        assert proxy.call(ON).message == str(number)
        server.shutdown("restart")
        with pytest.raises(ServiceFailed):
            proxy.call(ON)


def test_a_call_may_be_given_a_time_limit(make_node: MakeNode) -> None:
    server, client, gate = make_node("server"), make_node("client"), threading.Event()
    server.serve("slow", Empty, lambda _: (gate.wait(10), Empty._response_class())[1])
    with pytest.raises(CallTimeout, match=r"service \[/slow\] did not answer in time"):
        client.client("slow", Empty).call(Empty._request_class(), timeout_s=0.5)
    gate.set()


def test_a_time_limit_also_applies_to_the_look_up_at_the_master() -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        master = MasterClient(f"http://127.0.0.1:{silent.getsockname()[1]}", "/client")
        proxy = ServiceClient("/set", SetBool, master=lambda: master, calls=OpenCalls())
        with pytest.raises(CallTimeout, match="unable to contact master"):
            proxy.call(ON, timeout_s=0.1)
        with pytest.raises(CallTimeout, match="unable to contact master"):
            proxy.probe(0.1)


def test_a_missing_server_and_another_type_have_different_errors(make_node: MakeNode) -> None:
    server, client = make_node("server"), make_node("client")
    server.serve("set", SetBool, answer(""))
    with pytest.raises(ServiceFailed, match=r"service \[/nobody\] unavailable"):
        client.client("nobody", Empty).call(Empty._request_class())
    with pytest.raises(ServiceFailed, match=r"remote error reported: .*md5sums do not match"):
        client.client("set", Empty).call(Empty._request_class())


def test_a_crashed_server_is_unreachable(make_node: MakeNode) -> None:
    client = make_node("client")
    for host, words in (("robot.invalid", r"resolve the name \[robot.invalid\]"), ("127.0.0.1", "is local")):
        client.master.register_service("/ghost", f"rosrpc://{host}:1", client.uri)
        with pytest.raises(ServiceFailed, match=rf"unable to connect to service: .*{words}"):
            client.client("ghost", Empty).call(Empty._request_class())
    with pytest.raises(ServiceFailed):
        client.client("ghost", Empty).probe(1.0)


PATIENT = NodeTimings(early_connect_s=30.0)
"""Clients have more time to connect early, because the machine may be busy."""


def test_each_call_goes_to_the_server_that_the_master_names(make_node: MakeNode) -> None:
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
    assert first.calls == 1  # it still listens


def test_a_call_reaches_a_server_that_has_moved_from_a_silent_address(make_node: MakeNode) -> None:
    client = make_node("client")
    proxy = client.client("set", SetBool)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        port = silent.getsockname()[1]
        client.master.register_service("/set", f"rosrpc://127.0.0.1:{port}", client.uri)
        for _ in range(2):
            with pytest.raises(CallTimeout):
                proxy.call(ON, timeout_s=0.1)
        make_node("server").serve("set", SetBool, answer("done"))
        assert proxy.call(ON).message == "done"


@pytest.mark.parametrize("transport", ["TCPROS"], indirect=True)
def test_a_client_connects_to_the_server_of_its_last_call_while_the_master_responds(
    make_node: MakeNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    server, client = make_node("server"), make_node("client", timings=PATIENT)
    service = server.serve("set", SetBool, answer("done"))
    proxy = client.client("set", SetBool)
    proxy.call(ON)
    events: list[str] = []
    connect, lookup_service = proxy._link, client.master.lookup_service

    def recording_connect(uri: str, deadline: float | None) -> Any:
        events.append("connecting")
        return connect(uri, deadline)

    def recording_lookup(name: str, meanwhile: Callable[[], None], **options: Any) -> str:
        uri = lookup_service(name, meanwhile, **options)
        events.append("looked up")
        return uri

    monkeypatch.setattr(proxy, "_link", recording_connect)
    monkeypatch.setattr(client.master, "lookup_service", recording_lookup)
    assert proxy.call(ON).message == "done"
    assert (events, service.calls) == (["connecting", "looked up"], 2)


def test_a_server_that_closes_the_early_connection_is_connected_to_again(make_node, monkeypatch) -> None:
    server, client = make_node("server"), make_node("client", timings=PATIENT)
    server.serve("set", SetBool, answer("done"))
    proxy = client.client("set", SetBool)
    proxy.call(ON)
    lookup_service = client.master.lookup_service

    def slow_lookup(name: str, meanwhile: Callable[[], None], **options: Any) -> str:
        uri = lookup_service(name, meanwhile, **options)
        server.connections.close_all()
        return uri

    monkeypatch.setattr(client.master, "lookup_service", slow_lookup)
    assert proxy.call(ON).message == "done"


def test_an_interrupted_early_connection_ends_the_call(make_node: MakeNode) -> None:
    client = make_node("client", timings=PATIENT)
    proxy = client.client("set", SetBool)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        uri = f"rosrpc://127.0.0.1:{silent.getsockname()[1]}"
        client.master.register_service("/set", uri, client.uri)
        proxy._expected_uri = uri

        def interrupt() -> None:
            accepted, _ = silent.accept()
            proxy.calls.interrupt_present()
            accepted.close()

        interrupting = threading.Thread(target=interrupt)
        interrupting.start()
        with pytest.raises(ServiceFailed, match="the call was interrupted"):
            proxy.call(ON)
        interrupting.join()


def test_extra_header_fields_are_sent_only_to_the_server_that_the_master_names(make_node: MakeNode) -> None:
    client = make_node("client")
    proxy = client.client("set", SetBool, headers={"token": "secret"})
    with socket.create_server(("127.0.0.1", 0)) as stranger:
        stranger.settimeout(0.0)
        proxy._expected_uri = f"rosrpc://127.0.0.1:{stranger.getsockname()[1]}"
        make_node("server").serve("set", SetBool, answer("done"))
        assert proxy.call(ON).message == "done"
        with pytest.raises(BlockingIOError):
            stranger.accept()


def test_threads_that_share_a_client_all_connect_early(make_node: MakeNode) -> None:
    make_node("server").serve("set", SetBool, answer("done"))
    proxy = make_node("client", timings=PATIENT).client("set", SetBool)
    together = threading.Barrier(4)

    def call() -> None:
        together.wait()
        proxy.call(ON)

    threads = [threading.Thread(target=call) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert proxy._expected_uri == proxy.uri is not None


def test_a_probe_connects_without_a_call(make_node: MakeNode) -> None:
    server, client = make_node("server"), make_node("client")
    service = server.serve("set", SetBool, answer(""))
    client.client("set", SetBool).probe(60.0)
    assert service.calls == 0


def test_a_name_can_be_served_again_after_shutdown(make_node: MakeNode) -> None:
    node = make_node("node")
    first = node.serve("set", SetBool, answer("1"))
    with pytest.raises(NameInUse, match=r"service \[/set\] already registered"):
        node.serve("set", SetBool, answer("2"))
    node.endpoints.stop_serving(first)
    node.endpoints.stop_serving(first)
    node.serve("set", SetBool, answer("2"))
    assert node.client("set", SetBool).call(ON).message == "2"


def test_a_slow_handler_does_not_delay_other_calls(make_node: MakeNode) -> None:
    server, client, gate = make_node("server"), make_node("client"), threading.Event()
    entered = threading.Event()

    def handle(request: Any) -> Any:
        if request.data:
            entered.set()
            gate.wait(60)
        return SetBool._response_class()

    server.serve("set", SetBool, handle)
    slow = threading.Thread(target=client.client("set", SetBool).call, args=(ON,))
    slow.start()
    assert entered.wait(60)
    client.client("set", SetBool).call(SetBool._request_class(data=False))
    assert slow.is_alive()
    gate.set()
    slow.join(10)


def test_a_call_without_a_thread_fails_at_once(make_node: MakeNode, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise RuntimeError("can't start new thread")

    log, lines = listening_log()
    server, client = make_node("server", log=log), make_node("client")
    server.serve("set", SetBool, answer("done"))
    proxy = client.client("set", SetBool)
    with monkeypatch.context() as patch:
        patch.setattr(Workers, "run", refuse)
        with pytest.raises(ServiceFailed):
            proxy.call(ON)
    assert proxy.call(ON).success
    assert lines == ["service [/set]: cannot serve a call: can't start new thread"]


def test_calls_at_interpreter_shutdown_fail_silently(make_node: MakeNode, monkeypatch) -> None:
    def refuse(*_: object) -> None:
        raise RuntimeError("can't create new thread at interpreter shutdown")  # Python 3.12 and later

    log, lines = listening_log()
    server, client = make_node("server", log=log), make_node("client")
    server.serve("set", SetBool, answer("done"))
    monkeypatch.setattr(Workers, "run", refuse)
    with pytest.raises(ServiceFailed):
        client.client("set", SetBool).call(ON)
    assert lines == []


def test_the_end_of_a_node_ends_its_calls(make_node: MakeNode) -> None:
    server, client = make_node("server"), make_node("client")
    entered, gate = threading.Event(), threading.Event()
    server.serve("hang", Empty, lambda _: (entered.set(), gate.wait(60), Empty._response_class())[2])
    errors: list[Exception] = []

    def call() -> None:
        try:
            client.client("hang", Empty).call(Empty._request_class())
        except ServiceFailed as error:
            errors.append(error)

    caller = threading.Thread(target=call)
    caller.start()
    assert entered.wait(60)
    client.shutdown("enough")
    caller.join(60)
    assert "transport error completing service call" in str(errors[0])
    gate.set()


def test_a_malformed_request_ends_only_its_connection(make_node: MakeNode) -> None:
    log, lines = listening_log()
    server, client = make_node("server", log=log), make_node("client")
    server.serve("set", SetBool, answer("still here"))
    with socket.create_connection(("127.0.0.1", server.endpoints.port), 10) as peer:
        fields = {"service": "/set", "md5sum": "*", "callerid": "/bad", "persistent": "1"}
        peer.sendall(encode_header(fields) + struct.pack("<I", 0))
        while peer.recv(4096):
            pass
    wait_until(lambda: lines)
    assert "cannot read a request" in lines[0]
    assert client.client("set", SetBool).call(ON).message == "still here"
