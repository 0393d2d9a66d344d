"""Pairs of corresponding ROS 1 and ROS 2 types, with the plans by which a gateway converts them."""

from __future__ import annotations

import os
import threading
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

from pipros.basics.errors import LimitExceeded, NotFound
from pipros.msg import load_service_class
from pipros.msg.class_finder import installed_class
from pipros.msg.language.full_text import specs_from_text
from pipros.msg.language.spec import MessageSpec
from pipros.node.any_msg import AnyMsg
from pipros_libraries.topic_tools.raw import class_like
from pipros_ros2.action_pair import ActionPair
from pipros_ros2.interface import NO_HASHES, PartHashes
from pipros_ros2.rules import StaticRule
from pipros_rosbag2.conversion.errors import ConversionError
from pipros_rosbag2.conversion.mapping import MappingRules
from pipros_rosbag2.conversion.plans import ConversionPlan, Plans, ServicePlan
from pipros_rosbag2.distribution import Distribution
from pipros_rosbag2.interfaces.catalog import Catalog, Ros1Definitions
from pipros_rosbag2.interfaces.installed import installed_definitions
from pipros_rosbag2.interfaces.type_hash import ActionHashes
from pipros_tools.graph.definitions import Definition

ROS2_DEFINITION_BYTES = 16 * 1024 * 1024
"""Limit: all definitions of ROS 1 types that are not installed. Beyond it, topics of types that are not
installed are not bridged, and `pipros ros2 status` reports them.
"""


class WrongHash(ConversionError):
    """A ROS 2 node uses a different definition of a type."""


@dataclass(frozen=True, slots=True)
class TypePair:
    """A ROS 1 type and the corresponding ROS 2 type.

    Attributes:
        raw: class for ROS 1 messages that are passed undecoded.
        type_hash: hash of the ROS 2 type; empty in Humble.
    """

    plan: ConversionPlan
    raw: type[AnyMsg]
    type_hash: str


@dataclass(frozen=True, slots=True)
class ServicePair:
    """A ROS 1 service and the corresponding ROS 2 service."""

    plan: ServicePlan
    md5sum: str
    type_hash: str
    parts: PartHashes = NO_HASHES


