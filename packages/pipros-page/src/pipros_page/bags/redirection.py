"""Views that show a bag in browsers that have opened one, and the running system in all other browsers."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import AsyncIterator, Callable, Mapping
from typing import Any

from pipros_page.bags.open_bags import OpenBags
from pipros_page.watched_system import WatchedSystem
from pipros_server.view_server import Action, ServedViews, View


class BagRedirection:
    """Redirects views and actions to the bag that the calling browser has opened, if any."""

    def __init__(
        self,
        open_bags: OpenBags,
        live: ServedViews,
        of_bag: Callable[[WatchedSystem], ServedViews],
        names: frozenset[str],
    ) -> None:
        """Redirect the views and actions in `names`.

        Args:
            live: the views and actions for the running system.
            of_bag: creates the views and actions for a bag.
        """
        self._open_bags = open_bags
        self._live = live
        self._of_bag = of_bag
        self._names = names

    def views(self) -> Mapping[str, View]:
        """Return all views. Views in `names` show the bag that the calling browser has opened, if any."""
        live = self._live.views
        return {**live, **{name: self._view(name, live[name]) for name in self._names & live.keys()}}

    def actions(self) -> Mapping[str, Action]:
        """Return all actions. Actions in `names` read the bag that the calling browser has opened, if any."""
        live = self._live.actions
        return {**live, **{name: self._action(name, live[name]) for name in self._names & live.keys()}}

    def _view(self, name: str, live: View) -> View:
        async def view(arguments: Mapping[str, object]) -> AsyncIterator[object]:
            shown = self._open_bags.served_views(self._of_bag)
            chosen = live if shown is None else shown.views[name]
            async with contextlib.aclosing(chosen(arguments)) as values:  # type: ignore[type-var]
                async for value in values:
                    yield value

        return view

    def _action(self, name: str, live: Action) -> Action:
        @functools.wraps(live)
        async def act(arguments: Mapping[str, object]) -> Any:
            shown = self._open_bags.served_views(self._of_bag)
            return await (live if shown is None else shown.actions[name])(arguments)

        return act
