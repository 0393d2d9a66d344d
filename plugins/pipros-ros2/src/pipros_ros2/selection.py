"""Which topics, services and actions a gateway passes, and how each is opened."""

from __future__ import annotations

import contextlib
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from pipros.basics.errors import PiprosError
from pipros.basics.limits import limit_text
from pipros.basics.shares import fair_shares
from pipros.node import Node
from pipros_ros2.action_to_ros1 import ActionToRos1
from pipros_ros2.action_to_ros2 import ActionToRos2
from pipros_ros2.bridged_services import ServiceToRos1, ServiceToRos2
from pipros_ros2.bridged_topics import route_of
from pipros_ros2.gateway_status import NotBridged
from pipros_ros2.interface import Endpoint, EndpointKind, Ros2Engine
from pipros_ros2.ros1_graph import Ros1Graph, is_part_of_action
from pipros_ros2.ros2_graph import Ros2Graph, callable_server
from pipros_ros2.rules import Direction, GatewayRules, RuleKind, StaticRule
from pipros_ros2.topic_to_ros1 import Known, TopicToRos1
from pipros_ros2.topic_to_ros2 import TopicToRos2
from pipros_ros2.type_pairs import TypePair, TypePairs
from pipros_rosbag2.interfaces.action_types import action_of_service
from pipros_rosbag2.names import action_names, checked_name

_SKIPPED: Final = 1000
_CLOCK: Final = "/clock"

Open = TopicToRos1 | TopicToRos2 | ServiceToRos1 | ServiceToRos2 | ActionToRos1 | ActionToRos2
Key = tuple[RuleKind, Direction, str]
"""Identifies a topic, service or action. The name is the one on the publishing or offering side."""
Wanted = tuple[object, Callable[[], Open]]
"""A version, and a function that opens the topic, service or action.

If the version changes, the topic, service or action is closed and opened again.
"""


@dataclass(frozen=True, slots=True)
class GatewayParts:
    """What a gateway consists of.

    Attributes:
        identity: the identity that the engine announces.
        is_local: whether the gateway reaches ROS 2 nodes on this machine only.
        publisher: returns the ROS 2 publisher with a key, or None if its messages must not be passed.
        on_change: called if ROS 1 subscribers come or go.
    """

    node: Node
    engine: Ros2Engine
    identity: str
    rules: GatewayRules
    pairs: TypePairs
    is_local: bool
    publisher: Known
    on_change: Callable[[], None]

    def is_own(self, endpoint: Endpoint) -> bool:
        """Return whether a gateway of this master offers an endpoint."""
        return endpoint.gateway.partition("_")[0] == self.identity.partition("_")[0]


