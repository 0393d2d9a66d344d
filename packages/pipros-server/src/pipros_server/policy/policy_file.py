"""Read the YAML file of a policy (docs/guides/policy.md), with errors that name file, line and key."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from pipros.basics import names
from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_text
from pipros.msg import load_message_class, load_service_class
from pipros.msg.from_yaml import fill_message_args
from pipros.msg.language.spec import TIMES
from pipros.safe.settings import BadSettings, Settings
from pipros.safe.yaml import YamlError
from pipros_server.policy.decisions import PARAMETER_TYPES
from pipros_server.policy.field_check import FieldCheck, is_finite
from pipros_server.policy.field_file import (
    BOUNDS,
    NUMERIC,
    ORDERED,
    PLAIN,
    field_path,
    place_of,
    read_fields,
    read_rule,
    whole,
)
from pipros_server.policy.model import (
    EACH,
    RUNS,
    ActKind,
    ActRefused,
    ActRule,
    Condition,
    FieldRule,
    FieldTree,
    Policy,
)

POLICY_FILE_BYTES = 256 * 1024
"""Limit: a policy file; this also limits the number of its rules. Beyond it, the command ends with an error;
this also limits the number of rules.
"""
POLICY_STOP_BYTES = 1024
"""Limit: a message or service request with which a policy stops the robot. Beyond it, the command ends with
an error that names the line; the process that stops the robot could not receive a larger message in one
piece.
"""

_LIMITS = ("per_minute", "requires")
_MESSAGE_KEYS = ("type", "fields", "stop", "time_limit_s", *_LIMITS)
_KEYS = {
    ActKind.TOPIC: _MESSAGE_KEYS,
    ActKind.SERVICE: _MESSAGE_KEYS,
    ActKind.PARAMETER: ("type", *BOUNDS, *_LIMITS),
    ActKind.LAUNCH: ("args", "time_limit_s", *_LIMITS),
    ActKind.RECORD: ("time_limit_s", *_LIMITS),
}
_LAUNCH_FILE = re.compile(r"[A-Za-z][\w-]*(/[\w-][\w.-]*){1,99}\.launch", re.ASCII)


def read_policy(path: str | os.PathLike[str]) -> Policy:
    """Read a policy.

    Raises:
        BadSettings: the file cannot be read, or is malformed; the text names the file, the line and the key.
    """
    try:
        return parse_policy(read_text(path, POLICY_FILE_BYTES), os.fspath(path))
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise BadSettings(f"cannot read {os.fspath(path)}: {reason}") from None


def parse_policy(text: str, file: str) -> Policy:
    """Parse the text of a policy. Raises the same errors as `read_policy`."""
    try:
        top = Settings.parsed(text, file)
    except YamlError as error:
        raise BadSettings(str(error)) from None
    return _PolicyReader(top, file).policy(text)


class _PolicyReader:
    """Reader for one policy file."""

    def __init__(self, top: Settings, file: str) -> None:
        self._top, self._file = top, file

    def policy(self, text: str) -> Policy:
        self._top.only([*(kind.value for kind in ActKind), "actions", "conditions"])
        conditions = {each.name: each for each in read_conditions(self._top)}
        rules: dict[tuple[ActKind, str], ActRule] = {}
        actions = self._top.section("actions")
        for key in self._names(actions):
            for rule in self._action(actions.section(key), key, conditions):
                rules[rule.kind, rule.name] = rule
        for kind in ActKind:
            section = self._top.section(kind.value)
            for key in self._names(section):
                if (kind, key) in rules:
                    raise section.error(key, "is a topic of an action in this policy. Remove one of the two")
                rules[kind, key] = self._act(section.section(key), kind, key, conditions)
        for rule in rules.values():
            if rule.halt is not None:
                topic, message, _ = rule.halt
                commanded = rules.get((ActKind.TOPIC, topic))
                if commanded is not None and commanded.type == message._type:
                    goals = actions.section(rule.name.removesuffix("/goal"))
                    _check_stop(goals, message, topic, commanded.fields)
        if not rules:
            raise self._top.error("", "must have at least one rule, such as one in the section topics")
        for condition in conditions.values():
            if (ActKind.TOPIC, condition.topic) in rules:
                raise self._top.section("conditions").error(
                    condition.name,
                    f"reads {condition.topic}, which clients may publish. Remove one of the two",
                )
        types = {key: actions.section(key).text("type") for key in actions.values}
        return Policy(self._file, text, rules, conditions, types)

    def _names(self, section: Settings) -> Iterator[str]:
        for key in section.values:
            if section.key == ActKind.LAUNCH.value:
                if not _LAUNCH_FILE.fullmatch(str(key)):
                    raise section.error(str(key), "must be PACKAGE/FILE.launch, such as my_robot/base.launch")
            elif not isinstance(key, str) or not names.is_legal_topic(key) or not names.is_global(key):
                raise section.error(str(key), "must be a legal global name, such as /cmd_vel")
            elif names.canonicalize(key) != key:
                raise section.error(key, f"must be written as {names.canonicalize(key)}")
            if not isinstance(section.values[key], dict):
                raise section.error(key, "must be a mapping")
            yield key

    # -- acts -----------------------------------------------------------------------------

    def _act(self, section: Settings, kind: ActKind, name: str, known: Mapping[str, Condition]) -> ActRule:
        section.only(_KEYS[kind])
        common = {
            "place": place_of(section),
            "kind": kind,
            "name": name,
            "time_limit_s": _time_limit(section),
            **self._limits(section, known),
        }
        if kind is ActKind.PARAMETER:
            type_name = section.choice("type", PARAMETER_TYPES, "")
            rule = read_rule(section, is_number=type_name in ("int", "double"), kind=type_name)
            if type_name in ("bool", "str") and not any(each in section.values for each in VALUES):
                rule = FieldRule(place=rule.place, is_any=True)
            return ActRule(type=type_name, fields=FieldTree(rule), **common)
        if kind in RUNS:
            if common["time_limit_s"] is None:
                raise section.error("time_limit_s", "is missing")
            args = section.section("args")
            tree = FieldTree(below={each: _argument(args, each) for each in args.values})
            return ActRule(fields=tree, **common)
        loaded = self._load(section, kind)
        message_class = loaded if kind is ActKind.TOPIC else loaded._request_class
        fields, stop = read_fields(section, message_class), _stop(section, message_class)
        if stop is not None:
            _check_stop(section, stop, name, fields)
        return ActRule(
            type=loaded._type,
            message_class=message_class,
            md5sum=loaded._md5sum,
            fields=fields,
            stop=stop,
            **common,
        )

    def _action(self, section: Settings, name: str, conditions: Mapping[str, Condition]) -> Iterator[ActRule]:
        """Yield the rules for an action's goal and cancel topics. The key `fields` applies to the goal."""
        section.only(_MESSAGE_KEYS)
        type_name = section.text("type")
        if not type_name.endswith("Action"):
            raise section.error(
                "type",
                f"must be the type of an action, such as move_base_msgs/MoveBaseAction, got {type_name!r}",
            )
        goal_class = loaded_message(section, f"{type_name}Goal")
        parts = dict(zip(goal_class.__slots__, goal_class._slot_types, strict=True))
        if "goal" not in parts:
            raise section.error("type", f"{goal_class._type} is not the goal type of an action")
        below = read_fields(section, loaded_message(section, parts["goal"]))
        place = place_of(section)
        free = FieldTree(FieldRule(place=place, is_any=True))
        tree = FieldTree(below={"header": free, "goal_id": free, "goal": below})
        cancel: Any = load_message_class("actionlib_msgs/GoalID")
        yield ActRule(
            place=place,
            kind=ActKind.TOPIC,
            name=f"{name}/goal",
            type=goal_class._type,
            message_class=goal_class,
            md5sum=goal_class._md5sum,
            fields=tree,
            time_limit_s=_time_limit(section),
            cancel=cancel(),
            halt=self._halt(section, type_name),
            **self._limits(section, conditions),
        )
        yield ActRule(
            place=place,
            kind=ActKind.TOPIC,
            name=f"{name}/cancel",
            type=cancel._type,
            message_class=cancel,
            md5sum=cancel._md5sum,
            fields=free,
        )

    def _halt(self, section: Settings, action: str) -> tuple[str, Any, str] | None:
        """Return the topic that stops the robot when no goal is left; the guardian needs a time limit."""
        if "stop" not in section.values:
            return None
        if "time_limit_s" not in section.values:
            raise section.error("stop", "needs the key time_limit_s")
        stop = section.section("stop")
        stop.only(("topic", "type", "values"))
        topic = stop.text("topic")
        if not (names.is_legal_topic(topic) and names.is_global(topic)) or names.canonicalize(topic) != topic:
            raise stop.error("topic", f"must be a legal global name, such as /cmd_vel, got {topic!r}")
        values = stop.values.get("values", "zero")
        return (
            topic,
            _message(stop, "values", values, loaded_message(stop, stop.text("type"))),
            f"{action}Result",
        )

    def _limits(self, section: Settings, conditions: Mapping[str, Condition]) -> dict[str, Any]:
        """Return the limits that all kinds of acts have, by the names of `ActRule`."""
        requires = section.texts("requires")
        for each in requires:
            if each not in conditions:
                raise section.error("requires", f"names {each}, which is not one of the conditions")
        per_minute = whole(section, "per_minute", 60_000) if "per_minute" in section.values else None
        return {"per_minute": per_minute, "requires": requires}

    def _load(self, section: Settings, kind: ActKind) -> Any:
        if kind is ActKind.TOPIC:
            return loaded_message(section, section.text("type"))
        try:
            return load_service_class(section.text("type"))
        except PiprosError as error:
            raise section.error("type", str(error)) from None


