"""What the requests of one Foxglove client make the server read and keep, counted in bytes."""

import struct
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import String
from websockets.exceptions import ConnectionClosed

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.node import Node
from pipros_bridges.foxglove.handler import Rules
from tests.support.foxglove import connected, serving
from tests.support.memory import memory_of
from tests.support.node_fixtures import make_node as make_node
from tests.support.node_fixtures import master as master
from tests.support.nodes import MakeNode
from tests.support.waiting import wait_until

MIB = 1024 * 1024
READER = Rules(max_poll_s=0.2)
URI = "package://my_robot/meshes/arm.stl"


@pytest.fixture
def packages(tmp_path: Path) -> Path:
    """A folder with a package that contains a mesh of 8 MiB."""
    meshes = tmp_path / "src" / "my_robot" / "meshes"
    meshes.mkdir(parents=True)
    (meshes.parent / "package.xml").write_text("<package><name>my_robot</name></package>")
    (meshes / "arm.stl").write_bytes(b"solid!!!" * MIB)
    return tmp_path / "src"


def test_a_client_that_requests_a_mesh_repeatedly_and_reads_nothing_costs_one_copy(
    master: Master, packages: Path
) -> None:
    environment = Environment(master_uri=master.uri, package_path=(packages,))
    with (
        Node("bridge", environment=environment) as node,
        serving(node, READER) as address,
        connected(address, max_queue=1, close_timeout=1) as greedy,  # it reads at most two messages ahead
    ):
        topic = node.advertise("/noticed", String)
        channel: Any = greedy.until(lambda: greedy.channels.get("/noticed"))
        with memory_of(60 * MIB):
            for number in range(100):
                greedy.send("fetchAsset", uri=URI, requestId=number)
            greedy.send("subscribe", subscriptions=[{"id": 1, "channelId": channel["id"]}])
            wait_until(lambda: topic.connection_count == 1)  # after all its requests
            with connected(address) as other:
                other.send("fetchAsset", uri=URI, requestId=9)
                answer = other.next_binary(4)
        assert answer[:5] == struct.pack("<IB", 9, 0)
        assert len(answer) > 8 * MIB


def test_a_client_that_subscribes_to_too_many_parameters_is_disconnected_with_the_reason(
    make_node: MakeNode,
) -> None:
    with serving(make_node("bridge"), READER) as address, connected(address) as client, memory_of(40 * MIB):
        with suppress(ConnectionClosed):
            for number in range(200):
                names = [f"/p{number}_{each}_{'x' * 20_000}" for each in range(5)]
                client.send("subscribeParameterUpdates", parameterNames=names)
        with pytest.raises(ConnectionClosed, match="the limit is 4194304 bytes"):
            client.until(lambda: False)  # read until the end


def test_parameters_without_a_legal_name_are_not_kept(make_node: MakeNode) -> None:
    with serving(make_node("bridge"), READER) as address, connected(address) as client:
        client.send("subscribeParameterUpdates", parameterNames=["x y" * 100_000])
        text = client.next("status")["message"]
        assert "is not a legal parameter name" in text
        assert len(text) < 1000
