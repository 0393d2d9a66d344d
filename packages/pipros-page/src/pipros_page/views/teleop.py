"""Steer a robot from the page.

The browser sends the desired velocity ten times a second. A task in the server publishes it, and stops the
robot if the connection to the browser hangs: see `pipros.web.steering`.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import time
from collections.abc import AsyncIterator, Iterator, Mapping
from typing import Any

from pipros.msg import load_message_class
from pipros.node.publisher import Publisher
from pipros.server.act_gate import GatedPublisher
from pipros.server.view_server import RequestRefused
from pipros.web.steering import Velocity, VelocityCommands
from pipros.web.views.calls import withdraw
from pipros.web.views.topics import topic_name
from pipros.web.watched_system import WatchedSystem

PERIOD_S = 0.1
REPORT_INTERVAL_S = 0.25
LONGEST_SESSION = 64
"""Maximum length of a session name, in characters."""


class TeleopViews:
    """The view and the action of the Teleop tab. The action addresses an open view by its session name."""

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system
        self._sessions: dict[str, VelocityCommands] = {}

    async def teleop(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Publish `geometry_msgs/Twist` while the view is open. Yield the number of connected subscribers."""
        topic = topic_name(arguments)
        limit = Velocity(_number(arguments, "linear"), _number(arguments, "angular"))
        system, twist = self._system, load_message_class("geometry_msgs/Twist")
        with self._session(arguments, VelocityCommands(limit)) as commands:
            advertising = system.questions.start(system.gate.advertise, topic, twist, queue_size=1)
            try:
                publisher = await asyncio.wrap_future(advertising)
                driving = asyncio.create_task(_drive(publisher, twist, commands))
                try:
                    while not driving.done():
                        yield {"listeners": publisher.connection_count}
                        await asyncio.sleep(REPORT_INTERVAL_S)
                    driving.result()
                finally:
                    driving.cancel()
                    _publish(publisher, twist, commands.end())
            finally:
                advertising.add_done_callback(lambda done: withdraw(system, done))

    async def steer(self, arguments: Mapping[str, object]) -> Any:
        """Set the desired velocity of a session."""
        commands = self._sessions.get(str(arguments.get("session")))
        if commands is None:
            raise RequestRefused("this steering session has ended")
        commands.steer(
            Velocity(_number(arguments, "linear"), _number(arguments, "angular")), time.monotonic()
        )
        return {}

    @contextlib.contextmanager
    def _session(
        self, arguments: Mapping[str, object], commands: VelocityCommands
    ) -> Iterator[VelocityCommands]:
        name = arguments.get("session")
        if not isinstance(name, str) or not name or len(name) > LONGEST_SESSION or name in self._sessions:
            raise RequestRefused(f"session must be a new name of at most {LONGEST_SESSION} characters")
        self._sessions[name] = commands
        try:
            yield commands
        finally:
            del self._sessions[name]


async def _drive(
    publisher: Publisher[Any] | GatedPublisher, twist: object, commands: VelocityCommands
) -> None:
    while True:
        _publish(publisher, twist, commands.due(time.monotonic()))
        await asyncio.sleep(PERIOD_S)


def _publish(publisher: Publisher[Any] | GatedPublisher, twist: Any, velocity: Velocity | None) -> None:
    if velocity is None:
        return
    message = twist()
    message.linear.x, message.angular.z = velocity.linear, velocity.angular
    publisher.publish(message)


def _number(arguments: Mapping[str, object], key: str) -> float:
    value = arguments.get(key)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise RequestRefused(f"{key} must be a finite number, got {value!r}")
    return float(value)
