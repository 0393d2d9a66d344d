"""Which gateways reach ROS 2 on this machine only, and the rate limits of topics."""

from __future__ import annotations

import math

import pytest

from pipros.basics.limits import process_limits
from pipros.ros2.bridged_topics import Pace
from pipros.ros2.conversion.mapping import BUILTIN_RULES
from pipros.ros2.distribution import Distribution
from pipros.ros2.rtps.domain import Discovery
from pipros.ros2.rules import GatewayRules
from pipros.ros2.serve import GatewayOptions
from pipros.ros2.type_pairs import TypePairs


@pytest.mark.parametrize(
    ("variables", "is_local"),
    [
        ({}, True),
        ({"ROS_DOMAIN_ID": "7"}, True),
        ({"ROS_LOCALHOST_ONLY": "1"}, True),
        ({"ROS_LOCALHOST_ONLY": "0"}, False),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, False),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT"}, False),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}, True),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF", "ROS_STATIC_PEERS": "192.168.1.5"}, True),
        ({"ROS_STATIC_PEERS": "127.0.0.1;localhost"}, True),
        ({"ROS_STATIC_PEERS": "192.168.1.5"}, False),
        ({"ROS_STATIC_PEERS": "robot"}, False),
    ],
)
def test_other_machines_are_reached_as_the_variables_say(variables: dict[str, str], is_local: bool) -> None:
    pairs = TypePairs(Distribution.JAZZY, BUILTIN_RULES, process_limits())
    discovery = Discovery.from_environment(variables)

    assert GatewayOptions(discovery, GatewayRules(), pairs).is_local is is_local
    assert not GatewayOptions(discovery, GatewayRules(), pairs, routers=["tcp/localhost:7447"]).is_local


def test_a_pace_admits_the_first_message_and_refuses_one_at_once() -> None:
    slow, fast = Pace(0.001), Pace(math.inf)

    assert [slow.admits() for _ in range(3)] == [True, False, False]
    assert all(fast.admits() for _ in range(3))
