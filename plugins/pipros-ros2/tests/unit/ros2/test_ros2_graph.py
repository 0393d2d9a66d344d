"""The ROS 2 topics, services and actions that a gateway finds."""

from __future__ import annotations

import pytest

from pipros.basics.errors import PiprosError
from pipros_ros2.interface import Endpoint, EndpointKind
from pipros_ros2.ros2_graph import Ros2Graph, callable_server

ADD = "example_interfaces/srv/AddTwoInts"
FIBONACCI = "example_interfaces/action/Fibonacci_SendGoal"


def test_endpoints_are_sorted_by_what_they_offer() -> None:
    talkers = [
        Endpoint(bytes([n]), EndpointKind.PUBLISHER, "/chatter", "std_msgs/msg/String") for n in (1, 2)
    ]
    adder = Endpoint(b"3", EndpointKind.SERVER, "/add", ADD)
    action = Endpoint(b"4", EndpointKind.SERVER, "/fibonacci/_action/send_goal", FIBONACCI)
    others = [
        Endpoint(b"5", EndpointKind.SUBSCRIBER, "/chatter", "std_msgs/msg/String"),
        Endpoint(b"6", EndpointKind.CLIENT, "/add", ADD),
    ]

    graph = Ros2Graph([*talkers, adder, action, *others])

    assert (graph.publishers, graph.services) == ({"/chatter": talkers}, {"/add": [adder]})
    assert graph.actions == {"/fibonacci": [action]}


def test_servers_that_cannot_be_called_are_passed_over() -> None:
    unknown = Endpoint(b"1", EndpointKind.SERVER, "/add", ADD, problem="unknown form")
    known = Endpoint(b"2", EndpointKind.SERVER, "/add", ADD)

    assert callable_server([unknown, known]) is known
    with pytest.raises(PiprosError, match="unknown form"):
        callable_server([unknown])
