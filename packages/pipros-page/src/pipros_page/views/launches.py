"""Show the nodes and output of this user's roslaunch processes on this machine; stop and restart nodes."""

from __future__ import annotations

import asyncio
import re
from collections.abc import AsyncIterator, Mapping
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.net.local_socket import HAS_LOCAL_SOCKETS
from pipros_page.bounded_list import bounded_list
from pipros_page.watched_system import WatchedSystem
from pipros_server.view_server import RequestRefused
from pipros_tools.graph import params
from pipros_tools.launch.control import LaunchUnavailable, ask, running_launches

POLL_INTERVAL_S: Final = 1.0
MAX_LAUNCHES: Final = 50
_COLOURS: Final = re.compile(r"\x1b\[[\d;]*[A-Za-z]")


class LaunchViews:
    """The views and actions of the Launches section in the Nodes tab."""

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system

    async def launches(self, _: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the nodes of the current run's launches, about once a second."""
        while True:
            yield await self._system.questions.run(self._found)
            await asyncio.sleep(POLL_INTERVAL_S)

    async def launch_output(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the last part of a node's output, now and after each change."""
        request = {"do": "output", "node": str(arguments["node"])}
        shown: Any = None
        while True:
            answer = await self._system.questions.run(self._ask, _launch(arguments), request)
            if answer != shown:
                shown = answer
                yield {"output": [[str(source), _plain(text)] for source, text in answer["output"]]}
            await asyncio.sleep(POLL_INTERVAL_S)

    async def restart_launched(self, arguments: Mapping[str, object]) -> Any:
        """Restart a launched node."""
        return await self._change("restart", arguments)

    async def stop_launched(self, arguments: Mapping[str, object]) -> Any:
        """Stop a launched node."""
        return await self._change("stop", arguments)

    async def _change(self, what: str, arguments: Mapping[str, object]) -> Any:
        request = {"do": what, "node": str(arguments["node"])}
        try:
            await self._system.questions.run(self._ask, _launch(arguments), request)
        except PiprosError as error:
            raise RequestRefused(str(error)) from None
        return True

    def _ask(self, launch: str, request: Mapping[str, object]) -> Mapping[str, Any]:
        return ask(launch, {**request, "run_id": self._run_id()})

    def _run_id(self) -> str:
        return str(params.read(self._system.graph.master, "/run_id")).strip()

    def _found(self) -> Mapping[str, Any]:
        if not HAS_LOCAL_SOCKETS:
            return {"nodes": [], "error": "Launches are shown on Linux only."}
        nodes: list[Mapping[str, Any]] = []
        try:
            run_id = self._run_id()
            launches = running_launches()
        except (PiprosError, OSError) as error:
            return {"nodes": [], "error": str(error)}
        for launch in launches[:MAX_LAUNCHES]:
            try:
                answer = ask(launch, {"do": "list"})
            except LaunchUnavailable:
                continue  # the launch is ending, or belongs to another user
            if answer.get("run_id") == run_id:
                files = ", ".join(map(str, answer["files"]))
                nodes += [{**node, "launch": launch, "files": files} for node in answer["nodes"]]
        return {"nodes": bounded_list(nodes), "error": ""}


def _launch(arguments: Mapping[str, object]) -> str:
    launch = str(arguments["launch"])
    if not re.fullmatch("[0-9]{1,10}", launch):
        raise RequestRefused(f"launch must be a process id, got {launch!r:.100}")
    return launch


def _plain(text: object) -> str:
    return _COLOURS.sub("", str(text))
