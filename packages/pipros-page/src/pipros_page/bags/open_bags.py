"""The bags that browsers have opened: at most one per browser."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from pipros_page.bags.playback import BagPlayback
from pipros_page.watched_system import WatchedSystem
from pipros_server.browser_share import Browser, current_browser
from pipros_server.view_server import RequestRefused, ServedViews


@dataclass(slots=True)
class _OpenBag:
    """A browser's bag.

    Attributes:
        shown: the system for which views were last created, and these views.
    """

    playback: BagPlayback
    shown: tuple[WatchedSystem, ServedViews] | None = None


class OpenBags:
    """Maps browsers to their bags. All methods act on the browser that the current context serves."""

    def __init__(self) -> None:
        self._bags: dict[Browser, _OpenBag] = {}

    def __len__(self) -> int:
        return len(self._bags)

    @property
    def playback(self) -> BagPlayback | None:
        """The browser's playback, or None if the browser shows the running system."""
        bag = self._bags.get(current_browser())
        return None if bag is None else bag.playback

    @contextlib.contextmanager
    def showing(self, playback: BagPlayback) -> Iterator[None]:
        """Show a bag within the context, and close its playback at the end.

        Raises:
            RequestRefused: the browser has already opened a bag.
        """
        browser = current_browser()
        if browser in self._bags:
            playback.close()
            raise RequestRefused("this browser has already opened a bag")
        self._bags[browser] = _OpenBag(playback)
        try:
            yield
        finally:
            del self._bags[browser]
            playback.close()

    def served_views(self, make: Callable[[WatchedSystem], ServedViews]) -> ServedViews | None:
        """Return the views that show the browser's bag, or None if the browser has not opened a bag.

        `make` is called again after each jump.
        """
        bag = self._bags.get(current_browser())
        if bag is None:
            return None
        system = bag.playback.system
        if bag.shown is None or bag.shown[0] is not system:
            bag.shown = system, make(system)
        return bag.shown[1]
