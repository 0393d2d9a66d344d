"""One bad publisher, subscriber or service among good ones closes only its own link."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import Any

import pytest

from pipros.basics.errors import PiprosError
from pipros.master.master import Master
from pipros.msg import load_message_class, load_service_class
from pipros.net.master_client import MasterClient
from tests.support.nodes import Inbox, MakeNode
from tests.support.slaves import GarbageServer, SilentSlave
from tests.support.waiting import wait_until

STRING: Any = load_message_class("std_msgs/String")
INT32: Any = load_message_class("std_msgs/Int32")
TRIGGER: Any = load_service_class("std_srvs/Trigger")
PLACES = pytest.mark.parametrize("place", range(3), ids=["first", "middle", "last"])
KINDS = ["dead", "silent", "garbage", "no URI", "other type"]


@pytest.fixture
def add_bad(master: Master, make_node: MakeNode) -> Iterator[Callable[[str, bool], None]]:
    """Return a function that registers a bad publisher or subscriber of `/topic`, and a bad service."""
    with ExitStack() as stack:

        def add(kind: str, is_publisher: bool) -> None:
            if kind == "other type":
                node = make_node("bad")
                if is_publisher:
                    node.advertise("/topic", INT32, latch=True).publish(INT32(5))
                else:
                    node.subscribe("/topic", INT32, lambda _: None)
                return
            api = {"dead": "http://127.0.0.1:1/", "no URI": "http://[::1"}.get(kind, "")
            if kind == "silent":
                silent = SilentSlave()
                stack.callback(silent.stop)
                api = silent.api
            elif kind == "garbage":
                garbage = GarbageServer(b"\xff\x00\xff\xff garbage\r\n\r\n")
                stack.callback(garbage.stop)
                api = f"http://127.0.0.1:{garbage.port}/"
            client = MasterClient(master.uri, "/bad")
            register = client.register_publisher if is_publisher else client.register_subscriber
            register("/topic", "std_msgs/String", api)
            client.register_service("/bad_service", f"rosrpc://{api.partition('://')[2]}", api)
            client.close()

        yield add


@PLACES
@pytest.mark.parametrize("kind", KINDS)
def test_a_subscriber_hears_the_good_publishers(
    kind: str, place: int, make_node: MakeNode, add_bad: Callable[[str, bool], None]
) -> None:
    for number in range(3):
        if number == place:
            add_bad(kind, True)
        else:
            make_node(f"good_{number}").advertise("/topic", STRING, latch=True).publish(
                STRING(f"from {number}")
            )
    inbox = Inbox()
    make_node("listener").subscribe("/topic", STRING, inbox)
    heard = {f"from {number}" for number in range(3) if number != place}
    wait_until(lambda: {message.data for message in inbox.messages} == heard)


@PLACES
@pytest.mark.parametrize("kind", KINDS)
def test_a_publisher_reaches_the_good_subscribers(
    kind: str, place: int, make_node: MakeNode, add_bad: Callable[[str, bool], None]
) -> None:
    inboxes = []
    for number in range(3):
        if number == place:
            add_bad(kind, False)
        else:
            inboxes.append(Inbox())
            make_node(f"good_{number}").subscribe("/topic", STRING, inboxes[-1])
    make_node("talker").advertise("/topic", STRING, latch=True).publish(STRING("hello"))
    for inbox in inboxes:
        assert inbox.wait()[0].data == "hello"


@pytest.mark.parametrize("kind", KINDS[:-1])
def test_the_good_services_of_a_caller_answer(
    kind: str, make_node: MakeNode, add_bad: Callable[[str, bool], None]
) -> None:
    add_bad(kind, True)
    make_node("server").serve("/good_service", TRIGGER, lambda _: TRIGGER._response_class(True, "yes"))
    caller = make_node("caller")
    bad, good = (caller.client(name, TRIGGER) for name in ("/bad_service", "/good_service"))
    with pytest.raises(PiprosError):
        bad.call(TRIGGER._request_class(), 0.5)
    assert good.call(TRIGGER._request_class(), 30.0).message == "yes"
