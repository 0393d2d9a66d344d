"""The publishers, services and actions in a ROS 2 domain, by name."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence

from pipros.basics.errors import PiprosError
from pipros_ros2.interface import Endpoint, EndpointKind


class Ros2Graph:
    """A snapshot of the ROS 2 graph.

    Attributes:
        publishers: the publishers of each topic.
        services: the servers of each service.
        actions: the servers of the `send_goal` service of each action.
    """

    def __init__(self, endpoints: Iterable[Endpoint]) -> None:
        self.publishers: defaultdict[str, list[Endpoint]] = defaultdict(list)
        self.services: defaultdict[str, list[Endpoint]] = defaultdict(list)
        self.actions: defaultdict[str, list[Endpoint]] = defaultdict(list)
        for each in endpoints:
            if each.kind is EndpointKind.PUBLISHER:
                self.publishers[each.name].append(each)
            elif each.kind is EndpointKind.SERVER:
                action = each.name.removesuffix("/_action/send_goal")
                servers = self.services if action == each.name else self.actions
                servers[action].append(each)


def callable_server(servers: Sequence[Endpoint]) -> Endpoint:
    """Return the first server that can be called.

    Raises:
        PiprosError: no server can be called. The error text is the first server's problem.
    """
    found = next((each for each in servers if not each.problem), None)
    if found is None:
        raise PiprosError(servers[0].problem)
    return found
