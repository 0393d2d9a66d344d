"""Steer a robot from the page.

The browser sends the desired velocity ten times a second. A thread of the server publishes it, and stops the
robot if the connection to the browser hangs, whatever other browsers do: see `pipros_page.steering`.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import threading
import time
from collections.abc import AsyncIterator, Iterator, Mapping
from typing import Any

from pipros.basics import one_thread
from pipros.msg import load_message_class
from pipros_page.steering import Velocity, VelocityCommands
from pipros_page.views.calls import withdraw
from pipros_page.views.topics import topic_name
from pipros_page.watched_system import WatchedSystem
from pipros_server.act_gate import GatedPublisher
from pipros_server.view_server import RequestRefused

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
                driving = _Driving(publisher, twist, commands)
                try:
                    driving.start()
                    while driving.error is None:
                        yield {"listeners": publisher.connection_count}
                        await asyncio.sleep(REPORT_INTERVAL_S)
                    raise driving.error
                finally:
                    driving.end()
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


class _Driving:
    """Publishes a session's velocities, in a thread of its own: browsers can delay the event loop.

    Attributes:
        error: why no more is published; None while it is.
    """

    def __init__(self, publisher: GatedPublisher, twist: Any, commands: VelocityCommands) -> None:
        self._publisher = publisher
        self._twist = twist
        self._commands = commands
        self._lock = threading.Lock()
        self._has_ended = threading.Event()
        self.error: Exception | None = None

    def start(self) -> None:
        one_thread.start_work(self._run, self._turn, name="teleop")

    def end(self) -> None:
        """Stop the robot. Nothing is published afterwards."""
        self._has_ended.set()
        with self._lock:
            self._publish(self._commands.end())

    def _run(self) -> None:
        while (pause_s := self._turn()) is not None:
            self._has_ended.wait(pause_s)

    def _turn(self) -> float | None:
        """Publish what is due. Return the time until the next turn; None if there is none."""
        with self._lock:
            if self._has_ended.is_set():
                return None
            try:
                self._publish(self._commands.due(time.monotonic()))
            except Exception as error:
                self.error = error
                return None
        return PERIOD_S

    def _publish(self, velocity: Velocity | None) -> None:
        if velocity is None:
            return
        message = self._twist()
        message.linear.x, message.angular.z = velocity.linear, velocity.angular
        self._publisher.publish(message)


def _number(arguments: Mapping[str, object], key: str) -> float:
    value = arguments.get(key)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise RequestRefused(f"{key} must be a finite number, got {value!r}")
    return float(value)
