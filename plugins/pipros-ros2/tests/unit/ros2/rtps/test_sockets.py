"""The sockets of a participant: which ports it takes, what it announces, and whom it looks for."""

import contextlib
import math
import socket
from collections.abc import Iterator
from contextlib import closing

import pytest

from pipros.basics.errors import Unreachable
from pipros.basics.graph_variables import InvalidEnvironment
from pipros_ros2.rtps.domain import (
    MAX_PARTICIPANT,
    PROBED_PARTICIPANTS,
    Discovery,
    DiscoveryRange,
    data_port,
    discovery_port,
    multicast_port,
)
from pipros_ros2.rtps.outbox import Outgoing
from pipros_ros2.rtps.parameters import Address
from pipros_ros2.rtps.sockets import RtpsSockets, SocketBacklog, interface_addresses
from tests.support.network import steady_interfaces
from tests.support.ros2_domains import free_domain
from tests.support.waiting import wait_until


@pytest.fixture
def domain() -> Iterator[int]:
    with free_domain() as free:
        yield free


@contextlib.contextmanager
def sockets(
    domain: int, where: DiscoveryRange = DiscoveryRange.LOCALHOST, *peers: str
) -> Iterator[RtpsSockets]:
    with closing(RtpsSockets(Discovery(domain, where, peers))) as opened:
        yield opened


def test_participants_of_a_domain_take_ports_in_turn(domain: int) -> None:
    with sockets(domain) as one, sockets(domain) as other:
        (here,), (there,) = one.discovery, other.discovery

        assert (here.host, there.host) == ("127.0.0.1", "127.0.0.1")
        assert here.port < there.port
        assert [each.data[0].port - each.discovery[0].port for each in (one, other)] == [1, 1]
        assert here not in one.announce_to
        assert there in one.announce_to
        assert len(one.announce_to) == PROBED_PARTICIPANTS - 1


@pytest.mark.parametrize(
    ("where", "peer"), [(DiscoveryRange.OFF, "192.0.2.7"), (DiscoveryRange.LOCALHOST, "localhost")]
)
def test_only_loopback_is_bound_if_other_machines_are_not_reached(
    domain: int, where: DiscoveryRange, peer: str
) -> None:
    with sockets(domain, where, peer) as found:
        assert {each.getsockname()[0] for each in found.receiving} == {"127.0.0.1"}
        assert {each.host for each in (*found.discovery, *found.data)} == {"127.0.0.1"}


def test_a_full_domain_is_reported(domain: int) -> None:
    with contextlib.ExitStack() as taken:
        for number in range(MAX_PARTICIPANT + 1):
            port = taken.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            with contextlib.suppress(OSError):  # another program has it
                port.bind(("127.0.0.1", discovery_port(domain, number)))

        with pytest.raises(Unreachable, match=f"domain {domain}.*in use"):
            RtpsSockets(Discovery(domain))


def test_datagrams_arrive_in_one_piece(domain: int) -> None:
    with sockets(domain) as one, sockets(domain) as other:
        one.send(
            [Outgoing(Address("127.0.0.1", 0), (b"refused",)), Outgoing(other.data[0], (b"one", b"two"))]
        )
        found: list[bytes] = []

        def has_arrived() -> bool:
            with contextlib.suppress(BlockingIOError):
                found.append(other.receiving[1].recv(100))
            return bool(found)

        wait_until(has_arrived)
        assert found == [b"onetwo"]


def test_static_peers_are_looked_for_at_all_ports(domain: int) -> None:
    with sockets(domain, DiscoveryRange.LOCALHOST, "192.0.2.7", "::1") as found:
        ports = {each.port for each in found.announce_to if each.host == "192.0.2.7"}

        assert ports == {discovery_port(domain, number) for number in range(PROBED_PARTICIPANTS)}
        assert {each.host for each in found.announce_to} == {"127.0.0.1", "192.0.2.7"}


def test_no_address_is_announced_to_if_the_range_is_off(domain: int) -> None:
    with sockets(domain, DiscoveryRange.OFF, "192.0.2.7") as found:
        assert found.announce_to == ()


