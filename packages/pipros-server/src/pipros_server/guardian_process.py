"""Process that stops robots if their clients' server cannot, because it was killed, hangs or is cut off.

The server writes lines of JSON to the standard input: the messages that stop topics and services, and the
acts that start time limits. This process measures the time, on the monotonic clock. It publishes a stop when
its time limit has passed, and all pending stops when the input ends, for whatever reason. A stop is repeated,
because an earlier command from the server may arrive late over another connection.

It writes an empty line every `BEAT_S`, in the thread that publishes the stops, so that the server knows that
it can publish them. A line that does not fit into the pipe is left out, because the server may be suspended.

Each line has one of these values of `op`: `watch` adds a topic or a service with its stop, and is confirmed
by a line with its key (for a topic, once its known subscribers have connected or `CONNECTING_S` has passed);
`over`, which this process also writes, reports a goal that has ended;
`arm` starts or restarts a time limit; `disarm` cancels a time limit; `stop` makes a stop due at once.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import queue
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node

POLICY_STOPS = 1_000
"""Limit: topics, services and goals that a server has yet to stop when their time is up. Beyond it, the
oldest pending stop is carried out at once.
"""
POLICY_GOAL_ID_CHARACTERS = 200
"""Limit: the id of a goal with a time limit. Beyond it, the goal is refused, because it could not be
cancelled when its time is up.
"""

CONNECTING_S: Final = 2.0
"""Maximum time (s) to wait for subscribers before an act is allowed, even if some have not connected."""
BEAT_S: Final = 0.2
"""Interval (s) of the empty lines."""
CALL: Final = "call "
"""Prefix of service names in keys. Names of topics do not contain blanks."""
_REPLACED: Final = (2, 8)
"""The statuses PREEMPTED and RECALLED of goals that were cancelled, or replaced by a goal of anybody."""


class GuardianProcess:
    """Carries out the requests of the server, and publishes stops through its own node."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._publishers: dict[str, Any] = {}
        self._rules: dict[str, tuple[Any, float]] = {}
        self._output = sys.stdout.fileno()
        self._lines: queue.SimpleQueue[Mapping[str, Any] | None] = queue.SimpleQueue()
        self._halts: dict[str, tuple[str, Any]] = {}
        self._stops = Stops(self._publish)

    def _publish(self, key: str, message: object) -> None:
        self._publishers[key.removeprefix(HALT)].publish(message)
        if key in self._halts:  # the action server may not react to the cancellation
            topic, halt = self._halts[key]
            self._publishers[topic].publish(halt)

    def end(self) -> None:
        """Publish all pending stops, then end. May be called in a signal handler."""
        self._lines.put(None)

    def read(self) -> None:
        """Read the input until it ends."""
        with contextlib.suppress(OSError, ValueError):
            for line in sys.stdin:
                self._lines.put(json.loads(line))
        self._lines.put(None)

    def run(self) -> None:
        """Handle lines and stops until the input has ended and all stops are published."""
        next_s: float | None = None
        beat_s = 0.0
        is_ending = False
        while not (is_ending and next_s is None):
            now_s = time.monotonic()
            if now_s >= beat_s:
                beat_s = now_s + BEAT_S
                self._write("")
            wait_s = max(min(beat_s, math.inf if next_s is None else next_s) - now_s, 0.0)
            with contextlib.suppress(queue.Empty):
                line = self._lines.get(timeout=wait_s)
                if line is None:
                    is_ending = True
                    self._stops.stop_all(time.monotonic())
                else:
                    self._handle(line)
            next_s = self._stops.run(time.monotonic())
        for each in self._publishers.values():
            if isinstance(each, ServiceStop):
                each.finish()

    def _write(self, line: str) -> bool:
        """Write a line to the server. Return False if the pipe is full or closed."""
        try:
            os.write(self._output, f"{line}\n".encode())
        except OSError:
            return False
        return True

    def _confirm(self, key: str) -> None:
        while not self._write(key):
            time.sleep(BEAT_S)

    def _handle(self, line: Mapping[str, Any]) -> None:
        key, identity = line["key"], line.get("id", "")
        if line["op"] == "watch":
            threading.Thread(target=self._watch, args=(line,), daemon=True).start()
        elif line["op"] == "arm" and key in self._rules:
            message, limit_s = self._rules[key]
            if "body" in line:
                message = type(message)._from_bytes(bytes.fromhex(line["body"]))
                self._rules[key] = message, limit_s
            if identity:
                message = type(message)(id=identity)
            halts = self._halts[key][0] if key in self._halts else key
            now_s = time.monotonic()
            self._stops.arm(key, identity, message, now_s + limit_s, halts)
            if identity and (status := self._stops.early_status(key, identity, now_s)) is not None:
                self._end_goal(key, identity, status)
        elif line["op"] == "over":
            self._end_goal(key, identity, line["status"])
        elif line["op"] == "disarm":
            self._stops.disarm(key, identity)
        elif line["op"] == "stop":
            self._stops.stop(key, identity, time.monotonic())

    def _end_goal(self, key: str, identity: str, status: int) -> None:
        now_s = time.monotonic()
        if not self._stops.end(key, identity, status, now_s):
            return
        if key in self._halts and not self._stops.has(key):
            # If another goal has replaced the goal, more than one zero would hold up its drive.
            self._stops.halt(*self._halts[key], now_s, 1 if status in _REPLACED else REPETITIONS)
        self._write(json.dumps({"op": "over", "key": key, "id": identity}))

    def _watch(self, line: Mapping[str, Any]) -> None:
        """Advertise a topic and wait for its subscribers, or create a service client; then confirm it."""
        key = line["key"]
        if key.startswith(CALL):
            service_class: Any = load_service_class(line["type"])
            request = service_class._request_class._from_bytes(bytes.fromhex(line["body"]))
            self._rules[key] = request, float(line["limit_s"])
            self._publishers[key] = ServiceStop(self._node, key.removeprefix(CALL), service_class)
            self._confirm(key)
            return
        message_class: Any = load_message_class(line["type"])
        self._rules[key] = message_class._from_bytes(bytes.fromhex(line["body"])), float(line["limit_s"])
        publisher = self._node.advertise(key, message_class, queue_size=None)
        self._publishers[key] = publisher
        publishers = [(key, publisher), *self._watch_results(line)]
        end_s = time.monotonic() + CONNECTING_S
        known: Mapping[str, Sequence[str]] = {}
        while (
            any(each.connection_count < len(known.get(topic, "?")) for topic, each in publishers)
            and time.monotonic() < end_s
        ):
            with contextlib.suppress(PiprosError):
                subscribers = dict(self._node.master.get_system_state()[1])
                known = {topic: subscribers.get(topic, ()) for topic, _ in publishers}
            time.sleep(REPEAT_S / 5)
        self._confirm(key)

    def _watch_results(self, line: Mapping[str, Any]) -> list[tuple[str, Any]]:
        """Subscribe to the results of an action whose goals have a topic that stops the robot."""
        if "halt" not in line:
            return []
        key, halt = line["key"], line["halt"]
        message_class: Any = load_message_class(halt["type"])
        publisher = self._node.advertise(halt["topic"], message_class, queue_size=None)
        self._publishers.setdefault(halt["topic"], publisher)
        self._halts[key] = halt["topic"], message_class._from_bytes(bytes.fromhex(halt["body"]))

        def ended(message: Any) -> None:
            status = message.status
            self._lines.put({"op": "over", "key": key, "id": status.goal_id.id, "status": status.status})

        result: Any = load_message_class(halt["result"])
        self._node.subscribe(f"{key.removesuffix('cancel')}result", result, ended, queue_size=100)
        return [(halt["topic"], publisher)]


def main() -> None:
    """Run the process."""
    node = Node("pipros_guardian", anonymous=True)
    guardian = GuardianProcess(node)
    # Ctrl-C and the closing of a terminal are meant for the server, which closes the input when it exits.
    for number in (signal.SIGINT, getattr(signal, "SIGHUP", signal.SIGINT)):
        signal.signal(number, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: guardian.end())
    if sys.platform != "win32":
        os.set_blocking(sys.stdout.fileno(), False)
    node.start()
    threading.Thread(target=guardian.read, daemon=True).start()
    guardian.run()
    # A master or subscriber that hangs must not keep the process alive.
    threading.Timer(ENDING_S, os._exit, (0,)).start()
    node.shutdown()
    os._exit(0)


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
        self._early: deque[tuple[str, str, int, float]] = deque(maxlen=POLICY_STOPS)

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
        if not is_pending and len(identity) <= POLICY_GOAL_ID_CHARACTERS:
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


if __name__ == "__main__":
    main()