def _stop(section: Settings, message_class: object) -> Any:
    """Return the message or request that stops the robot; None if no stop is needed.

    With a time limit, a stop is needed, and defaults to a message of zeros.
    """
    value = section.values.get("stop", "zero" if "time_limit_s" in section.values else None)
    if (value != "zero" if "stop" in section.values else value not in (None, "zero")) and not isinstance(
        value, dict
    ):
        raise section.error("stop", f"must be zero, or the values of a message, got {value!r}")
    message = _message(section, "stop", value, message_class)
    if value is not None and not message.__slots__:
        raise section.error("stop", f"must differ from other messages, but {message._type} has no fields")
    return None if value is None else message


def _check_stop(section: Settings, stop: Any, name: str, fields: FieldTree) -> None:
    """Refuse a stop that moves the robot faster than clients may."""
    try:
        FieldCheck(name, "", is_stop=True).message(stop, fields)
    except ActRefused as error:
        raise section.error("stop", str(error)) from None


def _message(section: Settings, key: str, value: Any, message_class: Any) -> Any:
    """Return a message of zeros, or with the given values."""
    message = message_class()
    try:
        fill_message_args(message, [value if isinstance(value, dict) else {}])
        size = sum(map(len, message._to_buffers()))
    except (PiprosError, ValueError, TypeError) as error:
        raise section.error(key, " ".join(str(error).split())) from None
    if not is_finite(message):
        raise section.error(key, "must contain finite numbers")
    if size > (most := POLICY_STOP_BYTES):
        raise section.error(key, f"must have at most {most} bytes, got {size}")
    return message