def test_the_group_is_announced_to_on_a_subnet(domain: int) -> None:
    with steady_interfaces(), sockets(domain, DiscoveryRange.SUBNET) as found:
        assert found.announce_to[0] == Address("239.255.0.1", 7400 + 250 * domain)
        assert len(found.receiving) == 3
        assert {each.host for each in found.discovery} <= set(interface_addresses())
        own = [each for each in interface_addresses() if not each.startswith("127.")]
        assert len(found.discovery) == max(1, len(own))


def test_loopback_is_the_last_interface() -> None:
    found = interface_addresses()

    assert found[-1].startswith("127.")
    assert len(set(found)) == len(found)


# Ports, and the variables of ROS 2 about discovery.


def test_ports_are_those_of_the_standard() -> None:
    assert (multicast_port(0), discovery_port(0, 0), data_port(0, 0)) == (7400, 7410, 7411)
    assert (multicast_port(101), discovery_port(101, 2), data_port(101, 2)) == (32650, 32664, 32665)


@pytest.mark.parametrize(("variables", "expected"), [
    ({}, DiscoveryRange.LOCALHOST), ({"ROS_LOCALHOST_ONLY": "0"}, DiscoveryRange.SUBNET),
    ({"ROS_LOCALHOST_ONLY": "1"}, DiscoveryRange.LOCALHOST),
    ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, DiscoveryRange.SUBNET),
    ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT"}, DiscoveryRange.SUBNET),
    ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}, DiscoveryRange.OFF),
    ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET", "ROS_LOCALHOST_ONLY": "1"}, DiscoveryRange.LOCALHOST),
])  # fmt: skip
def test_the_range_follows_the_variables(variables: dict[str, str], expected: DiscoveryRange) -> None:
    assert Discovery.from_environment(variables).range is expected


def test_domain_and_static_peers_are_read() -> None:
    found = Discovery.from_environment({"ROS_DOMAIN_ID": "7", "ROS_STATIC_PEERS": "10.0.0.2; robot ;"})

    assert (found.domain, found.static_peers) == (7, ("10.0.0.2", "robot"))


@pytest.mark.parametrize(("name", "value"), [
    ("ROS_DOMAIN_ID", "102"), ("ROS_DOMAIN_ID", "-1"), ("ROS_DOMAIN_ID", "one"),
    ("ROS_AUTOMATIC_DISCOVERY_RANGE", "EVERYWHERE"),
])  # fmt: skip
def test_invalid_values_are_named(name: str, value: str) -> None:
    with pytest.raises(InvalidEnvironment, match=value):
        Discovery.from_environment({name: value})


# Datagrams that have been read but not yet handled.


@pytest.fixture
def ends() -> Iterator[tuple[socket.socket, socket.socket]]:
    """Two sockets, of which the first one sends to the second one."""
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sending,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiving,
    ):
        receiving.bind(("127.0.0.1", 0))
        receiving.setblocking(False)
        sending.connect(receiving.getsockname())
        yield sending, receiving


def test_datagrams_are_returned_in_their_order(ends: tuple[socket.socket, socket.socket]) -> None:
    backlog = SocketBacklog(10_000)
    for number in range(3):
        ends[0].send(b"%d" % number)
    backlog.read([ends[1]], 1.0)

    assert [backlog.next() for _ in range(4)] == [
        *((b"%d" % number, "127.0.0.1") for number in range(3)),
        None,
    ]
    assert not backlog


def test_datagrams_that_were_not_returned_are_not_handled(ends: tuple[socket.socket, socket.socket]) -> None:
    backlog = SocketBacklog(10_000)
    assert backlog.handled_until == -math.inf
    ends[0].send(b"one")
    backlog.read([ends[1]], 1.0)
    ends[0].send(b"two")
    backlog.read([ends[1]], 2.0)
    found = [backlog.handled_until]
    for _ in range(2):
        backlog.next()
        found.append(backlog.handled_until)

    assert found == [1.0, 2.0, 2.0]


def test_a_flood_of_one_sender_delays_and_displaces_only_its_own_datagrams(
    ends: tuple[socket.socket, socket.socket],
) -> None:
    backlog = SocketBacklog(5_000)
    for _ in range(20):
        ends[0].send(bytes(300))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.sendto(b"mine", ends[1].getsockname())
    backlog.read([ends[1]], 1.0)

    found = []
    while (datagram := backlog.next()) is not None:
        found.append(datagram[0])
    assert found[1] == b"mine"
    assert len(found) == 1 + 5  # half of the limit
    assert backlog.handled_until == 1.0
