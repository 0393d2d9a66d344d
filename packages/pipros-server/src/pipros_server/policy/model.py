"""The parts of a policy. `policy_file.py` reads them from a file, `decisions.py` applies them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Final

from pipros.basics.errors import PiprosError

EACH: Final = "[]"
"""The key of a `FieldTree` for all elements of an array that have no entry for their index."""


class ActRefused(PiprosError):
    """A policy does not allow an act. The text names the value and the rule.

    Attributes:
        place: the file, line and key of the rule; empty if there is no rule.
    """

    def __init__(self, reason: str, place: str = "") -> None:
        self.place = place
        super().__init__(f"{reason} ({place})" if place else reason)


class ActKind(Enum):
    """Kind of act. The values are the names of the sections in the file."""

    TOPIC = "topics"
    SERVICE = "services"
    PARAMETER = "parameters"
    LAUNCH = "launch_files"
    RECORD = "recordings"


RUNS: Final = (ActKind.LAUNCH, ActKind.RECORD)  # acts that start a program with a time limit


@dataclass(frozen=True, slots=True)
class Unit:
    """The unit of a field. The value in a message is `factor` times the number in the file (REP 103)."""

    text: str = ""
    factor: float = 1.0

    def shown(self, value: float) -> str:
        """Format a message's value in this unit.

        >>> Unit("deg", math.pi / 180).shown(math.pi)
        '180 deg'
        """
        return f"{value / self.factor:g} {self.text}".rstrip()


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldRule:
    """The permitted values of a field, in the units of the message.

    Attributes:
        place: the file's name, without its folder, and the line and key.
        is_any: whether all values are permitted. If so, no other attribute except `place` is set.
        least, most: the range, inclusive; infinite if there is no range.
        one_of: the permitted values; empty if any value in the range is permitted.
        unit: the unit used in texts.
        change_per_s: maximum change per second since the previous permitted message; a pause of more than a
            second counts as one second. None for no limit.
        start: the assumed value before the first message.
        count: maximum number of elements, in a rule for all elements of an array; None for no limit.
    """

    place: str
    is_any: bool = False
    least: float = -math.inf
    most: float = math.inf
    one_of: tuple[Any, ...] = ()
    unit: Unit = field(default_factory=Unit)
    change_per_s: float | None = None
    start: float = 0.0
    count: int | None = None

    @property
    def has_range(self) -> bool:
        return math.isfinite(self.least) or math.isfinite(self.most)

    @property
    def shown_range(self) -> str:
        """The range as text: `from -0.3 to 0.3 m/s`."""
        return f"from {self.least / self.unit.factor:g} to {self.unit.shown(self.most)}"


@dataclass(frozen=True, slots=True)
class FieldTree:
    """The rules of a field and of the fields below it, by name, index or `EACH`."""

    rule: FieldRule | None = None
    below: Mapping[str | int, FieldTree] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class ActRule:
    """What clients may do with one topic, service, parameter or launch file, or with recordings of a topic.

    Attributes:
        place: the file's name, without its folder, and the line and key.
        kind, name: the kind of act, and the global name or, for a launch file, `PACKAGE/FILE`.
        type: type of the topic or service, or of the parameter's value; empty for other acts.
        message_class: class of the messages or requests; None for other acts.
        md5sum: MD5 sum of the topic's or service's type; empty for other acts.
        fields: rules for the values; fields without a rule must have their defaults.
        per_minute: maximum number of acts within any 60 s; None for no limit.
        requires: names of conditions that must hold.
        stop: a message or request that is always allowed, because it stops what the topic or service moves;
            None if there is none.
        time_limit_s: the stop is sent this long after the last message, or after a call started or, if the
            call ends within this time, after its end. A goal is cancelled this long after it was sent, and a
            program is ended this long after its start. None for no limit.
        cancel: an empty message for the action's cancel topic, in a rule for goals; otherwise None.
        halt: in a rule for goals, the topic and the message that stop the robot when no goal is left, and the
            type of the action's result; otherwise None.
    """

    place: str
    kind: ActKind
    name: str
    type: str = ""
    message_class: Any = None
    md5sum: str = ""
    fields: FieldTree = field(default_factory=FieldTree)
    per_minute: int | None = None
    requires: tuple[str, ...] = ()
    stop: Any = None
    time_limit_s: float | None = None
    cancel: Any = None
    halt: tuple[str, Any, str] | None = None

    @property
    def stop_topic(self) -> str:
        """The topic on which the guardian publishes, or the service that it calls."""
        return self.name if self.cancel is None else f"{self.name.removesuffix('goal')}cancel"

    @property
    def stop_message(self) -> Any:
        """The message or request that the guardian sends. The guardian adds the goal's id to `cancel`."""
        return self.stop if self.cancel is None else self.cancel


@dataclass(frozen=True, slots=True)
class Condition:
    """A condition on the last message of a topic.

    Attributes:
        place: the file's name, without its folder, and the line and key.
        path: the path to the field; empty if any message satisfies the condition.
        rule: the values for which the condition holds.
        max_age_s: maximum age of the message.
    """

    place: str
    name: str
    topic: str
    message_class: Any
    path: tuple[str | int, ...]
    rule: FieldRule
    max_age_s: float


@dataclass(frozen=True, slots=True)
class Policy:
    """A policy. Acts without a rule are refused.

    Attributes:
        file, text: the name and the content of the file.
        actions: the types of the actions, by name. `rules` contains their goal and cancel topics.
    """

    file: str
    text: str
    rules: Mapping[tuple[ActKind, str], ActRule]
    conditions: Mapping[str, Condition] = field(default_factory=dict)
    actions: Mapping[str, str] = field(default_factory=dict)