def _time_limit(section: Settings) -> float | None:
    has_limit = "time_limit_s" in section.values
    return section.number("time_limit_s", None, least=0.1, most=3600) if has_limit else None


def _argument(args: Settings, name: str) -> FieldTree:
    """Return the rule for a launch file's argument. The rule must have a range or a list of values."""
    spec = args.section(name)
    spec.only(BOUNDS)
    return FieldTree(read_rule(spec, is_number=not spec.values.keys().isdisjoint(NUMERIC)))


_SIDES = ("above", "below")  # bounds of conditions only
VALUES = tuple(each for each in BOUNDS if each != "unit")
_CONDITIONS = (*_SIDES, *VALUES)


def read_conditions(top: Settings) -> Iterator[Condition]:
    """Read the section `conditions`. Raise `BadSettings` for an invalid value."""
    yield from map(_condition, top.section("conditions").sections())


def _condition(section: Settings) -> Condition:
    section.only(("topic", "type", "field", "max_age_s", *BOUNDS, *_SIDES))
    topic = section.text("topic")
    is_global = names.is_legal_topic(topic) and names.is_global(topic)
    if not is_global or names.canonicalize(topic) != topic:
        raise section.error("topic", f"must be a legal global name, such as /battery, got {topic!r}")
    message_class = loaded_message(section, section.text("type"))
    path: tuple[str | int, ...] = ()
    kind = "string"
    bounds = [key for key in _CONDITIONS if key in section.values]
    if len(bounds) > 1:
        raise section.error(bounds[1], f"must not be combined with {bounds[0]}")
    if "field" in section.values:
        path, kind = _plain_field(section, message_class)
        if not bounds:
            choices = f"{', '.join(_CONDITIONS[:-1])} or {_CONDITIONS[-1]}"
            raise section.error("", f"must have {choices} for its field")
    elif bounds:
        raise section.error(bounds[0], "needs the key field")
    rule = read_rule(section, is_number=kind in ORDERED or not path, kind=kind)
    if any(key in section.values for key in _SIDES):
        rule = _with_sides(rule, section, kind)
    name = section.key.rpartition(".")[2]
    age_s = section.number("max_age_s", None, least=0.01)
    return Condition(place_of(section), name, topic, message_class, path, rule, age_s)


def _plain_field(section: Settings, message_class: Any) -> tuple[tuple[str | int, ...], str]:
    """Return the path and the type of a condition's field, which must be one value, and not a time."""
    path, kind = field_path(section, section.text("field"), message_class, "field")
    if (kind not in ORDERED and kind not in PLAIN) or EACH in path:
        raise section.error("field", "must name one number, string or boolean, such as buttons[4]")
    if kind in TIMES:
        raise section.error("field", "must not be a time; max_age_s limits the age of messages")
    return path, kind


def _with_sides(rule: FieldRule, section: Settings, kind: str) -> FieldRule:
    """Return the rule with the bounds `above` and `below`, of which the section has at least one."""
    if kind not in ORDERED:
        raise section.error("field", f"must be a number, got the type {kind}")
    least, most = (
        section.number(key, end, least=-math.inf) * rule.unit.factor if key in section.values else end
        for key, end in (("above", -math.inf), ("below", math.inf))
    )
    return replace(rule, least=least, most=most)


def loaded_message(section: Settings, type_name: str) -> Any:
    """Return the class of a message type. Raise `BadSettings` if the type is unknown."""
    try:
        return load_message_class(type_name)
    except PiprosError as error:
        raise section.error("type", str(error)) from None
