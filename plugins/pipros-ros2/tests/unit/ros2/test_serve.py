"""Which gateways reach ROS 2 on this machine only, and the rate limits of topics."""

from __future__ import annotations

import math
import socket

import pytest

from pipros_ros2.bridged_topics import RateLimit
from pipros_ros2.rtps.domain import Discovery, DiscoveryRange, multicast_port
from pipros_ros2.rtps.unseen import hint_for
from pipros_ros2.rules import GatewayRules
from pipros_ros2.serve import GatewayOptions
from pipros_ros2.type_pairs import TypePairs
from pipros_rosbag2.conversion.mapping import BUILTIN_RULES
from pipros_rosbag2.distribution import Distribution
from tests.support.ros2_domains import free_domain


@pytest.mark.parametrize(("variables", "is_local"), [
    ({}, True), ({"ROS_DOMAIN_ID": "7"}, True), ({"ROS_LOCALHOST_ONLY": "1"}, True),
    ({"ROS_LOCALHOST_ONLY": "0"}, False), ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, False),
    ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT"}, False),
    ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}, True),
    ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF", "ROS_STATIC_PEERS": "192.168.1.5"}, True),
    ({"ROS_STATIC_PEERS": "127.0.0.1;localhost"}, True), ({"ROS_STATIC_PEERS": "192.168.1.5"}, False),
    ({"ROS_STATIC_PEERS": "robot"}, False),
])  # fmt: skip
def test_other_machines_are_reached_as_the_variables_say(variables: dict[str, str], is_local: bool) -> None:
    pairs = TypePairs(Distribution.JAZZY, BUILTIN_RULES)
    discovery = Discovery.from_environment(variables)

    assert GatewayOptions(discovery, GatewayRules(), pairs).is_local is is_local
    assert not GatewayOptions(discovery, GatewayRules(), pairs, routers=["tcp/localhost:7447"]).is_local


def test_a_discovery_server_of_rclpy_may_be_on_another_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    pairs = TypePairs(Distribution.JAZZY, BUILTIN_RULES)
    options = GatewayOptions(Discovery(), GatewayRules(), pairs, ros2_python="python3")

    assert options.is_local
    monkeypatch.setenv("ROS_DISCOVERY_SERVER", "192.168.1.5:11811")
    assert not options.is_local


def test_a_pace_admits_the_first_message_and_refuses_one_at_once() -> None:
    slow, fast = RateLimit(0.001), RateLimit(math.inf)

    assert [slow.admits() for _ in range(3)] == [True, False, False]
    assert all(fast.admits() for _ in range(3))


@pytest.mark.needs("/proc")
def test_a_gateway_hints_at_programs_that_announce_themselves_by_multicast_only() -> None:
    with free_domain() as domain, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as program:
        assert hint_for(Discovery(domain)) is None
        program.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        program.bind(("127.0.0.1", multicast_port(domain)))

        hint = hint_for(Discovery(domain))

        assert hint is not None
        assert "ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET" in hint
        assert hint_for(Discovery(domain, DiscoveryRange.SUBNET)) is None
