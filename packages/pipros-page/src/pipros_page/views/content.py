"""Find the tabs that have nothing to show, which the page moves into its menu."""

from __future__ import annotations

from collections.abc import AsyncIterator, Mapping
from typing import Final

from pipros_page.watched_system import WatchedSystem
from pipros_tools.graph.observer import GraphObservation

_PUBLISHED: Final[Mapping[str, frozenset[str]]] = {
    "actions": frozenset({"actionlib_msgs/GoalStatusArray"}),
    "diagnostics": frozenset({"diagnostic_msgs/DiagnosticArray"}),
    "images": frozenset({"sensor_msgs/Image", "sensor_msgs/CompressedImage"}),
    "tf": frozenset({"tf2_msgs/TFMessage", "tf/tfMessage"}),
}
"""Tabs with message types. A tab has data if a topic of one of its types is published."""
_NODES: Final = {"fleet": "/pipros_fleet_", "ros2": "/ros2_gateway_"}
"""Tabs with name prefixes. A tab has data if a node's name begins with its prefix."""


class ContentViews:
    """The view that lists the tabs without data."""

    def __init__(self, system: WatchedSystem, *, has_bags: bool) -> None:
        self._system = system
        self._has_bags = has_bags

    async def content(self, _: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the tabs without data, now and after each change."""
        shown = None
        async for observation in self._system.observations():
            found = empty_tabs(observation)
            if not self._has_bags:
                found = [*found, "bags"]
            if not observation.error and found != shown:
                shown = found
                yield {"empty": found}


def empty_tabs(observation: GraphObservation) -> list[str]:
    """Return the tabs for which the running system has no data."""
    state = observation.state
    published = {observation.types.get(topic, "") for topic, nodes in state.publishers.items() if nodes}
    nodes = state.nodes()
    can_steer = any(observation.types.get(topic) == "geometry_msgs/Twist" for topic in state.topics())
    return [
        *(tab for tab, wanted in _PUBLISHED.items() if not wanted & published),
        *([] if can_steer else ["teleop"]),
        *(tab for tab, prefix in _NODES.items() if not any(node.startswith(prefix) for node in nodes)),
    ]