@dataclass(frozen=True, slots=True)
class GatewaySelection:
    """Selects what a gateway passes, by its rules and what exists on both sides.

    Attributes:
        skipped: the names that are left out, by kind, direction and name.
    """

    parts: GatewayParts
    ros1: Ros1Graph
    ros2: Ros2Graph
    skipped: dict[str, NotBridged] = field(default_factory=dict)

    def wanted(self) -> dict[Key, Wanted]:
        """Return the topics, services and actions to pass, and add the others to `skipped`."""
        to_ros1, to_ros2, start = Direction.TO_ROS1, Direction.TO_ROS2, self.parts.rules.from_the_start
        # The direction is that of messages, calls and goals: calls to a ROS 1 service go to ROS 1.
        kinds: tuple[tuple[RuleKind, Direction, Iterable[str], Callable[[str], Wanted | None]], ...] = (
            (RuleKind.TOPIC, to_ros2, {*self.ros1.topics, *start(to_ros2)}, self._topic_to_ros2),
            (RuleKind.TOPIC, to_ros1, {*self.ros2.publishers, *start(to_ros1)}, self._topic_to_ros1),
            (RuleKind.SERVICE, to_ros1, self.ros1.services, self._service_to_ros1),
            (RuleKind.SERVICE, to_ros2, self.ros2.services, self._service_to_ros2),
            (RuleKind.ACTION, to_ros1, self.ros1.actions, self._action_to_ros1),
            (RuleKind.ACTION, to_ros2, self.ros2.actions, self._action_to_ros2),
        )
        wanted: dict[Key, Wanted] = {}
        for kind, direction, names, make in kinds:
            for name in names:
                if self._is_part_of_action(kind, direction, name):
                    continue
                with self.skipping((kind, direction, name)):
                    verdict = self.parts.rules.verdict(kind, direction, name, is_local=self.parts.is_local)
                    if not verdict.passes:
                        raise _ByRule(verdict.reason)
                    if (each := make(name)) is not None:
                        wanted[kind, direction, name] = each
        return wanted

    def within(self, limit: int, is_open: Collection[Key]) -> dict[Key, Wanted]:
        """Return at most `limit` of the topics, services and actions to pass, first those that are open.

        ROS 1 and ROS 2 get fair shares, as do the processes in ROS 2, or the nodes of unknown processes. What
        several processes offer counts for the one that offers least.
        """
        wanted, owned = self.wanted(), defaultdict[str, list[Key]](list)
        offers: dict[tuple[RuleKind, Direction], Mapping[str, Sequence[Endpoint]]] = {
            (RuleKind.TOPIC, Direction.TO_ROS1): self.ros2.publishers,
            (RuleKind.SERVICE, Direction.TO_ROS2): self.ros2.services,
            (RuleKind.ACTION, Direction.TO_ROS2): self.ros2.actions,
        }
        found = {key: offers.get(key[:2], {}).get(key[2], ()) for key in wanted}
        owners = {key: {each.process or each.node or "?" for each in found[key]} for key in wanted}
        counts = Counter(owner for each in owners.values() for owner in each)
        for key in sorted(wanted, key=lambda key: key not in is_open):
            owned[min(owners[key], key=counts.__getitem__, default="")].append(key)
        sizes = {owner: len(keys) for owner, keys in owned.items() if owner}
        sides = fair_shares({"": len(owned[""]), "ROS 2": sum(sizes.values())}, limit)
        reason = f"too many topics, services and actions; {limit_text('ros2_topics', limit)}"
        shares = sides | fair_shares(sizes, sides["ROS 2"])
        for key in [key for owner, keys in owned.items() for key in keys[shares[owner] :]]:
            with self.skipping(key):
                del wanted[key]
                raise PiprosError(reason)
        return wanted

    def _is_part_of_action(self, kind: RuleKind, direction: Direction, name: str) -> bool:
        """Return whether a topic or service is passed only as part of an action."""
        if self.parts.rules.names(kind, direction, name):
            return False
        topic = (
            self.ros1.topics.get(name) if (kind, direction) == (RuleKind.TOPIC, Direction.TO_ROS2) else None
        )
        return "/_action/" in name or (topic is not None and is_part_of_action(name, topic.definition.type))

    def _topic_to_ros2(self, name: str) -> Wanted:
        topic, rule = self.ros1.topics.get(name), self.parts.rules.renamed(Direction.TO_ROS2, name)
        pair = self.parts.pairs.of_ros1(topic.definition) if topic else self._pair_of(rule)
        route = route_of(name, rule.ros2 if rule else name, pair, rule)
        self._check_rivals(EndpointKind.PUBLISHER, route.ros2)
        is_latched = topic is not None and topic.is_latched
        version = route.ros2, route.pair.plan.ros2_type, is_latched
        return version, lambda: TopicToRos2(self.parts.node, self.parts.engine, route, is_latched=is_latched)

    def _topic_to_ros1(self, name: str) -> Wanted:
        rule, publishers = self.parts.rules.renamed(Direction.TO_ROS1, name), self.ros2.publishers.get(name)
        target = rule.ros1 if rule else checked_name(name)
        pair = self._pair_of_any({each.type for each in publishers}) if publishers else self._pair_of(rule)
        ros2_type = pair.plan.ros2_type
        for each in publishers or ():
            if each.type == ros2_type:
                self.parts.pairs.check_hash(ros2_type, {pair.type_hash}, each.type_hash)
        there = self.ros1.topics.get(target)
        if there is not None and there.definition.type != pair.plan.ros1_type:
            raise PiprosError(f"the type is {there.definition.type} in ROS 1, but {ros2_type} in ROS 2")
        if there is not None and target == _CLOCK:
            raise PiprosError("a ROS 1 node already publishes the clock")
        route = route_of(target, name, pair, rule)
        return (target, ros2_type), lambda: TopicToRos1(
            self.parts.node,
            self.parts.engine,
            route,
            self.parts.identity,
            self.parts.publisher,
            self.parts.on_change,
        )

    def _pair_of_any(self, types: Collection[str]) -> TypePair:
        """Return the pair for the first type that has one. If none does, raise the first type's error."""
        errors = []
        for each in sorted(types):
            try:
                return self.parts.pairs.of_ros2(each)
            except PiprosError as error:
                errors.append(error)
        raise errors[0]

    def _pair_of(self, rule: StaticRule | None) -> TypePair:
        """Return the type pair given by a rule for a topic without publishers."""
        if rule is None:
            raise PiprosError("no node publishes it")
        return self.parts.pairs.of_rule(rule)

    def _service_to_ros1(self, name: str) -> Wanted:
        self._check_rivals(EndpointKind.SERVER, name)
        pair = self.parts.pairs.of_service(self.ros1.services[name])
        timeout_s = self.parts.rules.timeouts_s.get(name)
        return pair.plan.ros1_type, lambda: ServiceToRos1(
            self.parts.node, self.parts.engine, name, pair, timeout_s
        )

    def _service_to_ros2(self, name: str) -> Wanted | None:
        if name in self.ros1.services:
            return None
        server = callable_server(self.ros2.services[name])
        pair = self.parts.pairs.of_ros2_service(server.type)
        self.parts.pairs.check_hash(
            pair.plan.ros2_type, {pair.type_hash, pair.parts.request}, server.type_hash
        )
        timeout_s = self.parts.rules.timeouts_s.get(name)
        return pair.plan.ros2_type, lambda: ServiceToRos2(
            self.parts.node, self.parts.engine, name, pair, timeout_s
        )

    def _action_to_ros1(self, name: str) -> Wanted:
        self._check_rivals(EndpointKind.SERVER, action_names(name).send_goal)
        every = self.parts.pairs.all_of_action(self.ros1.actions[name])
        lacks = [self.parts.engine.lacks(each.send_goal) for each in every]
        pairs = tuple(each for each, reason in zip(every, lacks, strict=True) if not reason)
        if not pairs:
            raise PiprosError(lacks[0])
        return pairs, lambda: ActionToRos1(
            self.parts.node, self.parts.engine, name, pairs, self.parts.identity
        )

    def _action_to_ros2(self, name: str) -> Wanted | None:
        if name in self.ros1.actions:
            return None
        server = callable_server(self.ros2.actions[name])
        pair = self.parts.pairs.of_ros2_action(action_of_service(server.type))
        hashes = {pair.hashes.send_goal, pair.hashes.send_goal_parts[0]}
        self.parts.pairs.check_hash(pair.plan.ros2_type, hashes, server.type_hash)
        return pair, lambda: ActionToRos2(self.parts.node, self.parts.engine, name, pair, self.parts.identity)

    def _check_rivals(self, kind: EndpointKind, name: str) -> None:
        """Raise PiprosError if another gateway of this master with a smaller identity offers the name."""
        for each in self.parts.engine.endpoints():
            if (
                (each.kind, each.name) == (kind, name)
                and self.parts.is_own(each)
                and each.gateway < self.parts.identity
            ):
                raise PiprosError("another gateway of this master already passes it")

    @contextlib.contextmanager
    def skipping(self, key: Key) -> Iterator[None]:
        """Suppress a PiprosError or ValueError in the block, and add the name and the reason to `skipped`."""
        try:
            yield
        except (PiprosError, ValueError) as error:
            kind, direction, name = key
            if len(self.skipped) < _SKIPPED:
                reason = NotBridged(str(error), by_rule=isinstance(error, _ByRule))
                self.skipped[f"{kind.value}: {direction.value}: {name}"] = reason


class _ByRule(PiprosError):
    """The rules or their defaults exclude a name."""
