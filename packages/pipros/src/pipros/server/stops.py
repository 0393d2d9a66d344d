"""Pending stops of a robot, and the services that stop it."""

from __future__ import annotations

import contextlib
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.basics.limits import process_limits
from pipros.node import Node

REPETITIONS: Final = 5
"""Number of times that a stop is published, `REPEAT_S` apart, unless another act follows."""
REPEAT_S: Final = 0.1
ENDING_S: Final = 2.0
"""Maximum time (s) to wait, after the last stop, for each service call, and then for the node's shutdown."""
CALL_S: Final = 5.0
"""Timeout (s) of a service call that stops a movement."""
EARLY_S: Final = 2.0
"""Maximum time (s) by which a goal's result may arrive before the line that says that the goal was sent."""
HALT: Final = "halt "
"""Prefix of the topics that are published when no goal is left. Other stops may be pending for them, too."""


@dataclass(slots=True)
class Stop:
    """A pending stop: when it is next due, and how many publications are left."""

    due_s: float
    message: Any
    left: int = REPETITIONS


class Stops:
    """Pending stops, by topic or service and, for goals, by id. Not thread-safe; performs no I/O.

    `publish` publishes a message on a topic, or calls a service with it.
    """

    def __init__(self, publish: Callable[[str, Any], object]) -> None:
        self._publish = publish
        self._stops: dict[tuple[str, str], Stop] = {}
        self._early: deque[tuple[str, str, int, float]] = deque(maxlen=process_limits().policy_stops)

    def arm(self, key: str, identity: str, message: object, due_s: float, halts: str = "") -> None:
        """Schedule a stop. It replaces a pending stop for the same topic or service.

        A pending stop for the same goal id is not replaced: action servers ignore a goal that they already
        have, so a client that sends the goal again must not postpone its cancellation. `halts` is the topic
        that is published when no goal is left, by default the key; its repetitions end, because an act has
        begun.
        """
        self._stops.pop((HALT + (halts or key), ""), None)
        if identity and (key, identity) in self._stops:
            return
        self._stops[key, identity] = Stop(due_s, message)

    def halt(self, topic: str, message: object, now_s: float, left: int) -> None:
        """Publish a message `left` times from now on, because no goal is left."""
        self._stops[HALT + topic, ""] = Stop(now_s, message, left)

    def disarm(self, key: str, identity: str) -> None:
        """Cancel a pending stop."""
        self._stops.pop((key, identity), None)

    def stop(self, key: str, identity: str, now_s: float) -> None:
        """Make a pending stop due now."""
        found = self._stops.get((key, identity))
        if found is not None:
            found.due_s = min(found.due_s, now_s)

    def end(self, key: str, identity: str, status: int, now_s: float) -> bool:
        """Cancel the stop of a goal that has ended. Return whether it was pending.

        Otherwise, the goal may still be armed: an action server that refuses a goal at once may be faster
        than the server's line. `early_status` then returns `status`.
        """
        is_pending = self._stops.pop((key, identity), None) is not None
        if not is_pending and len(identity) <= process_limits().policy_goal_id_characters:
            self._early.append((key, identity, status, now_s))
        return is_pending

    def early_status(self, key: str, identity: str, now_s: float) -> int | None:
        """Return the status of a goal that ended before it was armed, once; otherwise None."""
        for each in self._early:
            if each[:2] == (key, identity) and now_s - each[3] <= EARLY_S:
                self._early.remove(each)
                return each[2]
        return None

    def has(self, key: str) -> bool:
        """Return whether a stop is pending for a topic or service."""
        return any(each == key for each, _ in self._stops)

    def stop_all(self, now_s: float) -> None:
        """Make all pending stops due now."""
        for key, identity in self._stops:
            self.stop(key, identity, now_s)

    def run(self, now_s: float) -> float | None:
        """Publish the stops that are due. Return the time of the next stop, or None if no stop is pending."""
        for (key, identity), each in list(self._stops.items()):
            if each.due_s > now_s:
                continue
            self._publish(key, each.message)
            each.left -= 1
            each.due_s = now_s + REPEAT_S
            if not each.left:
                del self._stops[key, identity]
        return min((each.due_s for each in self._stops.values()), default=None)


class ServiceStop:
    """Stops a movement by calling a service, with at most one call at a time. Used like a publisher."""

    def __init__(self, node: Node, service: str, service_class: Any) -> None:
        self._client = node.client(service, service_class)
        self._is_calling = threading.Lock()

    def publish(self, request: object) -> None:
        """Start the call, unless one is running. Does not block."""
        if self._is_calling.acquire(blocking=False):
            threading.Thread(target=self._call, args=(request,), daemon=True).start()

    def _call(self, request: Any) -> None:
        try:
            with contextlib.suppress(PiprosError):  # called again, up to `REPETITIONS` times
                self._client.call(request, CALL_S)
        finally:
            self._is_calling.release()

    def finish(self) -> None:
        """Wait up to `ENDING_S` for a running call to end."""
        self._is_calling.acquire(timeout=ENDING_S)
