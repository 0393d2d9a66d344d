"""Rules for what a gateway passes between ROS 1 and ROS 2: allow and deny lists, and static rules, from YAML.

    topics:
      to_ros2: {allow: ["/camera/*"], deny: ["/camera/debug"]}
      to_ros1: {allow: [/cmd_vel]}
      static:
        - {ros1: /scan, ros2: /front/scan, direction: to_ros2, rate: 5, qos: {reliability: best_effort}}
    services:
      to_ros1: {allow: [/reset]}
      static: [{name: /plan, timeout_s: 60}]

Patterns use shell-style wildcards, which also match slashes. The direction of a service or an
action is the direction of its requests: `to_ros1` lets ROS 2 nodes call ROS 1 services.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from enum import Enum
from fnmatch import fnmatchcase
from typing import Any, TypeVar

from pipros.basics.names import is_legal_topic
from pipros.safe.yaml import YamlError, load
from pipros_ros2.interface import Durability, Reliability
from pipros_ros2.qos_choice import QosOverride
from pipros_rosbag2.conversion.errors import InvalidRules
from pipros_rosbag2.names import checked_name

_DAY_S = 86_400
_Choice = TypeVar("_Choice", bound=Enum)


class RuleKind(Enum):
    """Kind of name. The values are the keys in the file."""

    TOPIC = "topics"
    SERVICE = "services"
    ACTION = "actions"


class Direction(Enum):
    """Direction of messages or requests. The values are the words in the file."""

    TO_ROS1 = "to_ros1"
    TO_ROS2 = "to_ros2"


@dataclass(frozen=True, slots=True)
class Verdict:
    """Decision on whether a name passes, and the reason to show to users if it does not."""

    passes: bool
    reason: str = ""


@dataclass(frozen=True, slots=True)
class RuleFilter:
    """Patterns for allowed and denied names. If `allow` is empty, the defaults apply."""

    allow: tuple[str, ...] = ()
    deny: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class StaticRule:
    """Names, rate and QoS with which a topic passes. Allow and deny lists apply to it, too.

    Attributes:
        ros1, ros2: the names.
        directions: one direction, or both.
        ros1_type, ros2_type: the types that the topic must have; empty for any. If one is given, the topic
            passes from the start, before a node publishes it.
        rate: maximum number of messages per second; infinite for no limit.
    """

    ros1: str
    ros2: str
    directions: frozenset[Direction]
    ros1_type: str = ""
    ros2_type: str = ""
    rate: float = math.inf
    qos: QosOverride = field(default_factory=QosOverride)


INTERNAL = "an internal name"
"""Start of the reason why an internal name does not pass."""
_NEVER = {
    RuleKind.TOPIC: ("/parameter_events", "/rosout", "/rosout_agg", "*/_action/*", "*/_*"),
    RuleKind.SERVICE: (
        "*/get_loggers",
        "*/set_logger_level",
        "*/tf2_frames",
        "*/get_parameters",
        "*/set_parameters",
        "*/set_parameters_atomically",
        "*/list_parameters",
        "*/describe_parameters",
        "*/get_parameter_types",
        "*/get_type_description",
        "*/_action/*",
        "*/_*",
    ),
    RuleKind.ACTION: (),
}
"""Internal names of either side, which pass only if an allow list contains the exact name."""


@dataclass(frozen=True, slots=True)
class GatewayRules:
    """The rules of a gateway.

    Attributes:
        static: the static rules for topics.
        timeouts_s: the timeouts of calls, by the name of the service.
    """

    filters: Mapping[tuple[RuleKind, Direction], RuleFilter] = field(default_factory=dict)
    static: tuple[StaticRule, ...] = ()
    timeouts_s: Mapping[str, float] = field(default_factory=dict)

    def verdict(self, kind: RuleKind, direction: Direction, name: str, *, is_local: bool) -> Verdict:
        """Return whether a topic, service or action passes.

        Names that match a deny list do not pass; internal names pass only if an allow list contains them.
        Other names pass if they match the allow list. Without an allow list, all other topics of ROS 1 pass
        to ROS 2, services and actions of ROS 1 are not offered in ROS 2, and topics, services and actions of
        ROS 2 enter ROS 1 only if `is_local` is true.

        Args:
            is_local: whether the gateway reaches ROS 2 on this machine only.
        """
        chosen = self.filters.get((kind, direction), RuleFilter())
        where = f"{kind.value}: {direction.value}"
        pattern = next((each for each in chosen.deny if fnmatchcase(name, each)), None)
        if pattern is not None:
            return Verdict(False, f"the deny list ({where}) contains {pattern}")
        if name in chosen.allow:
            return Verdict(True)
        if any(fnmatchcase(name, each) for each in _NEVER[kind]):
            return Verdict(False, f"{INTERNAL} passes only if an allow list ({where}) contains it")
        if chosen.allow:
            passes = any(fnmatchcase(name, each) for each in chosen.allow)
            return Verdict(passes, "" if passes else f"the allow list ({where}) does not match it")
        # Topics enter ROS 1 in the direction to_ros1, services and actions in the direction to_ros2.
        enters_ros1 = (direction is Direction.TO_ROS1) is (kind is RuleKind.TOPIC)
        if enters_ros1 and not is_local:
            reason = (
                f"the gateway reaches other machines, so {kind.value} of ROS 2 enter ROS 1 only if "
                f"an allow list ({where}) matches"
            )
            return Verdict(False, reason)
        if direction is Direction.TO_ROS1 and kind is not RuleKind.TOPIC:
            reason = f"{kind.value} of ROS 1 enter ROS 2 only if an allow list ({where}) matches"
            return Verdict(False, reason)
        return Verdict(True)

    def names(self, kind: RuleKind, direction: Direction, name: str) -> bool:
        """Return whether an allow list contains this exact name."""
        return name in self.filters.get((kind, direction), RuleFilter()).allow

    def from_the_start(self, direction: Direction) -> list[str]:
        """Return the publishing-side names of topics that pass even before a node publishes them."""
        return [
            rule.ros1 if direction is Direction.TO_ROS2 else rule.ros2
            for rule in self.static
            if direction in rule.directions and (rule.ros1_type or rule.ros2_type)
        ]

    def renamed(self, direction: Direction, name: str) -> StaticRule | None:
        """Return the static rule for a topic's name on the publishing side, or None if there is none."""
        for rule in self.static:
            source = rule.ros1 if direction is Direction.TO_ROS2 else rule.ros2
            if source == name and direction in rule.directions:
                return rule
        return None


