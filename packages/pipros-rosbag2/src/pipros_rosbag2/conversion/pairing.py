"""Pairs of corresponding messages and fields, from which a conversion is generated."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from pipros.basics.errors import NotFound
from pipros.msg.language.digest import Lookup, complete
from pipros.msg.language.spec import DefinitionError, Field, FieldType, MessageSpec, ServiceSpec
from pipros_rosbag2.conversion.errors import NotConvertible
from pipros_rosbag2.conversion.mapping import Fields, MappingRules
from pipros_rosbag2.conversion.values import WHOLE_MESSAGES
from pipros_rosbag2.interfaces.action_types import Ros2Action
from pipros_rosbag2.interfaces.catalog import Catalog
from pipros_rosbag2.interfaces.derive import member_name
from pipros_rosbag2.interfaces.spec import NO_FIELDS, Ros2Field, Ros2Message, Ros2Type

_STATUS = "_status"
"""Name of the status field in result pairs. Field names in definitions cannot begin with `_`."""

_RENAMED = {
    "tf/tfMessage": "tf2_msgs/TFMessage",
    "roslib/Clock": "rosgraph_msgs/Clock",
    "roslib/Header": "std_msgs/Header",
    "roslib/Log": "rosgraph_msgs/Log",
}
"""Later names of messages in old bags."""

Path = tuple[str, ...]
"""The name of a field, or the names that lead to a field of an embedded message."""


@dataclass(frozen=True, slots=True)
class FieldPair:
    """A ROS 1 field and the corresponding ROS 2 field."""

    ros1: Path
    ros2: Path


@dataclass(frozen=True, slots=True)
class Pair:
    """A pair of corresponding messages, and the links between their fields."""

    ros1: MessageSpec
    ros2: Ros2Message
    links: tuple[FieldPair, ...]

    @property
    def only_ros1(self) -> tuple[str, ...]:
        """The fields that a conversion to ROS 2 drops, and that a conversion to ROS 1 fills with defaults."""
        linked = {link.ros1[0] for link in self.links}
        return tuple(field.name for field in self.ros1.fields if field.name not in linked)

    @property
    def only_ros2(self) -> tuple[str, ...]:
        """The fields that a conversion to ROS 1 drops, and that a conversion to ROS 2 fills with defaults."""
        linked = {link.ros2[0] for link in self.links}
        return tuple(
            field.name for field in self.ros2.fields if field.name not in linked and field != NO_FIELDS
        )


class Pairing:
    """Finds corresponding types, and pairs of corresponding messages.

    Args:
        lookup: the ROS 1 definitions.
        rules: the user's rules, followed by the built-in rules; see `mapping.merged`.
    """

    def __init__(self, lookup: Lookup, catalog: Catalog, rules: MappingRules) -> None:
        self.lookup = lookup
        self.catalog = catalog
        self._rules = rules

    def ros2_type(self, ros1: str) -> str:
        """Return the ROS 2 type for a ROS 1 message.

        Raises:
            NotConvertible: there is no corresponding ROS 2 type.
        """
        rule = self._rules.message(ros1=ros1) or self._rules.message(ros1=self._current(ros1))
        if rule is not None:
            return rule.ros2
        candidates = self._rules.candidates_in_ros2(self._current(ros1))
        return _first(ros1, candidates, self.catalog.has_message, self.catalog)

    def ros1_type(self, ros2: str) -> str:
        """Return the ROS 1 type for a ROS 2 message. Raises the same errors as `ros2_type`."""
        rule = self._rules.message(ros2=ros2)
        if rule is not None:
            return rule.ros1
        return _first(ros2, self._rules.candidates_in_ros1(ros2), self._has_ros1, None)

    def ros2_service(self, ros1: str) -> str:
        """Return the ROS 2 service for a ROS 1 service. Raises the same errors as `ros2_type`."""
        rule = self._rules.service(ros1=ros1)
        if rule is not None:
            return rule.ros2
        return _first(
            ros1, self._rules.candidates_in_ros2(ros1, "srv"), self.catalog.has_service, self.catalog
        )

    def ros1_service(self, ros2: str, lookup: Callable[[str], object]) -> str:
        """Return the ROS 1 service for a ROS 2 service. Raises the same errors as `ros2_type`."""
        rule = self._rules.service(ros2=ros2)
        if rule is not None:
            return rule.ros1
        return _first(ros2, self._rules.candidates_in_ros1(ros2), lambda name: _exists(lookup, name), None)

    def message(self, ros1: MessageSpec, ros2: Ros2Message) -> Pair:
        """Pair two messages, and link their fields.

        Raises:
            NotConvertible: each side has fields that the other lacks, and no rule maps them.
        """
        kind = WHOLE_MESSAGES.get(ros1.type)
        if kind is not None and kind is WHOLE_MESSAGES.get(ros2.type):
            links = tuple(FieldPair((ros1.fields[0].name,), (field.name,)) for field in ros2.fields)
            return Pair(ros1, ros2, links)
        rule = self._rules.message(ros1.type, ros2.type)
        rule = rule or self._rules.message(self._current(ros1.type), ros2.type)
        return _pair(ros1, ros2, None if rule is None else rule.fields)

    def service(self, ros1: ServiceSpec, ros2_type: str) -> tuple[Pair, Pair]:
        """Return the request pair and the response pair. Raises the same errors as `message`."""
        ros2 = self.catalog.service(ros2_type)
        rule = self._rules.service(ros1.type, ros2_type)
        request = _pair(ros1.request, ros2.request, None if rule is None else rule.request)
        return request, _pair(ros1.response, ros2.response, None if rule is None else rule.response)

    def ros2_action(self, ros1: str) -> str:
        """Return the ROS 2 action for a ROS 1 action. Raises the same errors as `ros2_type`."""
        rule = self._rules.action(ros1=ros1)
        if rule is not None:
            return rule.ros2
        candidates = self._rules.candidates_in_ros2(ros1, "action")
        return _first(ros1, candidates, self.catalog.has_action, self.catalog)

    def ros2_actions(self, ros1: str) -> list[str]:
        """Return all ROS 2 actions for a ROS 1 action. The user's rules replace the built-in ones.

        Raises the same errors as `ros2_type`.
        """
        names = self._rules.actions_in_ros2(ros1, is_builtin=False) or [
            each
            for each in self._rules.actions_in_ros2(ros1, is_builtin=True)
            if self.catalog.has_action(each)  # some distributions lack the package
        ]
        return names or [self.ros2_action(ros1)]

    def ros1_action(self, ros2: str) -> str:
        """Return the ROS 1 action for a ROS 2 action. Raises the same errors as `ros2_type`."""
        rule = self._rules.action(ros2=ros2)
        if rule is not None:
            return rule.ros1
        return _first(
            ros2, self._rules.candidates_in_ros1(ros2), lambda name: self._has_ros1(f"{name}Goal"), None
        )

    def action(self, ros1: str, ros2: Ros2Action) -> tuple[Pair, Pair, Pair]:
        """Return the goal, result and feedback pairs.

        The messages of the result pair begin with the goal's status (int8), which precedes the result in
        ROS 2 and determines its alignment. Raises the same errors as `message`, and NotFound.
        """
        rule = self._rules.action(ros1, ros2.type)
        goal, result, feedback = (self.lookup(f"{ros1}{part}") for part in ("Goal", "Result", "Feedback"))
        fields = None if rule is None or rule.result is None else {_STATUS: _STATUS, **rule.result}
        return (
            _pair(goal, ros2.goal, None if rule is None else rule.goal),
            _pair(
                replace(result, fields=(Field(FieldType("int8"), _STATUS), *result.fields)),
                replace(ros2.result, fields=(Ros2Field(Ros2Type("int8"), _STATUS), *ros2.result.fields)),
                fields,
            ),
            _pair(feedback, ros2.feedback, None if rule is None else rule.feedback),
        )

    def _current(self, ros1: str) -> str:
        """Return the later name of a message that was renamed, if its definition is the same."""
        later = _RENAMED.get(ros1)
        if later is None:
            return ros1
        try:
            old, new = (complete(self.lookup(name), self.lookup).md5() for name in (ros1, later))
        except (NotFound, DefinitionError):
            return ros1
        return later if old == new else ros1

    def _has_ros1(self, name: str) -> bool:
        return _exists(self.lookup, name)


def _exists(lookup: Callable[[str], object], name: str) -> bool:
    try:
        lookup(name)
    except NotFound:
        return False
    return True


def _first(
    name: str, candidates: Iterator[str], exists: Callable[[str], bool], catalog: Catalog | None
) -> str:
    tried = list(candidates)
    for each in sorted(tried, key=catalog.is_derived) if catalog else tried:
        if exists(each):
            return each
    where = f"ROS 2 {catalog.distribution.value}" if catalog else "ROS 1"
    raise NotConvertible(f"no type in {where} corresponds to {name}: tried {', '.join(tried)}")


def _pair(ros1: MessageSpec, ros2: Ros2Message, fields: Fields | None) -> Pair:
    if fields is not None:
        links = tuple(FieldPair(tuple(a.split(".")), tuple(b.split("."))) for a, b in fields.items())
        return Pair(ros1, ros2, links)
    theirs = {field.name for field in ros2.fields}
    ours = {field.name: field.name for field in ros1.fields if field.type.length != 0}
    renamed = {member_name(name): name for name in ours if name not in theirs}
    matches = [(ours.get(each.name) or renamed.get(each.name), each.name) for each in ros2.fields]
    links = tuple(FieldPair((first,), (second,)) for first, second in matches if first is not None)
    made = Pair(ros1, ros2, links)
    if made.only_ros1 and made.only_ros2:
        raise NotConvertible(
            f"{ros1.type} and {ros2.type} need a rule: only ROS 1 has {', '.join(made.only_ros1)}, "
            f"only ROS 2 has {', '.join(made.only_ros2)}"
        )
    return made
