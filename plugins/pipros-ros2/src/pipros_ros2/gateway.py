"""A gateway, which passes topics, services and actions between a master and a ROS 2 domain.

One thread observes ROS 1 with calls that may block. Another thread compares both sides with the open topics,
services and actions, and opens or closes them as needed. Messages pass through neither thread: each message
is converted in the thread that receives it.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import logging
import os
import threading
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.basics.limits import limit_text
from pipros.msg import load_service_class
from pipros.node import Node
from pipros_libraries.diagnostics.link_status import LinkDiagnostics
from pipros_ros2.action_to_ros1 import ActionToRos1
from pipros_ros2.action_to_ros2 import ActionToRos2
from pipros_ros2.bridged_services import ServiceToRos1, ServiceToRos2
from pipros_ros2.bridged_topics import route_of
from pipros_ros2.gateway_status import GatewayStatus, NotBridged, Row, problem_key
from pipros_ros2.interface import Endpoint, EndpointKind, Ros2Engine
from pipros_ros2.limits import Ros2Limits
from pipros_ros2.ros1_graph import Ros1Graph, Ros1Poller, Ros1Topic, is_part_of_action
from pipros_ros2.ros2_graph import Ros2Graph, callable_server
from pipros_ros2.rules import Direction, GatewayRules, RuleKind, StaticRule
from pipros_ros2.topic_to_ros1 import TopicToRos1
from pipros_ros2.topic_to_ros2 import TopicToRos2
from pipros_ros2.type_pairs import TypePair, TypePairs
from pipros_rosbag2.interfaces.action_types import action_of_service
from pipros_rosbag2.names import action_names, checked_name

POLL_S: Final = 0.5
"""Interval between queries of the master."""
TICK_S: Final = 0.1
"""Interval between checks of ROS 2 and of the subscribers on both sides."""
COMPARE_S: Final = 5.0
"""Interval between attempts to open topics, services and actions that could not be opened."""
DIAGNOSTICS_S: Final = 1.0
_SKIPPED: Final = 1000
_CLOCK: Final = "/clock"

Open = TopicToRos1 | TopicToRos2 | ServiceToRos1 | ServiceToRos2 | ActionToRos1 | ActionToRos2
Key = tuple[RuleKind, Direction, str]
"""Identifies a topic, service or action. The name is the one on the publishing or offering side."""
_Wanted = tuple[object, Callable[[], Open]]
"""A version, and a function that opens the topic, service or action.

