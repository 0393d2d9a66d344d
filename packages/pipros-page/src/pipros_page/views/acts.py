"""Show the acts that await approval, and past acts, of this user's programs; send the user's answers."""

from __future__ import annotations

import asyncio
import re
from collections.abc import AsyncIterator, Mapping
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.net.local_socket import HAS_LOCAL_SOCKETS
from pipros_page.bounded_list import bounded_list
from pipros_page.watched_system import WatchedSystem
from pipros_server.approvals import VERDICTS, answer_act, waiting_acts
from pipros_server.view_server import RequestRefused

POLL_INTERVAL_S: Final = 0.5


class ActViews:
    """The view and the action of the Acts tab."""

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system

    async def acts(self, _: Mapping[str, object]) -> AsyncIterator[object]:
        """Periodically yield the acts that await approval, most urgent first, and past acts, newest first."""
        while True:
            yield await self._system.questions.run(self._found)
            await asyncio.sleep(POLL_INTERVAL_S)

    async def approve(self, arguments: Mapping[str, object]) -> Any:
        """Send the user's answer: approve an act once or for a minute, or refuse it."""
        process, identity = str(arguments["process"]), str(arguments["id"])
        verdict = arguments.get("verdict")
        if not re.fullmatch("[0-9]{1,10}", process) or verdict not in VERDICTS:
            raise RequestRefused(f"process must be a process id, and verdict one of {', '.join(VERDICTS)}")
        try:
            await self._system.questions.run(answer_act, process, identity, verdict)
        except PiprosError as error:
            raise RequestRefused(str(error)) from None
        return True

    def _found(self) -> Mapping[str, Any]:
        if not HAS_LOCAL_SOCKETS:
            return {"waiting": [], "acts": [], "error": "Acts can be approved on Linux only."}
        try:
            programs = waiting_acts()
        except (PiprosError, OSError) as error:
            return {"waiting": [], "acts": [], "error": str(error)}
        uri = self._system.graph.environment.master_uri
        waiting = [
            {
                **act,
                "process": program["process"],
                "master": program["master"],
                "here": program["master"] == uri,
            }
            for program in programs
            for act in program["waiting"]
        ]
        acts = [{**act, "process": program["process"]} for program in programs for act in program["acts"]]
        acts.sort(key=lambda act: -float(act["time"]))
        waiting.sort(key=lambda act: float(act["left_s"]))
        silent = "; ".join(program["silent"] for program in programs if "silent" in program)
        return {"waiting": bounded_list(waiting), "acts": bounded_list(acts), "error": silent}
