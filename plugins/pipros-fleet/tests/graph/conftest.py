"""Fixtures: a router and two members of a fleet, and a master and nodes in the test's own process."""

from collections.abc import Iterator
from contextlib import closing

import pytest

from pipros_fleet.zenoh_session import SessionLink
from tests.support.fleet import Member, link_to, running_router
from tests.support.node_fixtures import make_node as make_node
from tests.support.node_fixtures import master as master
from tests.support.node_fixtures import transport as transport
from tests.support.ports import ClaimedPort


@pytest.fixture
def router(claimed_port: ClaimedPort) -> Iterator[str]:
    """The address of a router, without certificates."""
    with running_router(claimed_port.number) as address:
        yield address


@pytest.fixture
def robot(router: str) -> Iterator[Member]:
    """The member `robot1`, which shares everything and accepts nothing."""
    with Member("robot1", router) as member:
        yield member


@pytest.fixture
def operator(router: str) -> Iterator[Member]:
    with Member("operator", router) as member:
        yield member


@pytest.fixture
def hostile(router: str) -> Iterator[SessionLink]:
    """A link to the router that belongs to no member."""
    with closing(link_to(router)) as link:
        yield link