If the version changes, the topic, service or action is closed and opened again.
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
        self.identity = identity
        self.log = log or node.log
        self._node = node
        self._engine = engine
        self._rules = rules
        self._pairs = pairs
        self._is_local = is_local
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
        known = {each.key: each for each in endpoints if not self._is_own(each)}
        self._unknown.clear()
        self._known = known
        found = Ros2Graph(self._known.values())
        now_s = time.monotonic()
        if (graph, endpoints) != self._seen or now_s >= self._compare_at_s:
            self._seen, self._compare_at_s = (graph, endpoints), now_s + COMPARE_S
            skipped: dict[str, NotBridged] = {}
            self._open_wanted(self._wanted(graph, found, skipped), skipped)
            self._skipped = skipped
            self._report(skipped)
        for (_, _, name), (_, each) in list(self._open.items()):
            try:
                _update_open(each, graph.topics.get(name), found.publishers.get(name, ()))
            except PiprosError as error:  # the others must still be updated
                each.counts.fail(f"{name}: {error}")

    def _wanted(
        self, graph: Ros1Graph, found: Ros2Graph, skipped: dict[str, NotBridged]
    ) -> dict[Key, _Wanted]:
        """Return the topics, services and actions to pass, and add the others to `skipped`."""
        wanted: dict[Key, _Wanted] = {}
        # The direction is that of messages, calls and goals: calls to a ROS 1 service go to ROS 1.
        kinds: tuple[tuple[RuleKind, Direction, Iterable[str], Callable[[str], _Wanted | None]], ...] = (
            (
                RuleKind.TOPIC,
                Direction.TO_ROS2,
                {*graph.topics, *self._rules.from_the_start(Direction.TO_ROS2)},
                lambda name: self._topic_to_ros2(name, graph),
            ),
            (
                RuleKind.TOPIC,
                Direction.TO_ROS1,
                {*found.publishers, *self._rules.from_the_start(Direction.TO_ROS1)},
                lambda name: self._topic_to_ros1(name, graph, found),
            ),
            (
                RuleKind.SERVICE,
                Direction.TO_ROS1,
                graph.services,
                lambda name: self._service_to_ros1(name, graph),
            ),
            (
                RuleKind.SERVICE,
                Direction.TO_ROS2,
                found.services,
                lambda name: self._service_to_ros2(name, graph, found),
            ),
            (
                RuleKind.ACTION,
                Direction.TO_ROS1,
                graph.actions,
                lambda name: self._action_to_ros1(name, graph),
            ),
            (
                RuleKind.ACTION,
                Direction.TO_ROS2,
                found.actions,
                lambda name: self._action_to_ros2(name, graph, found),
            ),
        )
        for kind, direction, names, make in kinds:
            for name in names:
                if self._is_part_of_action(kind, direction, name, graph):
                    continue
                with _skipping(skipped, (kind, direction, name)):
                    verdict = self._rules.verdict(kind, direction, name, is_local=self._is_local)
                    if not verdict.passes:
                        raise _ByRule(verdict.reason)
                    each = make(name)
                    if each is not None:
                        wanted[kind, direction, name] = each
        return wanted

    def _is_part_of_action(self, kind: RuleKind, direction: Direction, name: str, graph: Ros1Graph) -> bool:
        """Return whether a topic or service is passed only as part of an action."""
        if self._rules.names(kind, direction, name):
            return False
        topic = graph.topics.get(name) if (kind, direction) == (RuleKind.TOPIC, Direction.TO_ROS2) else None
        return "/_action/" in name or (topic is not None and is_part_of_action(name, topic.definition.type))

    def _topic_to_ros2(self, name: str, graph: Ros1Graph) -> _Wanted:
        topic, rule = graph.topics.get(name), self._rules.renamed(Direction.TO_ROS2, name)
        pair = self._pairs.of_ros1(topic.definition) if topic else self._pair_of(rule)
        route = route_of(name, rule.ros2 if rule else name, pair, rule)
        self._check_rivals(EndpointKind.PUBLISHER, route.ros2)
        is_latched = topic is not None and topic.is_latched
        version = route.ros2, route.pair.plan.ros2_type, is_latched
        return version, lambda: TopicToRos2(self._node, self._engine, route, is_latched=is_latched)

    def _topic_to_ros1(self, name: str, graph: Ros1Graph, found: Ros2Graph) -> _Wanted:
        rule, publishers = self._rules.renamed(Direction.TO_ROS1, name), found.publishers.get(name)
        target = rule.ros1 if rule else checked_name(name)
        pair = self._pair_of_any({each.type for each in publishers}) if publishers else self._pair_of(rule)
        ros2_type = pair.plan.ros2_type
        for each in publishers or ():
            if each.type == ros2_type:
                self._pairs.check_hash(ros2_type, {pair.type_hash}, each.type_hash)
        there = graph.topics.get(target)
        if there is not None and there.definition.type != pair.plan.ros1_type:
            raise PiprosError(f"the type is {there.definition.type} in ROS 1, but {ros2_type} in ROS 2")
        if there is not None and target == _CLOCK:
            raise PiprosError("a ROS 1 node already publishes the clock")
        route = route_of(target, name, pair, rule)
        return (target, ros2_type), lambda: TopicToRos1(
            self._node, self._engine, route, self.identity, self._publisher, self._changed.set
        )

    def _pair_of_any(self, types: Collection[str]) -> TypePair:
        """Return the pair for the first type that has one. If none does, raise the first type's error."""
        errors = []
        for each in sorted(types):
            try:
                return self._pairs.of_ros2(each)
            except PiprosError as error:
                errors.append(error)
        raise errors[0]

    def _pair_of(self, rule: StaticRule | None) -> TypePair:
        """Return the type pair given by a rule for a topic without publishers."""
        if rule is None:
            raise PiprosError("no node publishes it")
        return self._pairs.of_rule(rule)

    def _service_to_ros1(self, name: str, graph: Ros1Graph) -> _Wanted:
        self._check_rivals(EndpointKind.SERVER, name)
        pair = self._pairs.of_service(graph.services[name])
        timeout_s = self._rules.timeouts_s.get(name)
        return pair.plan.ros1_type, lambda: ServiceToRos1(self._node, self._engine, name, pair, timeout_s)

    def _service_to_ros2(self, name: str, graph: Ros1Graph, found: Ros2Graph) -> _Wanted | None:
        if name in graph.services:
            return None
        server = callable_server(found.services[name])
        pair = self._pairs.of_ros2_service(server.type)
        self._pairs.check_hash(pair.plan.ros2_type, {pair.type_hash, pair.parts.request}, server.type_hash)
        timeout_s = self._rules.timeouts_s.get(name)
        return pair.plan.ros2_type, lambda: ServiceToRos2(self._node, self._engine, name, pair, timeout_s)

    def _action_to_ros1(self, name: str, graph: Ros1Graph) -> _Wanted:
        self._check_rivals(EndpointKind.SERVER, action_names(name).send_goal)
        every = self._pairs.all_of_action(graph.actions[name])
        lacks = [self._engine.lacks(each.send_goal) for each in every]
        pairs = tuple(each for each, reason in zip(every, lacks, strict=True) if not reason)
        if not pairs:
            raise PiprosError(lacks[0])
        return pairs, lambda: ActionToRos1(self._node, self._engine, name, pairs, self.identity)

    def _action_to_ros2(self, name: str, graph: Ros1Graph, found: Ros2Graph) -> _Wanted | None:
        if name in graph.actions:
            return None
        server = callable_server(found.actions[name])
        pair = self._pairs.of_ros2_action(action_of_service(server.type))
        hashes = {pair.hashes.send_goal, pair.hashes.send_goal_parts[0]}
        self._pairs.check_hash(pair.plan.ros2_type, hashes, server.type_hash)
        return pair, lambda: ActionToRos2(self._node, self._engine, name, pair, self.identity)

    def _check_rivals(self, kind: EndpointKind, name: str) -> None:
        """Raise PiprosError if another gateway of this master with a smaller identity offers the name."""
        for each in self._engine.endpoints():
            if (each.kind, each.name) == (kind, name) and self._is_own(each) and each.gateway < self.identity:
                raise PiprosError("another gateway of this master already passes it")

    def _open_wanted(self, wanted: Mapping[Key, _Wanted], skipped: dict[str, NotBridged]) -> None:
        for key, (version, each) in list(self._open.items()):
            if key not in wanted or wanted[key][0] != version:
                del self._open[key]
                each.close()
        for key, (version, make) in wanted.items():
            with _skipping(skipped, key):
                if key in self._open:
                    continue
                if len(self._open) >= self._limit:
                    raise PiprosError(
                        f"too many topics, services and actions; {limit_text('ros2_topics', self._limit)}"
                    )
                self._open[key] = version, make()

    def _is_own(self, endpoint: Endpoint) -> bool:
        """Return whether a gateway of this master offers an endpoint."""
        return endpoint.gateway.partition("_")[0] == self.identity.partition("_")[0]

    def _publisher(self, key: bytes) -> Endpoint | None:
        """Return the ROS 2 publisher with this key, or None if its messages must not be passed."""
        found = self._known.get(key)
        if found is None and key not in self._unknown:
            self._unknown.add(key)  # look up each unknown key once per update
            self._known = {each.key: each for each in self._engine.endpoints() if not self._is_own(each)}
            found = self._known.get(key)
        return found

    def _report(self, skipped: Mapping[str, NotBridged]) -> None:
        """Log each reason once. Log nothing for names that the rules or their defaults exclude."""
        for name, each in skipped.items():
            text = f"{name}: {each.reason}"
            if not each.by_rule and text not in self._reported and len(self._reported) < _SKIPPED:
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
        return GatewayStatus(self.identity, rows, self._skipped | problems)


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


class _ByRule(PiprosError):
    """The rules or their defaults exclude a name."""


@contextlib.contextmanager
def _skipping(skipped: dict[str, NotBridged], key: Key) -> Iterator[None]:
    """Suppress a PiprosError or ValueError in the block, and add the name and the reason to `skipped`."""
    try:
        yield
    except (PiprosError, ValueError) as error:
        kind, direction, name = key
        if len(skipped) < _SKIPPED:
            reason = NotBridged(str(error), by_rule=isinstance(error, _ByRule))
            skipped[f"{kind.value}: {direction.value}: {name}"] = reason
