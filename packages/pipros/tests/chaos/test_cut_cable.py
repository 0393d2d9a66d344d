"""A cable that is cut between a publisher and one of its subscribers, or between a caller and its server."""

import sys
from collections.abc import Iterator
from typing import Any

import pytest
from std_msgs.msg import String

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.net.timings import LinkTimings
from pipros.node import Node
from pipros.node.timings import NodeTimings
from tests.support.network import FarNetwork, needs_network
from tests.support.nodes import Inbox, listen, wait_until_connected
from tests.support.processes import Process, Processes
from tests.support.waiting import wait_until

pytestmark = [needs_network, pytest.mark.timeout(500)]  # waits for browser tests


LISTENER = """
from pipros.node import Node
from std_msgs.msg import String
with Node("far") as node:
    node.subscribe("chat", String, lambda message: print("heard", message.data[:20].strip(), flush=True))
    node.wait_for_shutdown()
"""
TALKER = """
from pipros.node import Node
from std_msgs.msg import String
with Node("far") as node:
    publisher = node.advertise("chat", String, latch=True)
    publisher.publish(String("hello"))
    node.wait_for_shutdown()
"""


@pytest.fixture
def network() -> Iterator[FarNetwork]:
    network = FarNetwork()
    yield network
    network.close()


@pytest.fixture
def master(network: FarNetwork) -> Iterator[Master]:
    with Master(host=network.near, port=0) as running:
        yield running


@pytest.fixture
def links() -> LinkTimings:
    """Times of the links of `node`, which tests can override."""
    return LinkTimings()


@pytest.fixture
def node(network: FarNetwork, master: Master, links: LinkTimings) -> Iterator[Node]:
    environment = Environment(master_uri=f"http://{network.near}:{master.port}", ip=network.near)
    with Node("near", environment=environment, timings=NodeTimings(links=links)) as running:
        yield running


def start_far(network: FarNetwork, master: Master, processes: Processes, script: str) -> Process:
    uri = f"http://{network.near}:{master.port}"
    return processes.start(
        *network.command(sys.executable, "-c", script),
        environment={"ROS_MASTER_URI": uri, "ROS_IP": network.far},
    )


def numbered(number: int) -> Any:
    return String(f"{number:<100000}")


def test_a_cut_cable_does_not_affect_others_and_the_newest_message_arrives_after_repair(
    network: FarNetwork, master: Master, node: Node, processes: Processes
) -> None:
    far = start_far(network, master, processes, LISTENER)
    inbox = Inbox.of(node, "chat", String)
    publisher = node.advertise("chat", String, queue_size=5)
    wait_until_connected(publisher, 2)
    publisher.publish(numbered(0))
    far.wait_for("heard 0")

    network.cut()
    for number in range(1, 201):
        publisher.publish(numbered(number))
        inbox.wait(number + 1)
    assert publisher.statistics()["dropped"] > 0
    network.mend()

    far.wait_for("heard 200", timeout_s=90)


@pytest.mark.parametrize("links", [LinkTimings(unanswered_s=0.5, check_peer_interval_s=0.05)])
def test_a_subscriber_behind_a_cut_cable_is_dropped_in_time(network, master, node, processes) -> None:
    lines = listen(node.log)
    far = start_far(network, master, processes, LISTENER)
    publisher = node.advertise("chat", String, queue_size=5)
    wait_until_connected(publisher)
    publisher.publish(numbered(0))
    far.wait_for("heard 0")

    network.cut()
    publisher.publish(numbered(1))
    wait_until(lambda: publisher.connection_count == 0, 60)
    network.mend()
    wait_until(lambda: any("it has not acknowledged data for 0.5 s" in line for line in lines))


@pytest.mark.parametrize(
    "links", [LinkTimings(keepalive_idle_s=1, keepalive_interval_s=1, keepalive_count=1)]
)
def test_a_publisher_behind_a_cut_cable_is_dropped_and_reconnected(network, master, node, processes) -> None:
    start_far(network, master, processes, TALKER)
    inbox = Inbox()
    subscriber = node.subscribe("chat", String, inbox)
    inbox.wait()

    network.cut()
    wait_until(lambda: subscriber.connection_count == 0, 60)
    network.mend()

    assert inbox.wait(2)[1].data == "hello"  # latched, over the new link
