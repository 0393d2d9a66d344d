"""Rules that determine which ROS 1 and ROS 2 types correspond, and which of their fields.

The rules are those of ros1_bridge, and its YAML files can be used unchanged
(https://github.com/ros2/ros1_bridge/blob/master/doc/index.rst):

- a package `X_msgs` corresponds to `X_msgs` or `X_interfaces`, any other package to the one of the same name;
- types correspond to types of the same name, and fields to fields of the same name; the case of field names
  is ignored;
- rules declare further corresponding packages, types or fields. A rule that lists fields must list
  all of them.

ros1_bridge does not support actions; here, rules declare them with the keys `ros1_action_name`,
`ros2_action_name`, `goal_fields_1_to_2`, `result_fields_1_to_2` and `feedback_fields_1_to_2`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pipros.safe.yaml import YamlError, load
from pipros_rosbag2.conversion.errors import InvalidRules
from pipros_rosbag2.interfaces.derive import type_name_of

Fields = Mapping[str, str]
"""Maps ROS 1 fields to ROS 2 fields, as dotted paths."""


@dataclass(frozen=True, slots=True)
class MessageRule:
    """Two corresponding message types (`std_msgs/String`, `std_msgs/msg/String`).

    Attributes:
        fields: all corresponding fields; None to match fields by name.
    """

    ros1: str
    ros2: str
    fields: Fields | None = None


@dataclass(frozen=True, slots=True)
class ServiceRule:
    """A ROS 1 service type and the corresponding ROS 2 service type."""

    ros1: str
    ros2: str
    request: Fields | None = None
    response: Fields | None = None


@dataclass(frozen=True, slots=True)
class ActionRule:
    """Two corresponding actions (`nav_msgs/GetMap`, `nav2_msgs/action/GetMap`)."""

    ros1: str
    ros2: str
    goal: Fields | None = None
    result: Fields | None = None
    feedback: Fields | None = None


@dataclass(frozen=True, slots=True)
class MappingRules:
    """Rules in the order in which they were given; the first that matches a type applies.

    Attributes:
        packages: pairs of packages whose types correspond by name.
    """

    messages: tuple[MessageRule, ...] = ()
    services: tuple[ServiceRule, ...] = ()
    packages: tuple[tuple[str, str], ...] = ()
    actions: tuple[ActionRule, ...] = ()

    def message(self, ros1: str = "", ros2: str = "") -> MessageRule | None:
        """Return the first rule for a ROS 1 type, a ROS 2 type, or a pair of both."""
        return next((each for each in self.messages if _fits(each, ros1, ros2)), None)

    def service(self, ros1: str = "", ros2: str = "") -> ServiceRule | None:
        """Return the first rule for a service; see `message`."""
        return next((each for each in self.services if _fits(each, ros1, ros2)), None)

    def action(self, ros1: str = "", ros2: str = "") -> ActionRule | None:
        """Return the first rule for an action; see `message`."""
        return next((each for each in self.actions if _fits(each, ros1, ros2)), None)

    def actions_in_ros2(self, ros1: str, *, is_builtin: bool) -> list[str]:
        """Return the ROS 2 actions for a ROS 1 action, according to the built-in or the user's rules."""
        # compare by identity, because a user's rule may equal a built-in one
        builtin = {id(each) for each in BUILTIN_RULES.actions}
        rules = [each for each in self.actions if (id(each) in builtin) is is_builtin]
        return list(dict.fromkeys(each.ros2 for each in rules if each.ros1 == ros1))

    def candidates_in_ros2(self, ros1: str, middle: str = "msg") -> Iterator[str]:
        """Yield the ROS 2 types to try for a ROS 1 type without its own rule, most likely first."""
        package, _, name = ros1.partition("/")
        for other in [second for first, second in self.packages if first == package]:
            yield f"{other}/{middle}/{name}"
        yield f"{package}/{middle}/{name}"
        if (valid := type_name_of(ros1, middle)) != f"{package}/{middle}/{name}":
            yield valid
        if package.endswith("_msgs"):
            yield f"{package.removesuffix('_msgs')}_interfaces/{middle}/{name}"

    def candidates_in_ros1(self, ros2: str) -> Iterator[str]:
        """Yield the ROS 1 types to try for a ROS 2 type without its own rule."""
        package, _, name = ros2.split("/")
        for other in [first for first, second in self.packages if second == package]:
            yield f"{other}/{name}"
        yield f"{package}/{name}"
        if package.endswith("_interfaces"):
            yield f"{package.removesuffix('_interfaces')}_msgs/{name}"

    def and_then(self, others: MappingRules) -> MappingRules:
        """Return these rules, followed by `others`."""
        return MappingRules(
            self.messages + others.messages,
            self.services + others.services,
            self.packages + others.packages,
            self.actions + others.actions,
        )


