"""Fixtures: a master and nodes in the test's own process."""

from tests.graph.unlinked import unlinked as unlinked
from tests.support.node_fixtures import make_node as make_node
from tests.support.node_fixtures import master as master
from tests.support.node_fixtures import transport as transport
