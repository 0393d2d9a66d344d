"""Decide whether a policy allows an act. Performs no I/O."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Final

from pipros.basics.printable import printable
from pipros.basics.similar_names import similar_names
from pipros.msg.base import Message
from pipros_server.policy.field_check import POLICY_VALUES, FieldCheck, check_changes, check_value
from pipros_server.policy.model import (
    RUNS,
    ActKind,
    ActRefused,
    ActRule,
    Condition,
    FieldRule,
    FieldTree,
    Policy,
)

MINUTE_S: Final = 60.0
PARAMETER_TYPES: Final = {"bool": bool, "int": int, "double": (int, float), "str": str}


@dataclass(frozen=True, slots=True)
class Act:
    """An act that a client requests, such as publishing a message.

    Attributes:
        name: the global name of the topic, service or parameter, after remapping; see `ActRule`.
        type, md5sum: the type and MD5 sum of the topic or service; empty for other acts.
        value: the message, the request, the parameter's value, or the arguments of a launch file.
    """

    kind: ActKind
    name: str
    value: Any
    type: str = ""
    md5sum: str = ""


@dataclass(slots=True)
class Accepted:
    """The acts that one rule has allowed so far.

    Attributes:
        times: the times of the acts within the last minute; only recorded if the rule has `per_minute`.
        last_s: the time of the last act.
        values: the last value of each field whose change is limited, by path. Values of array elements that
            later messages lack are kept.
    """

    times: deque[float] = field(default_factory=deque)
    last_s: float = -math.inf
    values: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Reading:
    """The last check of a condition. `reason` is empty if the message satisfied the condition."""

    received_s: float
    reason: str = ""


@dataclass(slots=True)
class PolicyState:
    """The state on which decisions depend in addition to the policy. All clients share it.

    Attributes:
        accepted: the allowed acts, by kind and name.
        readings: the last check of each condition.
    """

    accepted: dict[tuple[ActKind, str], Accepted] = field(default_factory=dict)
    readings: dict[str, Reading] = field(default_factory=dict)


def decide(policy: Policy, act: Act, state: PolicyState, now_s: float) -> ActRule:
    """Return the rule that allows an act, and record the act in `state`. `now_s` is a monotonic time.

    Raises:
        ActRefused: the policy does not allow the act, which is then not recorded.
    """
    rule = rule_for(policy, act.kind, act.name, act.type, act.md5sum)
    if rule.stop is not None and act.value == rule.stop:
        note_stop(rule, state)
        return rule
    limited = _check_value_of(act, rule)
    accepted = state.accepted.get((act.kind, act.name)) or Accepted()
    values = _changed_values(rule, limited, accepted, now_s - accepted.last_s)
    for name in rule.requires:
        check_condition(policy.conditions[name], state.readings.get(name), now_s)
    if rule.per_minute is not None:
        _count_in_minute(rule, rule.per_minute, accepted.times, now_s)
    accepted.last_s = now_s
    accepted.values = values
    state.accepted[act.kind, act.name] = accepted
    return rule


def rule_for(policy: Policy, kind: ActKind, name: str, type_name: str = "", md5sum: str = "") -> ActRule:
    """Return the rule for a name. Check that the type and the MD5 sum match the rule.

    Raises:
        ActRefused: no rule has this name, or the type or its definition differs.
    """
    rule = policy.rules.get((kind, name))
    if rule is None:
        hint = similar_names(name, [known for section, known in policy.rules if section is kind])
        shown = printable(ascii(name)[1:-1])  # escapes look-alike letters of other alphabets
        raise ActRefused(f"the policy has no rule for the {kind.value[:-1]} {shown}. {hint}".rstrip())
    if rule.type and kind is not ActKind.PARAMETER and (type_name, md5sum) != (rule.type, rule.md5sum):
        shown = printable(ascii(type_name)[1:-1])
        if type_name == rule.type:
            raise ActRefused(f"{name}: the definition of {shown} differs from the installed one", rule.place)
        raise ActRefused(f"{name} must have the type {rule.type}, got {shown}", rule.place)
    return rule


def _check_value_of(act: Act, rule: ActRule) -> Mapping[str, tuple[float, FieldRule]]:
    """Check the value of an act. Return the values whose change is limited, with their rules, by path."""
    if isinstance(act.value, Message):
        check = FieldCheck(act.name, rule.place)
        check.message(act.value, rule.fields)
        return check.limited
    if act.kind is ActKind.PARAMETER:
        _check_parameter(act, rule)
    elif act.kind in RUNS:
        _check_arguments(act, rule)
    else:
        raise ActRefused(f"{act.name} needs a message, got {type(act.value).__name__}", rule.place)
    return {}


def _changed_values(
    rule: ActRule, limited: Mapping[str, tuple[float, FieldRule]], accepted: Accepted, idle_s: float
) -> Mapping[str, float]:
    """Check the changes of values since the last act, `idle_s` ago. Return all values after the act."""
    before = accepted.values
    # `idle_s` is infinite before the first act: nothing was to be stopped.
    if rule.stop is not None and (rule.time_limit_s or math.inf) <= idle_s < math.inf:
        before = {**before, **stopped_values(rule)}  # by now, the guardian has sent the stop
    check_changes(limited, before, idle_s, rule.name)
    values = {**before, **{path: value for path, (value, _) in limited.items()}}
    if len(values) > (most := POLICY_VALUES):
        reason = f"{rule.name}: {len(values)} fields or elements with change_per_s would be stored"
        raise ActRefused(f"{reason}; the limit is {most}", rule.place)
    return values


def _count_in_minute(rule: ActRule, limit: int, times: deque[float], now_s: float) -> None:
    while times and times[0] <= now_s - MINUTE_S:
        times.popleft()
    if len(times) >= limit:
        raise ActRefused(f"{rule.name} exceeds the limit of {limit} per minute", rule.place)
    times.append(now_s)


def note_stop(rule: ActRule, state: PolicyState) -> None:
    """Record that a rule's stop was sent: the next values are compared with the values of the stop."""
    accepted = state.accepted.setdefault((rule.kind, rule.name), Accepted())
    accepted.values = {**accepted.values, **stopped_values(rule)}


