"""Ports, and the variables of ROS 2 about discovery."""

from __future__ import annotations

import pytest

from pipros.basics.graph_variables import InvalidEnvironment
from pipros_ros2.rtps.domain import Discovery, DiscoveryRange, data_port, discovery_port, multicast_port


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
