"""A bridge while a client, a service or the master does not respond: its other clients are served."""

import base64
import json
import sys

import pytest
from std_msgs.msg import UInt8MultiArray
from std_srvs.srv import SetBool, Trigger

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.master.master import Master
from pipros.net.master_client import MasterClient
from pipros.node import Node
from pipros_bridges.rosapi import RosApi
from tests.support.node_fixtures import make_node as make_node
from tests.support.node_fixtures import master as master
from tests.support.nodes import MakeNode, wait_until_connected
from tests.support.ports import ClaimedPort
from tests.support.processes import Processes
from tests.support.rosbridge import RosbridgeClient, rosbridge_server
from tests.support.slaves import HungService
from tests.support.waiting import wait_until

IMAGES = 30
IMAGE_BYTES = 2_000_000


def responds(master: MasterClient) -> bool:
    try:
        return master.get_pid() > 0
    except PiprosError:
        return False


def test_services_that_hang_leave_room_for_the_calls_of_other_clients(
    master: Master, make_node: MakeNode
) -> None:
    hung = HungService(master.uri, "/hung", SetBool._type, SetBool._md5sum)
    RosApi(make_node("rosapi")).serve()
    make_node("robot").serve("/ready", Trigger, lambda _: Trigger._response_class(success=True))
    try:
        with rosbridge_server(make_node("bridge")) as url, RosbridgeClient(url) as greedy:
            for number in range(300):
                greedy.send("call_service", service="/hung", id=number, args={"data": True})
            wait_until(lambda: hung.open_calls > 1)
            with RosbridgeClient(url) as other:
                assert other.call("/ready")["values"]["success"] is True
                assert "/ready" in other.call("/rosapi/services")["values"]["services"]
            assert "calls from this client are pending" in greedy.wait_for("service_response")["values"]
    finally:
        hung.close()


@pytest.mark.parametrize("compression", ["none", "cbor"])
def test_a_client_that_reads_nothing_costs_another_none_of_its_messages(
    make_node: MakeNode, compression: str
) -> None:
    publisher = make_node("camera").advertise("/image", UInt8MultiArray)
    with (
        rosbridge_server(make_node("bridge")) as url,
        RosbridgeClient(url, max_queue=1) as stopped,  # which reads at most two messages
        RosbridgeClient(url) as other,
    ):
        stopped.send("subscribe", topic="/image", compression=compression)
        other.send("subscribe", topic="/image")
        wait_until_connected(publisher)
        for number in range(IMAGES):
            publisher.publish(UInt8MultiArray(data=bytes([number]) * IMAGE_BYTES))
            values = other.receive(json.loads)["msg"]["data"]
            assert base64.b64decode(values) == bytes([number]) * IMAGE_BYTES


def test_clients_stay_while_the_master_is_killed_and_continue_with_the_next_one(processes: Processes) -> None:
    port = ClaimedPort()
    command = (sys.executable, "-m", "pipros_tools.cli.rosmaster", "--core", "-p", str(port.number))

    def is_up(client: RosbridgeClient) -> bool:
        answer = client.call("/rosapi/topics")
        return answer["result"] is True and "/level" in answer["values"]["topics"]

    try:
        first = processes.start(*command)
        master = MasterClient(port.uri, "/test", timeout_s=30)
        wait_until(lambda: responds(master))
        with Node("bridge", environment=Environment(master_uri=port.uri)) as node:
            RosApi(node).serve("/rosapi/")
            publisher = node.advertise("/level", UInt8MultiArray)
            with rosbridge_server(node) as url, RosbridgeClient(url) as client:
                client.send("subscribe", topic="/level")
                wait_until_connected(publisher)
                first.kill()
                assert client.call("/rosapi/topics")["result"] is False
                publisher.publish(UInt8MultiArray(data=b"\1"))
                assert client.wait_for("publish")["msg"]["data"] == "AQ=="

                processes.start(*command)
                wait_until(lambda: is_up(client))
                with RosbridgeClient(url) as late:
                    late.send("subscribe", topic="/level")
                    wait_until(lambda: "/level" in late.call("/rosapi/topics")["values"]["topics"])

                    def arrives() -> bool:
                        """Publish again: the subscription may be handled after the answer of the service."""
                        publisher.publish(UInt8MultiArray(data=b"\2"))
                        try:
                            return '"Ag=="' in str(late.socket.recv(0.1))
                        except TimeoutError:
                            return False

                    wait_until(arrives)
                    assert client.wait_for("publish")["msg"]["data"] == "Ag=="
    finally:
        port.release()
