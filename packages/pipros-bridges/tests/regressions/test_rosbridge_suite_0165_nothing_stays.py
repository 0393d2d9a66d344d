"""rosbridge_suite#165, ros_comm#533, #610: processes that opened and closed topics kept growing."""

import gc
import sys
import weakref
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from tests.chaos.counting import count, wait_until_back
from tests.support.nodes import Inbox, wait_until_connected
from tests.support.waiting import wait_until

String: Any = load_message_class("std_msgs/String")
SetBool: Any = load_service_class("std_srvs/SetBool")


@pytest.mark.skipif(sys.platform != "linux", reason="counts descriptors in /proc")
def test_nodes_that_end_leave_no_thread_descriptor_or_object(master: Master) -> None:
    environment = Environment(master_uri=master.uri)

    def live() -> weakref.ref[Node]:
        with (
            Node("talker", environment=environment) as talker,
            Node("listener", environment=environment) as node,
        ):
            inbox = Inbox()
            node.subscribe("chat", String, inbox)
            publisher = talker.advertise("chat", String, latch=True)
            wait_until_connected(publisher)
            publisher.publish(String("x"))
            inbox.wait()
            talker.serve("set", SetBool, lambda _: SetBool._response_class(success=True))
            assert node.client("set", SetBool).call(SetBool._request_class(), 30).success
            node.params.set("/a", 1)
            assert node.params.get_cached("/a") == 1
            return weakref.ref(node)

    live()
    before = count()
    nodes = [live() for _ in range(20)]
    wait_until_back(before)

    def are_gone() -> bool:  # a thread may keep the last one for a moment
        gc.collect()
        return [node() for node in nodes] == [None] * 20

    wait_until(are_gone)
