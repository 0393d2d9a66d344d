"""Views and actions of a page with sliders."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, Final

from pipros_server.view_server import RequestRefused, ServedViews

PERIOD_S: Final = 0.1
"""Interval (s) at which the server checks whether values or ranges have changed."""


@dataclass(frozen=True, slots=True)
class Slider:
    """A named value with its range.

    Attributes:
        unit: shown after the number, for example `rad` or `m/s`.
    """

    name: str
    lowest: float
    highest: float
    value: float
    unit: str = ""


@dataclass(frozen=True, slots=True)
class SliderPage:
    """Content and callbacks of the page. The callbacks are called in the server's thread, and must not block.

    Attributes:
        title: the heading.
        node: the name of the node.
        sliders: returns the sliders with their current values.
        move: sets a slider's value. Called with the slider's name and a value within its range.
        buttons: callbacks by label.
        on_left: called after a browser has left the page.
        on_held: if given, the page repeats a value that its user has set, ten times a second, and this is
            called as long as it is still the slider's value. Repeated values move no slider, because a
            browser that was suspended may send old ones.
    """

    title: str
    node: str
    sliders: Callable[[], Sequence[Slider]]
    move: Callable[[str, float], object]
    buttons: Mapping[str, Callable[[], object]]
    on_left: Callable[[], object] = lambda: None
    on_held: Callable[[], object] | None = None

    def served_views(self) -> ServedViews:
        """Return the views and actions for a server."""
        return ServedViews(
            views={"sliders": self._show},
            actions={"move": self._move, "hold": self._hold, "press": self._press},
            pages=("pipros_server.sliders", "pipros_server"),
        )

    async def _show(self, _: Mapping[str, object]) -> AsyncIterator[Any]:
        """Yield the content of the page, with all sliders, whenever a value or a range changes."""
        sent: Any = None
        try:
            while True:
                now = [
                    [slider.name, slider.lowest, slider.highest, slider.value, slider.unit]
                    for slider in self.sliders()
                ]
                if now != sent:
                    yield {
                        "title": self.title,
                        "node": self.node,
                        "buttons": list(self.buttons),
                        "sliders": now,
                        "holds": self.on_held is not None,
                    }
                sent = now
                await asyncio.sleep(PERIOD_S)
        finally:
            self.on_left()

    async def _move(self, arguments: Mapping[str, object]) -> None:
        name, value = arguments.get("slider"), arguments.get("value")
        found = next((slider for slider in self.sliders() if slider.name == name), None)
        if found is None:
            raise RequestRefused(f"slider {name!r} does not exist")
        if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
            raise RequestRefused(f"the value of a slider must be a finite number, got {value!r}")
        self.move(found.name, min(max(float(value), found.lowest), found.highest))

    async def _hold(self, arguments: Mapping[str, object]) -> None:
        held = (arguments.get("slider"), arguments.get("value"))
        if self.on_held is not None and held in [(each.name, each.value) for each in self.sliders()]:
            self.on_held()

    async def _press(self, arguments: Mapping[str, object]) -> None:
        function = self.buttons.get(str(arguments.get("button")))
        if function is None:
            raise RequestRefused(f"there is no button {arguments.get('button')!r}")
        function()
