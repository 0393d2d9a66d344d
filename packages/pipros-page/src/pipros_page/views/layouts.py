"""Layouts of panels that the server keeps for all browsers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pipros_page.layouts import StoredLayouts
from pipros_page.watched_system import WatchedSystem
from pipros_server.view_server import RequestRefused


class LayoutActions:
    """The actions of the toolbar in the Panels tab."""

    def __init__(self, system: WatchedSystem, *, may_save: bool) -> None:
        self._system = system
        self._may_save = may_save
        self._layouts = StoredLayouts()

    async def layouts(self, _: Mapping[str, object]) -> Any:
        """Return the names of all layouts, and whether browsers may store them."""
        names = await self._system.questions.run(self._layouts.names)
        return {"names": names, "may_save": self._may_save}

    async def layout(self, arguments: Mapping[str, object]) -> Any:
        """Return a layout's panels."""
        return {"panels": await self._system.questions.run(self._layouts.load, arguments.get("name"))}

    async def save_layout(self, arguments: Mapping[str, object]) -> Any:
        """Store a layout, and return the names of all layouts."""
        self._check()
        name, panels = arguments.get("name"), arguments.get("panels")
        await self._system.questions.run(self._layouts.save, name, panels)
        return await self.layouts(arguments)

    async def delete_layout(self, arguments: Mapping[str, object]) -> Any:
        """Delete a layout, and return the names of the remaining layouts."""
        self._check()
        await self._system.questions.run(self._layouts.delete, arguments.get("name"))
        return await self.layouts(arguments)

    def _check(self) -> None:
        if not self._may_save:
            raise RequestRefused(
                "this page may not store layouts: restart it without --read-only, or with --control"
            )