def parse_gateway_rules(text: str, file: str) -> GatewayRules:
    """Parse the rules of a gateway.

    Raises:
        InvalidRules: the file is malformed.
    """
    try:
        document = load(text, file, angles=False)
    except YamlError as error:
        raise InvalidRules(str(error)) from None
    sections = _mapping(document, file, {kind.value for kind in RuleKind})
    filters: dict[tuple[RuleKind, Direction], RuleFilter] = {}
    static: list[StaticRule] = []
    timeouts_s: dict[str, float] = {}
    for kind in RuleKind:
        where = f"{file}: {kind.value}"
        keys = {direction.value for direction in Direction} | (
            set() if kind is RuleKind.ACTION else {"static"}
        )
        section = _mapping(sections.get(kind.value), where, keys)
        for direction in Direction:
            if direction.value in section:
                filters[kind, direction] = _filter(section[direction.value], f"{where}: {direction.value}")
        for number, rule in enumerate(_list(section.get("static"), f"{where}: static"), 1):
            if kind is RuleKind.TOPIC:
                static.append(_static(rule, f"{where}: static rule {number}"))
            else:
                timeouts_s |= _timeout(rule, f"{where}: static rule {number}")
    return GatewayRules(filters, tuple(static), timeouts_s)


def _timeout(values: Any, where: str) -> dict[str, float]:
    rule = _mapping(values, where, {"name", "timeout_s"})
    name, timeout_s = rule.get("name"), rule.get("timeout_s")
    if not isinstance(name, str) or not name.startswith("/"):
        raise InvalidRules(f"{where}: name must be the full name of a service, got {name!r}")
    if isinstance(timeout_s, bool) or not isinstance(timeout_s, int | float) or not 0 < timeout_s <= _DAY_S:
        raise InvalidRules(
            f"{where}: timeout_s must be greater than 0, and at most {_DAY_S}, got {timeout_s!r}"
        )
    return {name: float(timeout_s)}


