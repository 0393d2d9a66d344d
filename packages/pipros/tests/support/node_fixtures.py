"""Fixtures for a master and nodes in the test's process."""

from collections.abc import Iterator
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.net.local_stream import PROTOCOL, SWITCH
from pipros.net.master_client import MasterClient
from pipros.node import Node
from tests.support.nodes import MakeNode


@pytest.fixture
def master() -> Iterator[Master]:
    with Master(port=0) as running:
        yield running


@pytest.fixture
def client(master: Master) -> Iterator[MasterClient]:
    client = MasterClient(master.uri, "/test")
    yield client
    client.close()


@pytest.fixture(params=[PROTOCOL, "TCPROS"])
def transport(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Run a test with Unix streams and again with TCP. Return the transport's name."""
    name = str(request.param)
    monkeypatch.setenv(SWITCH, "on" if name == PROTOCOL else "off")
    return name


@pytest.fixture
def make_node(master: Master) -> Iterator[MakeNode]:
    """Return a function that starts nodes on the master. They are shut down after the test."""
    nodes: list[Node] = []

    def make(name: str, **options: Any) -> Node:
        node = Node(name, environment=Environment(master_uri=master.uri), **options)
        nodes.append(node)
        node.start()
        return node

    yield make
    for node in nodes:
        node.shutdown("end of the test")
