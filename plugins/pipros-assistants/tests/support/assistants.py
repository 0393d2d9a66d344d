"""Clients of `pipros mcp`: the official library, over each transport or in the process of the test."""

from __future__ import annotations

import asyncio
import contextlib
import json
import threading
from collections.abc import Awaitable, Callable
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mcp import Client

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros_assistants.commands.mcp import ASSISTANT_ACT_CHARACTERS, ASSISTANT_APPROVALS, ASSISTANT_RUNS
from pipros_assistants.robot import RobotAccess
from pipros_assistants.server import make_server
from pipros_server.approvals import Approvals
from pipros_server.approved_acts import ActLimits, ApprovedActs
from pipros_server.policy.policy_file import parse_policy

LIMIT_S = 60.0


@dataclass(frozen=True)
class Reply:
    """An answer: its text, the object in it, its pictures, and whether it is an error."""

    text: str
    fields: dict[str, Any]
    pictures: list[Any]
    is_error: bool

    @property
    def data(self) -> Any:
        return self.fields["data"]


async def call(client: Client, tool: str, **arguments: Any) -> Reply:
    """Call a tool. Its answer must be one JSON object in one line, and pictures."""
    result: Any = await client.call_tool(tool, arguments)
    first, *pictures = result.content
    assert "\n" not in first.text
    return Reply(first.text, json.loads(first.text), pictures, bool(result.is_error))


def run(opened: AbstractAsyncContextManager[Client], body: Callable[[Client], Awaitable[Any]]) -> Any:
    """Connect a client, and run a coroutine with it."""

    async def main() -> Any:
        async with opened as client:
            return await asyncio.wait_for(body(client), LIMIT_S)

    return asyncio.run(main())


class Human:
    """A human who gives the same answer to all acts that wait. Use it as a context manager.

    Attributes:
        seen: the acts.
    """

    def __init__(self, approvals: Approvals, verdict: str = "once") -> None:
        self.seen: list[dict[str, Any]] = []
        self._approvals = approvals
        self._verdict = verdict
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._answer, daemon=True)

    def __enter__(self) -> Human:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()

    def _answer(self) -> None:
        while not self._over.wait(0.01):
            for act in self._approvals.answer({"do": "list"})["waiting"]:
                with contextlib.suppress(PiprosError):  # the act has ended in between
                    answer = {"do": "answer", "id": act["id"], "verdict": self._verdict}
                    self._approvals.answer(answer)
                    self.seen.append(act)


class LocalAssistant:
    """An assistant whose server runs in the process of the test.

    Attributes:
        acts: the acts that its policy allows, if it has one.
    """

    def __init__(
        self,
        master_uri: str,
        bags: Path | None = None,
        policy: Path | None = None,
        wait: Callable[[], object] = lambda: None,
        **limits: Any,
    ) -> None:
        """Create the server. `limits` replace those of the room."""
        robot = RobotAccess(Environment.from_os()._replace(master_uri=master_uri), wait=wait)
        if limits:
            robot = RobotAccess(robot.environment, robot.limits._replace(**limits))
        self.acts: ApprovedActs | None = None
        if policy is not None:
            found = parse_policy(policy.read_text(encoding="utf-8"), str(policy))
            approval_s = robot.limits.assistant_approval_s
            limits_of_acts = ActLimits(
                ASSISTANT_APPROVALS, approval_s, ASSISTANT_ACT_CHARACTERS, ASSISTANT_RUNS
            )
            self.acts = ApprovedActs(robot.environment, found, limits_of_acts)
        self.server = make_server(robot, bags, self.acts)

    @property
    def approvals(self) -> Approvals:
        assert self.acts is not None
        return self.acts.approvals

    def close(self) -> None:
        if self.acts is not None:
            self.acts.close()

    def call(self, tool: str, **arguments: Any) -> Reply:
        reply: Reply = run(Client(self.server), lambda client: call(client, tool, **arguments))
        return reply

    def reply(self, tool: str, arguments: dict[str, Any]) -> tuple[str, bool]:
        """Return the text of an answer, and whether it is an error, even if it is that of the library."""

        async def asked(client: Client) -> tuple[str, bool]:
            result: Any = await client.call_tool(tool, arguments)
            return result.content[0].text, bool(result.is_error)

        found: tuple[str, bool] = run(Client(self.server), asked)
        return found

    def tools(self) -> list[Any]:
        async def listed(client: Client) -> list[Any]:
            return list((await client.list_tools()).tools)

        found: list[Any] = run(Client(self.server), listed)
        return found
