"""Nodes without links on a master of the test, for tests that call their callbacks."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from pipros.basics.env import Environment
from tests.support.ros import RosSystem
from tests.support.unlinked_node import UnlinkedNode

Unlinked = Callable[..., UnlinkedNode]


@pytest.fixture
def unlinked(ros: RosSystem) -> Iterator[Unlinked]:
    """Return a function that starts a node with private parameters: `unlinked("amcl", {"use_map": True})`."""
    ros.serve_master()
    nodes: list[UnlinkedNode] = []

    def made(name: str, parameters: Any, **options: Any) -> UnlinkedNode:
        node = UnlinkedNode(name, environment=Environment(master_uri=ros.master_uri), **options)
        nodes.append(node)
        node.start()
        for key, value in parameters.items():
            node.params.set(f"~{key}", value)
        return node

    yield made
    for node in nodes:
        node.shutdown()
