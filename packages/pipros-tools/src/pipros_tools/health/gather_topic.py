"""Gather the facts for `health.topic_check`: replies of the topic's nodes, and received messages."""

from __future__ import annotations

import struct
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Final

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.basics.printable import printable
from pipros.msg.errors import MessageException
from pipros.net.in_parallel import in_parallel
from pipros.net.rpc_client import RpcClient
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros.node.start_params import is_on
from pipros_tools.graph.bus_info import drop_counts, statistics_of
from pipros_tools.graph.raw_decoder import RawDecoder
from pipros_tools.health.examine import stable_system
from pipros_tools.health.gather_publisher import begins_with_header
from pipros_tools.health.system_report import SystemReport
from pipros_tools.health.topic_facts import CheckedMessage, TopicFacts

MESSAGES: Final = 10_000
"""Maximum number of messages kept. At this number, the older half is dropped."""
FRAMES: Final = 10_000
"""Maximum number of frame names kept."""
_NAME: Final = "pipros_doctor"
_TRANSFORMS: Final = ("/tf", "/tf_static")
_HEADER: Final = struct.Struct("<IIII")  # seq, secs, nsecs, and the length of frame_id


def gather_topic(
    topic: str,
    environment: Environment | None = None,
    *,
    wait_s: float = 3.0,
    timeout_s: float = 3.0,
    over: threading.Event | None = None,
) -> TopicFacts:
    """Return the facts about a topic. Blocks for `wait_s`, and up to `timeout_s` per unresponsive node.

    A node in this process connects to the publishers, and receives their messages for `wait_s`, or until
    `over` is set. No message is sent. If a subscriber lacks a connection, the topic is advertised; see
    `pipros_tools.health.examine.examine`.

    Raises:
        InvalidName: `topic` is not a legal name.
        Unreachable: the master does not answer.
    """
    environment = environment or Environment.from_os()
    with Node(_NAME, anonymous=True, environment=environment) as node:
        name = node.resolve(topic)
        system = stable_system(environment, timeout_s, topic=name)
        before = _dropped(system, name, timeout_s)
        reachable = sum(end[0] == name and each.failure is None for end, each in system.publishers.items())
        listener = _Listener(node, name)
        if reachable:
            listener.wait_until_connected(reachable, timeout_s)
            (over or threading.Event()).wait(wait_s)
        received, count, frames, end_s = listener.end()
    after = _dropped(system, name, timeout_s)
    return TopicFacts(
        name,
        replace(system, publishers={end: each for end, each in system.publishers.items() if end[0] == name}),
        wait_s,
        received,
        count,
        end_s,
        frames,
        {subscriber: count - before.get(subscriber, count) for subscriber, count in after.items()},
    )


class _Listener:
    """Collects a topic's messages and the names of coordinate frames. `end` may be called once."""

    def __init__(self, node: Node, topic: str) -> None:
        self._node = node
        self._lock = threading.Lock()
        self._is_over = False
        self._received: list[CheckedMessage] = []
        self._count = 0
        self._frames: set[str] = set()
        self._decoder = RawDecoder()
        self._has_header: dict[str, bool] = {}
        with suppress(PiprosError):  # the master has ended
            if is_on(node, "/use_sim_time"):
                node.use_simulated_time()
        handles = {
            each: node.subscribe(each, AnyMsg, self._receive, callback_args=(each, topic))
            for each in dict.fromkeys((topic, *_TRANSFORMS))
        }
        self._subscriber = handles[topic]

    def wait_until_connected(self, publishers: int, timeout_s: float) -> None:
        """Wait until the given number of publishers are connected, or until the timeout."""
        end_s = time.monotonic() + timeout_s
        while self._subscriber.connection_count < publishers and time.monotonic() < end_s:
            self._node.wait_for_shutdown(0.02)

    def end(self) -> tuple[Sequence[CheckedMessage], int, frozenset[str], float]:
        """Stop collecting. Return the last messages, the number of all messages, the frames, and the time."""
        with self._lock:
            self._is_over = True
            return tuple(self._received), self._count, frozenset(self._frames), time.monotonic()

    def _receive(self, raw: AnyMsg, topics: tuple[str, str]) -> None:
        topic, wanted = topics
        now_s = time.monotonic()
        with self._lock:
            if self._is_over:
                return
            if topic in _TRANSFORMS:
                self._add_frames(raw)
            if topic != wanted:
                return
            if len(self._received) >= MESSAGES:
                del self._received[: MESSAGES // 2]
            self._count += 1
            self._received.append(self._message(raw, now_s))

    def _message(self, raw: AnyMsg, now_s: float) -> CheckedMessage:
        fields = raw.header
        publisher = printable(fields.get("callerid", ""))
        is_latched = fields.get("latching") == "1"
        definition = fields.get("message_definition", "")
        if definition not in self._has_header:
            self._has_header.clear()
            self._has_header[definition] = begins_with_header(definition)
        if not self._has_header[definition] or len(raw.body) < _HEADER.size:
            return CheckedMessage(now_s, publisher, is_latched=is_latched)
        _, secs, nsecs, length = _HEADER.unpack_from(raw.body)
        frame = bytes(raw.body[_HEADER.size : _HEADER.size + min(length, 300)]).decode("utf-8", "replace")
        ros_ns = self._node.clock.now_ns()
        age_s = (ros_ns - secs * 1_000_000_000 - nsecs) / 1e9 if ros_ns and (secs or nsecs) else None
        return CheckedMessage(now_s, publisher, age_s, frame, is_latched)

    def _add_frames(self, raw: AnyMsg) -> None:
        with suppress(PiprosError, MessageException):
            for each in getattr(self._decoder.decode(raw), "transforms", ()):
                if len(self._frames) < FRAMES:
                    self._frames |= {each.header.frame_id.lstrip("/"), each.child_frame_id.lstrip("/")}


def _dropped(system: SystemReport, topic: str, timeout_s: float) -> Mapping[str, int]:
    """Return how many of a topic's messages each subscriber has dropped so far."""
    subscribers = [node for node in system.state.subscribers.get(topic, ()) if system.is_alive(node)]

    def ask(node: str) -> int:
        try:
            with RpcClient(system.nodes[node].api, timeout_s=timeout_s) as client:
                rows = statistics_of(client.call("getBusStats", f"/{_NAME}"))
        except (PiprosError, ValueError):
            return 0
        return sum(count for name, count in drop_counts(rows) if name == topic)

    return in_parallel(subscribers, ask, at_once=16)
