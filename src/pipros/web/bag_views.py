"""Views that show a bag in browsers that have opened one, and the running system in others."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import AsyncIterator, Mapping
from typing import Any, Final

from pipros.web.browser_share import bag_of_browser
from pipros.web.server import Action, View
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

    def views(self, live: Mapping[str, View]) -> Mapping[str, View]:
        """Return all views; those that show messages are redirected."""
        return {**live, **{name: self._view(name, live[name]) for name in _VIEWS}}

    def actions(self, live: Mapping[str, Action]) -> Mapping[str, Action]:
        """Return all actions; those that read messages are redirected."""
        return {**live, **{name: self._action(name, live[name]) for name in _ACTIONS}}

    def _view(self, name: str, live: View) -> View:
        async def view(arguments: Mapping[str, Any]) -> AsyncIterator[Any]:
            async with contextlib.aclosing(self._chosen(name, live)(arguments)) as values:
                async for value in values:
                    yield value

        return view

    def _action(self, name: str, live: Action) -> Action:
        @functools.wraps(live)
        async def act(arguments: Mapping[str, Any]) -> Any:
            return await self._chosen(name, live)(arguments)

        return act

    def _chosen(self, name: str, live: Any) -> Any:
        browser = bag_of_browser()
        if browser.playback is None:
            return live
        system = browser.playback.system
        if browser.views is None or browser.views[0] is not system:
            browser.views = system, _services_of(system)
        return browser.views[1][name]


def _services_of(system: WatchedSystem) -> Mapping[str, Any]:
    frames, topics, scene = FrameViews(system), TopicViews(system), SceneViews(system, None)
    return {
        "console": ConsoleViews(system).console,
        "definition": topics.definition,
        "diagnostics": DiagnosticViews(system).diagnostics,
        "frames": frames.frames,
        "image": ImageViews(system).image,
        "measured": topics.measured,
        "message_text": topics.message_text,
        "plot": PlotViews(system).plot,
        "scene_cloud": scene.cloud,
        "scene_messages": scene.messages,
        "topic": topics.topic,
        "topics": topics.topics,
        "transform": frames.transform,
    }
