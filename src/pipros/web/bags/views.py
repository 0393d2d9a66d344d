"""Views that show a bag in browsers that have opened one, and the running system in others."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import AsyncIterator, Mapping
from typing import Any, Final

from pipros.server.view_server import Action, Services, View
from pipros.web.bags.open_bags import OpenBags
from pipros.web.views.console import ConsoleViews
from pipros.web.views.diagnostics import DiagnosticViews
from pipros.web.views.frames import FrameViews
from pipros.web.views.images import ImageViews
from pipros.web.views.plot import PlotViews
from pipros.web.views.scene import SceneViews
from pipros.web.views.topics import TopicViews
from pipros.web.watched_system import WatchedSystem

_VIEWS: Final = (
    "console",
    "diagnostics",
    "frames",
    "image",
    "log_marks",
    "measured",
    "plot",
    "scene_cloud",
    "scene_messages",
    "topic",
    "topics",
    "transform",
)
_ACTIONS: Final = ("definition", "message_text")


class ShownBags:
    """Redirects views and actions to the bag that the calling browser has opened, if any."""

    def __init__(self, open_bags: OpenBags) -> None:
        self._open_bags = open_bags

    def views(self, live: Mapping[str, View]) -> Mapping[str, View]:
        """Return all views. Those that show messages are replaced by views of the bag."""
        return {**live, **{name: self._view(name, live[name]) for name in _VIEWS}}

    def actions(self, live: Mapping[str, Action]) -> Mapping[str, Action]:
        """Return all actions. Those that read messages are replaced by actions that read the bag."""
        return {**live, **{name: self._action(name, live[name]) for name in _ACTIONS}}

    def _view(self, name: str, live: View) -> View:
        async def view(arguments: Mapping[str, Any]) -> AsyncIterator[Any]:
            services = self._open_bags.services(_services_of)
            chosen = live if services is None else services.views[name]
            async with contextlib.aclosing(chosen(arguments)) as values:  # type: ignore[type-var]
                async for value in values:
                    yield value

        return view

    def _action(self, name: str, live: Action) -> Action:
        @functools.wraps(live)
        async def act(arguments: Mapping[str, Any]) -> Any:
            services = self._open_bags.services(_services_of)
            return await (live if services is None else services.actions[name])(arguments)

        return act


def _services_of(system: WatchedSystem) -> Services:
    frames, topics, scene = FrameViews(system), TopicViews(system), SceneViews(system, None)
    plot = PlotViews(system)
    views: Mapping[str, View] = {
        "console": ConsoleViews(system).console,
        "diagnostics": DiagnosticViews(system).diagnostics,
        "frames": frames.frames,
        "image": ImageViews(system).image,
        "log_marks": plot.log_marks,
        "measured": topics.measured,
        "plot": plot.plot,
        "scene_cloud": scene.cloud,
        "scene_messages": scene.messages,
        "topic": topics.topic,
        "topics": topics.topics,
        "transform": frames.transform,
    }
    return Services(views, {"definition": topics.definition, "message_text": topics.message_text})