class TypePairs:
    """Finds corresponding ROS 1 and ROS 2 types, with their conversions. Thread-safe.

    Args:
        folders: see `Catalog`.
        is_lenient: whether `check_hash` accepts hashes that differ.
    """

    def __init__(
        self,
        distribution: Distribution,
        rules: MappingRules,
        folders: Sequence[str | os.PathLike[str]] = (),
        *,
        is_lenient: bool = False,
    ) -> None:
        self._installed = installed_definitions()
        self._learned: dict[str, MessageSpec] = {}
        self._learned_bytes = 0
        self._limit_bytes = ROS2_DEFINITION_BYTES
        ros1 = Ros1Definitions(self._message, self._installed.service)
        # Where nodes announce hashes, a type that has changed in ROS 2 is recognized; see `check_hash`.
        self._catalog = Catalog(distribution, ros1, folders, derive=distribution.has_type_hashes)
        self._plans = Plans(self._catalog, ros1, rules)
        self._has_hashes = distribution.has_type_hashes
        self._is_lenient = is_lenient
        self._definitions: dict[str, Definition] = {}
        self._pairs: dict[tuple[str, str, str], TypePair] = {}
        self._actions: dict[tuple[str, str], ActionPair] = {}
        self._lock = threading.RLock()

    def _message(self, name: str) -> MessageSpec:
        return self._learned[name] if name in self._learned else self._installed.message(name)

    def of_ros1(self, definition: Definition) -> TypePair:
        """Return the pair for a ROS 1 type, which need not be installed.

        Raises:
            PiprosError: no ROS 2 type corresponds, or a definition is unknown or invalid.
        """
        with self._lock:
            if installed_class(definition.type) is None:
                self._learn(definition)
            plan = self._plans.for_ros1(definition.type)
            return self._pair(plan, definition)

    def of_ros2(self, ros2_type: str) -> TypePair:
        """Return the pair for a ROS 2 type. Raises the same errors as `of_ros1`."""
        with self._lock:
            plan = self._plans.for_ros2(ros2_type)
            found = installed_class(plan.ros1_type)
            if found is not None:
                return self._pair(plan, Definition(plan.ros1_type, found._md5sum, found._full_text))
            if plan.ros1_type not in self._definitions:
                raise NotFound(f"the ROS 1 type {plan.ros1_type} is not installed")
            return self._pair(plan, self._definitions[plan.ros1_type])

    def of_rule(self, rule: StaticRule) -> TypePair:
        """Return the pair for the types given by a rule. Raises the same errors as `of_ros1`."""
        if not rule.ros1_type:
            return self.of_ros2(rule.ros2_type)
        found = installed_class(rule.ros1_type)
        if found is None:
            raise NotFound(f"the ROS 1 type {rule.ros1_type} is not installed")
        return self.of_ros1(Definition(rule.ros1_type, found._md5sum, found._full_text))

    def check_hash(self, ros2_type: str, expected: Collection[str], announced: str) -> None:
        """Check that the hash that a ROS 2 node announces is one of a type's hashes. Empty hashes match all.

        Raises:
            WrongHash: the announced hash differs from all expected hashes.
        """
        if announced and all(expected) and announced not in expected and not self._is_lenient:
            raise WrongHash(
                f"the peer's definition of {ros2_type} differs: "
                f"expected the hash {' or '.join(f'{each[:15]}…' for each in sorted(expected))}, "
                f"got {announced[:15]}…; "
                "set --distro, pass the package's folder with --msgs, or build the peer's package again"
            )

    def of_service(self, ros1_type: str) -> ServicePair:
        """Return the pair for a ROS 1 service. Raises the same errors as `of_ros1`."""
        with self._lock:
            plan = self._plans.service(ros1_type)
            found: Any = load_service_class(ros1_type)
            if not self._has_hashes:
                return ServicePair(plan, found._md5sum, "")
            parts = PartHashes(*self._plans.part_hashes(plan.ros2_type))
            return ServicePair(plan, found._md5sum, self._plans.service_hash(plan.ros2_type), parts)

    def of_ros2_service(self, ros2_type: str) -> ServicePair:
        """Return the pair for a ROS 2 service. Raises the same errors as `of_ros1`."""
        with self._lock:
            return self.of_service(self._plans.ros1_service(ros2_type))

    def of_action(self, ros1_type: str, ros2_type: str = "") -> ActionPair:
        """Return the pair for a ROS 1 action, such as `nav_msgs/GetMap`.

        Raises the same errors as `of_ros1`.

        Args:
            ros2_type: the ROS 2 action, instead of the one that the rules determine.
        """
        with self._lock:
            plan = self._plans.action(ros1_type, ros2_type)
            key = plan.ros1_type, plan.ros2_type
            if key not in self._actions:
                hashes = self._plans.action_hashes(plan.ros2_type) if self._has_hashes else ActionHashes()
                self._actions[key] = ActionPair(plan, hashes)
            return self._actions[key]

    def all_of_action(self, ros1_type: str) -> tuple[ActionPair, ...]:
        """Return the pairs for all ROS 2 types of a ROS 1 action. Raises the same errors as `of_ros1`."""
        with self._lock:
            return tuple(self.of_action(ros1_type, each) for each in self._plans.ros2_actions(ros1_type))

    def of_ros2_action(self, ros2_type: str) -> ActionPair:
        """Return the pair for a ROS 2 action. Raises the same errors as `of_ros1`."""
        with self._lock:
            return self.of_action(self._plans.ros1_action(ros2_type), ros2_type)

    def _pair(self, plan: ConversionPlan, definition: Definition) -> TypePair:
        key = plan.ros1_type, plan.ros2_type, definition.md5sum
        if key not in self._pairs:
            self._pairs[key] = self._new_pair(plan, definition)
        return self._pairs[key]

    def _new_pair(self, plan: ConversionPlan, definition: Definition) -> TypePair:
        plan.prepare()
        header = {
            "type": definition.type,
            "md5sum": definition.md5sum,
            "message_definition": definition.text,
        }
        type_hash = self._plans.message_hash(plan.ros2_type) if self._has_hashes else ""
        return TypePair(plan, class_like(header), type_hash)

    def _learn(self, definition: Definition) -> None:
        """Add a definition from a publisher. The first definition of each type is used."""
        if definition.type in self._definitions:
            return
        if self._learned_bytes + len(definition.text) > self._limit_bytes:
            raise LimitExceeded(f"too many received definitions; the limit is {self._limit_bytes} bytes")
        specs = specs_from_text(definition.type, definition.text)
        self._learned_bytes += len(definition.text)
        for name, spec in specs.items():
            self._learned.setdefault(name, spec)
        self._definitions[definition.type] = definition
        self._catalog.add_derived(specs)