BUILTIN_RULES = MappingRules(
    messages=(
        MessageRule("std_msgs/Time", "builtin_interfaces/msg/Time"),
        MessageRule("std_msgs/Duration", "builtin_interfaces/msg/Duration"),
        MessageRule(
            "rosgraph_msgs/Log",
            "rcl_interfaces/msg/Log",
            {
                "header.stamp": "stamp",
                "level": "level",
                "name": "name",
                "msg": "msg",
                "file": "file",
                "function": "function",
                "line": "line",
            },
        ),
    ),
    services=(
        ServiceRule("roscpp_tutorials/TwoInts", "example_interfaces/srv/AddTwoInts"),
        ServiceRule("rospy_tutorials/AddTwoInts", "example_interfaces/srv/AddTwoInts"),
    ),
    actions=(
        ActionRule("actionlib_tutorials/Fibonacci", "example_interfaces/action/Fibonacci"),
        ActionRule(
            "actionlib_tutorials/Fibonacci",
            "action_tutorials_interfaces/action/Fibonacci",
            feedback={"sequence": "partial_sequence"},
        ),
    ),
)
"""Built-in rules. The user's rules precede them."""

_PACKAGES = ("ros1_package_name", "ros2_package_name")
_KEYS = {
    *_PACKAGES,
    *(f"ros{side}_{kind}_name" for side in (1, 2) for kind in ("message", "service", "action")),
    "fields_1_to_2",
    *(f"{part}_fields_1_to_2" for part in ("request", "response", "goal", "result", "feedback")),
    "enable_foreign_mappings",
}


def parse_rules(text: str, file: str) -> MappingRules:
    """Parse a mapping file in ros1_bridge's format.

    Raises:
        InvalidRules: the file is malformed.
    """
    try:
        document = load(text, file, angles=False)
    except YamlError as error:
        raise InvalidRules(str(error)) from None
    if not isinstance(document or [], list):
        raise InvalidRules(f"{file}: the file must contain a list of rules")
    messages: list[MessageRule] = []
    services: list[ServiceRule] = []
    packages: list[tuple[str, str]] = []
    actions: list[ActionRule] = []
    for number, rule in enumerate(document or [], 1):
        _add(rule, f"{file}, rule {number}", messages, services, packages, actions)
    return MappingRules(tuple(messages), tuple(services), tuple(packages), tuple(actions))


def _add(
    rule: Any,
    where: str,
    messages: list[MessageRule],
    services: list[ServiceRule],
    packages: list[tuple[str, str]],
    actions: list[ActionRule],
) -> None:
    if not isinstance(rule, dict):
        raise InvalidRules(f"{where}: a rule must be a mapping, got {type(rule).__name__}")
    unknown = sorted(str(key) for key in rule.keys() - _KEYS)
    if unknown:
        raise InvalidRules(f"{where}: unknown key {unknown[0]}; the keys are {', '.join(sorted(_KEYS))}")
    first, second = (_text(rule, key, where) for key in _PACKAGES)
    kinds = [
        kind
        for kind in ("message", "service", "action")
        if f"ros1_{kind}_name" in rule or f"ros2_{kind}_name" in rule
    ]
    if not kinds:
        packages.append((first, second))
        return
    if len(kinds) > 1:
        raise InvalidRules(f"{where}: a rule must describe only one message, service or action")
    kind = kinds[0]
    ros1 = f"{first}/{_text(rule, f'ros1_{kind}_name', where)}"
    ros2_name = _text(rule, f"ros2_{kind}_name", where)
    if kind == "message":
        messages.append(MessageRule(ros1, f"{second}/msg/{ros2_name}", _fields(rule, "fields_1_to_2", where)))
    elif kind == "action":
        actions.append(
            ActionRule(
                ros1,
                f"{second}/action/{ros2_name}",
                _fields(rule, "goal_fields_1_to_2", where),
                _fields(rule, "result_fields_1_to_2", where),
                _fields(rule, "feedback_fields_1_to_2", where),
            )
        )
    else:
        services.append(
            ServiceRule(
                ros1,
                f"{second}/srv/{ros2_name}",
                _fields(rule, "request_fields_1_to_2", where),
                _fields(rule, "response_fields_1_to_2", where),
            )
        )


def _text(rule: Mapping[str, Any], key: str, where: str) -> str:
    value = rule.get(key)
    if not isinstance(value, str) or not value:
        raise InvalidRules(f"{where}: the required key {key} must be a non-empty string")
    return value


def _fields(rule: Mapping[str, Any], key: str, where: str) -> Fields | None:
    value = rule.get(key)
    if value is None:
        return None
    if not isinstance(value, dict) or not all(isinstance(each, str) for each in value.values()):
        raise InvalidRules(f"{where}: {key} must map field names to field names")
    return {str(first): second for first, second in value.items()}


def _fits(rule: MessageRule | ServiceRule | ActionRule, ros1: str, ros2: str) -> bool:
    return (not ros1 or rule.ros1 == ros1) and (not ros2 or rule.ros2 == ros2)


def merged(files: Sequence[MappingRules]) -> MappingRules:
    """Return the rules of several files, followed by `BUILTIN_RULES`."""
    rules = MappingRules()
    for each in files:
        rules = rules.and_then(each)
    return rules.and_then(BUILTIN_RULES)
