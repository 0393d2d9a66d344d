"""The windows of a process: their images, trackbars and mouse callbacks, and the page that shows them."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator, Callable, Mapping
from dataclasses import dataclass, field
from queue import SimpleQueue
from typing import Any, Final

from pipros_server.view_server import RequestRefused, ServedViews

PERIOD_S: Final = 0.03
"""Interval (s) at which the server checks for new images."""
MAX_EVENTS: Final = 200
"""Maximum number of key, mouse and trackbar events that wait for `waitKey`; later events are dropped."""
MOUSE_EVENTS: Final = range(12)

Event = int | Callable[[], object]
"""The code of a key, or a call of a callback."""


@dataclass(slots=True)
class Trackbar:
    """A slider of a window. `on_change` is called with its value."""

    value: int
    highest: int
    on_change: Callable[[int], object] | None
    lowest: int = 0


@dataclass(slots=True)
class Window:
    """A window.

    Attributes:
        image: the 8-bit array from the last `imshow`, or None.
        number: incremented with each image.
        on_mouse: called with the event, x, y and flags.
    """

    title: str
    image: Any = None
    number: int = 0
    trackbars: dict[str, Trackbar] = field(default_factory=dict)
    on_mouse: Callable[[int, int, int, int], object] | None = None


class Windows:
    """The windows of this process, by name. Safe to use from any thread.

    Args:
        node: the name of the node, which the page shows.
        encode: returns an image as the content of a JPEG or PNG file. Called in a worker thread.
    """

    def __init__(self, node: str, encode: Callable[[Any], bytes]) -> None:
        self.lock = threading.RLock()
        self.by_name: dict[str, Window] = {}
        self.events: SimpleQueue[Event] = SimpleQueue()
        self._node = node
        self._encode = encode

    def served_views(self) -> ServedViews:
        """Return the views and actions for a server."""
        return ServedViews(
            views={"windows": self._show, "image": self._show_image},
            actions={"key": self._key, "mouse": self._mouse, "move": self._move, "close": self._close},
            pages=("pipros_robot.perception.windows", "pipros_server.sliders", "pipros_server"),
        )

    def _state(self) -> dict[str, Any]:
        with self.lock:
            windows = [
                {
                    "name": name,
                    "title": window.title,
                    "hasMouse": window.on_mouse is not None,
                    "trackbars": [
                        [label, bar.lowest, bar.highest, bar.value] for label, bar in window.trackbars.items()
                    ],
                }
                for name, window in self.by_name.items()
            ]
        return {"node": self._node, "windows": windows}

    async def _show(self, _: Mapping[str, Any]) -> AsyncIterator[Any]:
        """Yield the state of all windows, without their images, whenever it changes."""
        sent: Any = None
        while True:
            state = self._state()
            if state != sent:
                yield state
            sent = state
            await asyncio.sleep(PERIOD_S)

    async def _show_image(self, arguments: Mapping[str, Any]) -> AsyncIterator[bytes]:
        """Yield the image of a window whenever it changes."""
        name = str(arguments.get("window"))
        sent: tuple[Window | None, int] = (None, 0)
        while True:
            with self.lock:
                window = self.by_name.get(name)
                now = (window, window.number if window else 0)
                image = window.image if window else None
            if now != sent and image is not None:
                yield await asyncio.to_thread(self._encode, image)
            sent = now
            await asyncio.sleep(PERIOD_S)

    def _window(self, arguments: Mapping[str, Any]) -> Window:
        window = self.by_name.get(str(arguments.get("window")))
        if window is None:
            raise RequestRefused(f"there is no window {arguments.get('window')!r}")
        return window

    def _put(self, event: Event) -> None:
        if self.events.qsize() < MAX_EVENTS:
            self.events.put(event)

    async def _key(self, arguments: Mapping[str, Any]) -> None:
        code = _whole_number(arguments, "code", 0, 0x1FFFFF)
        self._put(code)

    async def _mouse(self, arguments: Mapping[str, Any]) -> None:
        with self.lock:
            call = self._window(arguments).on_mouse
        event = _whole_number(arguments, "event", MOUSE_EVENTS.start, MOUSE_EVENTS.stop - 1)
        x, y = (_whole_number(arguments, axis, -(1 << 20), 1 << 20) for axis in "xy")
        flags = _whole_number(arguments, "flags", -(1 << 31), (1 << 31) - 1)
        if call is not None:
            self._put(lambda: call(event, x, y, flags))

    async def _move(self, arguments: Mapping[str, Any]) -> None:
        with self.lock:
            bar = self._window(arguments).trackbars.get(str(arguments.get("trackbar")))
            if bar is None:
                raise RequestRefused(f"there is no trackbar {arguments.get('trackbar')!r}")
            value = _whole_number(arguments, "value", bar.lowest, bar.highest)
            is_news, bar.value = value != bar.value, value
        call = bar.on_change
        if is_news and call is not None:
            self._put(lambda: call(value))

    async def _close(self, arguments: Mapping[str, Any]) -> None:
        with self.lock:
            self._window(arguments)
            del self.by_name[str(arguments["window"])]


def _whole_number(arguments: Mapping[str, Any], name: str, lowest: int, highest: int) -> int:
    value = arguments.get(name)
    if not isinstance(value, int) or isinstance(value, bool) or not lowest <= value <= highest:
        raise RequestRefused(f"{name} must be a whole number from {lowest} to {highest}, got {value!r}")
    return value
