"""Parameters on the parameter server."""

from __future__ import annotations

import asyncio
import json
import re
from collections.abc import AsyncIterator, Mapping
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.safe.yaml import load
from pipros_page.bounded_list import PAGE_VIEW_BYTES
from pipros_page.views.topics import topic_name
from pipros_page.watched_system import WatchedSystem
from pipros_server.view_server import RequestRefused
from pipros_tools.graph import params
from pipros_tools.graph.message_tree import message_tree

POLL_INTERVAL_S = 2.0
MAX_PARAMETERS = 20_000
_NUMBER = re.compile(r'\{"#": "(-?)(nan|inf)?(\d*)"\}')
_SHORTENED = re.compile(r'\{"…": (\d+), "items": \[(.*)\]\}')


class ParamViews:
    """The views of the Parameters tab."""

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system

    async def params(self, _: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the parameters, keyed by name, whenever one changes. Values are YAML, shortened if long."""
        shown: Any = None
        while True:
            try:
                values = await self._system.questions.run(self._read)
            except PiprosError as error:
                values = {"error": str(error)}
            if values != shown:
                shown = values
                yield values
            await asyncio.sleep(POLL_INTERVAL_S)

    def _read(self) -> Mapping[str, Any]:
        found = dict(params.leaves("/", params.read(self._system.graph.master, "/")))
        shown = {}
        left_bytes = PAGE_VIEW_BYTES
        for name in sorted(found)[:MAX_PARAMETERS]:
            # As strings, because JavaScript does not distinguish 0.0 (double) from 0 (int).
            shown[name] = _text(found[name])
            left_bytes -= len(name) + len(shown[name])
            if left_bytes < 0:
                break
        return {"params": shown, "more": len(found) - len(shown)}

    async def set_param(self, arguments: Mapping[str, object]) -> Any:
        """Set a parameter to a value in YAML."""
        name, text = topic_name(arguments), arguments.get("value")
        if not isinstance(text, str):
            raise RequestRefused(f"value must be a YAML string, got {type(text).__name__}")
        value = await self._system.computations.run(load, text, "value", angles=False) if text else ""
        self._system.gate.check_parameter(name, value)
        await self._system.questions.run(params.write, self._system.graph.master, name, value)
        return True

    async def delete_param(self, arguments: Mapping[str, object]) -> Any:
        """Delete a parameter or a namespace."""
        await self._system.questions.run(params.delete, self._system.graph.master, topic_name(arguments))
        return True


def _text(value: object) -> str:
    """Return a value in YAML, with the same type when it is read again; one with `…` is shortened."""
    text = json.dumps(message_tree(value, for_browser=True), ensure_ascii=False)
    text = _NUMBER.sub(lambda found: f"{found[1]}{'.' + found[2] if found[2] else found[3]}", text)
    return _SHORTENED.sub(r"[\2, …] (\1 elements)", text)
