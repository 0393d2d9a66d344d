"""Fixtures: a master and nodes in the test's own process."""

import pytest

from pipros.master.master import Master
from tests.support.node_fixtures import client as client
from tests.support.node_fixtures import make_node as make_node
from tests.support.node_fixtures import master as master
from tests.support.node_fixtures import transport as transport
from tests.support.ros import Commands, RosSystem


@pytest.fixture
def commands(ros: RosSystem, master: Master) -> Commands:
    return Commands(ros, master.uri)
