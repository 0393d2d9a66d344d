"""A gateway, which passes topics, services and actions between a master and a ROS 2 domain.

One thread observes ROS 1 with calls that may block. Another thread compares both sides with the open topics,
services and actions, and opens or closes them as needed. Messages pass through neither thread: each message
is converted in the thread that receives it.
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
import threading
import time
from collections.abc import Mapping, Sequence
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.msg import load_service_class
from pipros.node import Node
from pipros_libraries.diagnostics.link_status import LinkDiagnostics
from pipros_ros2.bridged_services import ServiceToRos2
from pipros_ros2.gateway_status import GatewayStatus, NotBridged, Row, problem_key
from pipros_ros2.interface import Endpoint, Ros2Engine
from pipros_ros2.limits import Ros2Limits
from pipros_ros2.ros1_graph import Ros1Graph, Ros1Poller, Ros1Topic
from pipros_ros2.ros2_graph import Ros2Graph
from pipros_ros2.rules import GatewayRules
from pipros_ros2.selection import GatewayParts, GatewaySelection, Key, Open
from pipros_ros2.topic_to_ros1 import TopicToRos1
from pipros_ros2.topic_to_ros2 import TopicToRos2
from pipros_ros2.type_pairs import TypePairs

POLL_S: Final = 0.5
"""Interval between queries of the master."""
TICK_S: Final = 0.1
"""Interval between checks of ROS 2 and of the subscribers on both sides."""
COMPARE_S: Final = 5.0
"""Interval between attempts to open topics, services and actions that could not be opened."""
DIAGNOSTICS_S: Final = 1.0
_REPORTED: Final = 1000
_LOOKED_UP: Final = 10
"""Maximum number of unknown publishers that are looked up between two updates. Over Zenoh, a process can name
any number.
"""


def new_identity(node: Node) -> str:
    """Return the identity of a new gateway. Gateways of the same master share the part before the `_`."""
    try:
        master = str(node.master.get_param("/run_id"))
    except PiprosError:
        master = node.environment.master_uri
    return f"{hashlib.sha256(master.encode()).hexdigest()[:12]}_{os.urandom(4).hex()}"


class Gateway:
    """Connects a node's master to ROS 2. The caller must close the node and the engine."""

    def __init__(
        self,
        node: Node,
        engine: Ros2Engine,
        identity: str,
        rules: GatewayRules,
        pairs: TypePairs,
        *,
        is_local: bool,
        log: logging.Logger | None = None,
        poll_s: float = POLL_S,
    ) -> None:
        """Store the settings.

        Args:
            identity: the identity that the engine announces; see `new_identity`.
            is_local: whether the gateway reaches ROS 2 nodes on this machine only.
        """
        self.log = log or node.log
        self._node = node
        self._engine = engine
        self._poll_s = poll_s
        self._limit = node.limits.of(Ros2Limits).ros2_topics
        self._graph: Ros1Graph | None = None
        self._known: Mapping[bytes, Endpoint] = {}
        self._unknown: set[bytes] = set()
        self._open: dict[Key, tuple[object, Open]] = {}
        self._skipped: dict[str, NotBridged] = {}
        self._reported: set[str] = set()
        self._before: dict[Key, int] = {}
        self._rates: dict[Key, float] = {}
        self._counted_s = time.monotonic()
        self._poller = Ros1Poller(node)
        self._seen: tuple[object, object] = (None, None)
        self._compare_at_s = 0.0
        self._diagnostics: LinkDiagnostics | None = None
        self._changed = threading.Event()
        self._parts = GatewayParts(
            node, engine, identity, rules, pairs, is_local, self._publisher, self._changed.set
        )
        self._is_closed = threading.Event()
        self._threads: list[threading.Thread] = []

    def start(self) -> None:
        """Start passing topics, services and actions. Blocks until the master answers."""
        trigger: Any = load_service_class("std_srvs/Trigger")
        self._node.serve(
            f"{self._node.name}/status",
            trigger,
            lambda _: trigger._response_class(True, json.dumps(self.status().values())),
        )
        self._diagnostics = LinkDiagnostics(self._node, "pipros ros2")
        self._poller.start()
        for target in (self._poll_repeatedly, self._update_repeatedly):
            thread = threading.Thread(target=target, name="gateway to ROS 2", daemon=True)
            thread.start()
            self._threads.append(thread)

    def close(self) -> None:
        """Stop the threads. Open topics, services and actions remain until the node and engine are closed."""
        self._is_closed.set()
        self._changed.set()
        self._poller.close()

    # -- the thread that observes ROS 1 --------------------------------------------------

    def _poll_repeatedly(self) -> None:
        while not self._is_closed.is_set():
            try:
                graph = self._poller.poll()
                if graph is not None and graph != self._graph:
                    self._graph = graph
                    self._changed.set()
            except Exception as error:
                if not self._is_closed.is_set():
                    self.log.exception("ROS 1 could not be observed: %s", error)
            self._is_closed.wait(self._poll_s)

    # -- the thread that opens and closes topics, services and actions -------------------------

    def _update_repeatedly(self) -> None:
        while not self._is_closed.is_set():
            self._changed.wait(TICK_S)
            self._changed.clear()
            try:
                graph = self._graph
                if graph is not None:
                    self._update(graph, self._engine.endpoints())
                self._count()
            except Exception as error:
                if not self._is_closed.is_set() and not self._node.is_ending:
                    self.log.exception("the gateway failed: %s", error)

    def _update(self, graph: Ros1Graph, endpoints: Sequence[Endpoint]) -> None:
        """Open, update and close topics, services and actions, to match both sides."""
        known = {each.key: each for each in endpoints if not self._parts.is_own(each)}
        self._unknown.clear()
        self._known = known
        found = Ros2Graph(self._known.values())
        now_s = time.monotonic()
        if (graph, endpoints) != self._seen or now_s >= self._compare_at_s:
            self._seen, self._compare_at_s = (graph, endpoints), now_s + COMPARE_S
            selection = GatewaySelection(self._parts, graph, found)
            self._open_wanted(selection)
            self._skipped = selection.skipped
            self._report(selection.skipped)
        for (_, _, name), (_, each) in list(self._open.items()):
            try:
                _update_open(each, graph.topics.get(name), found.publishers.get(name, ()))
            except PiprosError as error:  # the others must still be updated
                each.counts.fail(f"{name}: {error}")

    def _open_wanted(self, selection: GatewaySelection) -> None:
        wanted = selection.within(self._limit, self._open)
        for key, (version, each) in list(self._open.items()):
            if key not in wanted or wanted[key][0] != version:
                del self._open[key]
                each.close()
        for key, (version, make) in wanted.items():
            with selection.skipping(key):
                if key not in self._open:
                    self._open[key] = version, make()

    def _publisher(self, key: bytes) -> Endpoint | None:
        """Return the ROS 2 publisher with this key, or None if its messages must not be passed."""
        found = self._known.get(key)
        if found is None and key not in self._unknown and len(self._unknown) < _LOOKED_UP:
            self._unknown.add(key)  # look up each unknown key once per update
            self._known = {
                each.key: each for each in self._engine.endpoints() if not self._parts.is_own(each)
            }
            found = self._known.get(key)
        return found

    def _report(self, skipped: Mapping[str, NotBridged]) -> None:
        """Log each reason once. Log nothing for names that the rules or their defaults exclude."""
        for name, each in skipped.items():
            text = f"{name}: {each.reason}"
            if not each.by_rule and text not in self._reported and len(self._reported) < _REPORTED:
                self._reported.add(text)
                self.log.info("left out: %s", text)

    # -- status ---------------------------------------------------------------------------------

    def _count(self) -> None:
        now_s = time.monotonic()
        passed_s = now_s - self._counted_s
        if passed_s < DIAGNOSTICS_S:
            return
        self._counted_s = now_s
        counts = {key: each.counts.passed for key, (_, each) in self._open.items()}
        self._rates = {key: (count - self._before.get(key, 0)) / passed_s for key, count in counts.items()}
        self._before = counts
        if self._diagnostics is not None and self._diagnostics.is_wanted:
            self._diagnostics.publish([self.status().diagnosis(self._node.name)])

    def status(self) -> GatewayStatus:
        """Return the open topics, services and actions, and the names left out. Thread-safe."""
        rows = [
            _row(key, each, self._rates.get(key, 0.0))
            for key, (_, each) in sorted(
                self._open.copy().items(), key=lambda item: [str(part) for part in item[0]]
            )
        ]
        problems = {problem_key(each): NotBridged(each.reason) for each in self._engine.problems()}
        return GatewayStatus(self._parts.identity, rows, self._skipped | problems)


def _row(key: Key, each: Open, rate: float) -> Row:
    kind, direction, name = key
    counts, is_active = each.counts, each.is_active if isinstance(each, TopicToRos1 | TopicToRos2) else True
    return Row(
        *(kind.value, direction.value, name, each.types, is_active),
        *(counts.passed, rate, counts.dropped, counts.reason),
    )


def _update_open(each: Open, topic: Ros1Topic | None, publishers: Sequence[Endpoint]) -> None:
    """Update an open topic, service or action to match both sides."""
    if isinstance(each, TopicToRos2):
        each.update(topic.publishers if topic else ())
    elif isinstance(each, TopicToRos1):
        of_type = each.route.pair.plan.ros2_type
        each.update([endpoint for endpoint in publishers if endpoint.type == of_type])
    elif not isinstance(each, ServiceToRos2):
        each.update()