def stopped_values(rule: ActRule) -> Mapping[str, float]:
    """Return the values that the rule's stop sets in the fields whose change is limited."""
    check = FieldCheck(rule.name, rule.place)
    with suppress(ActRefused):  # the stop may be outside the ranges
        check.message(rule.stop, rule.fields)
    return {path: value for path, (value, _) in check.limited.items()}


def check_condition(condition: Condition, reading: Reading | None, now_s: float) -> None:
    """Raise `ActRefused` if a condition does not hold, given the last message."""
    what = f"the condition {condition.name} does not hold"
    if reading is None:
        raise ActRefused(f"{what}: no message on {condition.topic} yet", condition.place)
    age_s = now_s - reading.received_s
    if not 0 <= age_s <= condition.max_age_s:
        raise ActRefused(
            f"{what}: the last message on {condition.topic} is {age_s:.1f} s old, "
            f"at most {condition.max_age_s:g} s are allowed",
            condition.place,
        )
    if reading.reason:
        refused = ActRefused(f"{what}: {reading.reason}")  # the reason names the place of the value's rule
        refused.place = condition.place
        raise refused


def read_condition(condition: Condition, message: Any, now_s: float) -> Reading:
    """Check whether a message satisfies a condition."""
    value = message
    for step in condition.path:
        try:
            value = value[step] if isinstance(step, int) else getattr(value, step)
        except (AttributeError, IndexError):
            return Reading(now_s, f"the message on {condition.topic} has no {step} ({condition.place})")
    if not condition.path:
        return Reading(now_s)
    try:
        check_value(value, condition.rule, f"the value on {condition.topic}")
    except ActRefused as error:
        return Reading(now_s, str(error))
    return Reading(now_s)


def _check_parameter(act: Act, rule: ActRule) -> None:
    wanted: Any = PARAMETER_TYPES[rule.type]
    if not isinstance(act.value, wanted) or (isinstance(act.value, bool) and rule.type != "bool"):
        got = printable(ascii(act.value), 60)
        raise ActRefused(f"{act.name} must have the type {rule.type}, got {got}", rule.place)
    if rule.fields.rule is not None:
        check_value(act.value, rule.fields.rule, act.name)


def _check_arguments(act: Act, rule: ActRule) -> None:
    for name, value in act.value.items():
        argument = rule.fields.below.get(name, FieldTree()).rule
        if argument is None:
            raise ActRefused(
                f"the policy has no rule for the argument {name!a:.60} of {act.name}", rule.place
            )
        check_value(value, argument, f"{name} of {act.name}")