def _filter(values: Any, where: str) -> RuleFilter:
    lists = _mapping(values, where, {"allow", "deny"})
    allow, deny = (_list(lists.get(key), f"{where}: {key}") for key in ("allow", "deny"))
    for pattern in (*allow, *deny):
        if not isinstance(pattern, str) or pattern[:1] not in ("/", "*"):
            raise InvalidRules(f"{where}: a pattern must begin with / or *, got {pattern!r}")
    return RuleFilter(tuple(allow), tuple(deny))


def _static(values: Any, where: str) -> StaticRule:
    keys = {"ros1", "ros2", "direction", "ros1_type", "ros2_type", "rate", "qos"}
    rule = _mapping(values, where, keys)
    ros1 = str(rule.get("ros1") or rule.get("ros2") or "")
    ros2 = str(rule.get("ros2") or ros1)
    if not ros1.startswith("/") or not is_legal_topic(ros1):
        raise InvalidRules(f"{where}: ros1 (default: ros2) must be a full topic name, got [{ros1}]")
    try:
        checked_name(ros2)
    except ValueError as error:
        raise InvalidRules(f"{where}: {error}") from None
    word = rule.get("direction", "both")
    directions = (
        frozenset(Direction) if word == "both" else frozenset((_choice(Direction, word, where, "both"),))
    )
    rate = rule.get("rate", math.inf)
    if isinstance(rate, bool) or not isinstance(rate, int | float) or not rate > 0:
        raise InvalidRules(f"{where}: rate must be a number greater than zero, got {rate!r}")
    return StaticRule(
        ros1,
        ros2,
        directions,
        str(rule.get("ros1_type") or ""),
        str(rule.get("ros2_type") or ""),
        float(rate),
        _override(rule.get("qos"), f"{where}: qos"),
    )


def _override(values: Any, where: str) -> QosOverride:
    qos = _mapping(values, where, {each.name for each in fields(QosOverride)})
    depth = qos.get("depth")
    if depth is not None and (isinstance(depth, bool) or not isinstance(depth, int) or depth < 0):
        raise InvalidRules(f"{where}: depth must be a whole number >= 0, got {depth!r}")
    reliability, durability = qos.get("reliability"), qos.get("durability")
    return QosOverride(
        None if reliability is None else _choice(Reliability, reliability, where),
        None if durability is None else _choice(Durability, durability, where),
        depth,
    )


def _choice(choices: type[_Choice], word: Any, where: str, *others: str) -> _Choice:
    for each in choices:
        if each.value == word:
            return each
    known = ", ".join((*(each.value for each in choices), *others))
    raise InvalidRules(f"{where}: expected one of {known}, got {word!r}")


def _mapping(values: Any, where: str, keys: set[str]) -> Mapping[str, Any]:
    if values is None:
        return {}
    if not isinstance(values, dict):
        raise InvalidRules(f"{where}: expected a mapping, got {type(values).__name__}")
    unknown = sorted(str(key) for key in values.keys() - keys)
    if unknown:
        raise InvalidRules(f"{where}: unknown key {unknown[0]}; the keys are {', '.join(sorted(keys))}")
    return values


def _list(values: Any, where: str) -> Sequence[Any]:
    if values is None:
        return ()
    if not isinstance(values, list):
        raise InvalidRules(f"{where}: expected a list, got {type(values).__name__}")
    return values
