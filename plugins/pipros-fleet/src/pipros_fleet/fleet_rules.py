"""What a member shares and accepts, and how it sends messages. `fleet_file` reads it from YAML files."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from typing import Final


class Priority(Enum):
    """Priority of messages that wait for the link. The values appear in fleet files."""

    HIGH = "high"
    NORMAL = "normal"
    LOW = "low"


NEVER_SHARED: Final = frozenset({"/clock"})
"""Topics that are neither shared nor accepted, whatever the rules: simulated time stays local."""
SHARED_BY_NAME: Final = frozenset({"/rosout", "/rosout_agg", "/statistics"})
"""Topics that only a rule with their exact name can share, because every node publishes them."""
ANYONE: Final = ("*",)
_TIMEOUT_S: Final = 10.0


@dataclass(frozen=True, slots=True)
class FleetRule:
    """One entry of a list in a fleet file.

    Attributes:
        name: global name, possibly with wildcards.
        is_allowed: whether matching names are shared or accepted.
        members: names, possibly with wildcards, of the members that may publish to the topic, call the
            service, or read or set the parameter.
        rate_hz: maximum message rate; 0 for no limit. Surplus messages are dropped, except the last.
        is_latest_only: whether a newer message replaces a message that waits for the link.
        priority: see `Priority`.
        is_compressed: whether messages are compressed.
        has_prefixed_frames: whether frame ids in tf messages are prefixed with the member's name.
        timeout_s: maximum duration of a service call.
    """

    name: str
    is_allowed: bool = True
    members: Sequence[str] = ANYONE
    rate_hz: float = 0.0
    is_latest_only: bool = False
    priority: Priority = Priority.NORMAL
    is_compressed: bool = False
    has_prefixed_frames: bool = False
    timeout_s: float = _TIMEOUT_S

    def accepts(self, member: str) -> bool:
        """Return whether the rule allows a member to use the topic, service or parameter."""
        return self.is_allowed and matches_any(self.members, member)


SHARE_ALL: Final = (FleetRule("/**"),)


@dataclass(frozen=True, slots=True)
class FleetFile:
    """The settings of a member. The defaults apply without a file.

    Attributes:
        router: the router's address; empty if the file has none.
        show: names of members, possibly with wildcards, whose topics and services appear on the local master.
        bandwidth_kbit: limit for all messages to other members together, in kbit/s; 0 for no limit.
        shared_topics, shared_parameters: rules for outputs.
        accepted_topics, accepted_services, accepted_parameters: rules for inputs.
    """

    router: str = ""
    show: Sequence[str] = ANYONE
    bandwidth_kbit: float = 0.0
    shared_topics: Sequence[FleetRule] = SHARE_ALL
    shared_parameters: Sequence[FleetRule] = ()
    accepted_topics: Sequence[FleetRule] = ()
    accepted_services: Sequence[FleetRule] = ()
    accepted_parameters: Sequence[FleetRule] = ()

    def shared_topic(self, topic: str) -> FleetRule | None:
        """Return the rule that shares a topic, or None if the topic is not shared."""
        if topic in NEVER_SHARED:
            return None
        rule = first_rule(self.shared_topics, topic)
        if rule is None or not rule.is_allowed or (topic in SHARED_BY_NAME and rule.name != topic):
            return None
        return rule

    def accepted_topic(self, topic: str) -> FleetRule | None:
        """Return the rule that accepts a topic from at least some members, or None if there is none."""
        rule = None if topic in NEVER_SHARED else first_rule(self.accepted_topics, topic)
        return rule if rule is not None and rule.is_allowed else None

    def accepted_service(self, service: str) -> FleetRule | None:
        """Return the rule that accepts calls to a service from at least some members, or None."""
        rule = first_rule(self.accepted_services, service)
        return rule if rule is not None and rule.is_allowed else None

    def shares_parameter(self, name: str, member: str) -> bool:
        rule = first_rule(self.shared_parameters, name)
        return rule is not None and rule.accepts(member)

    def sets_parameter(self, name: str, member: str) -> bool:
        rule = first_rule(self.accepted_parameters, name)
        return rule is not None and rule.accepts(member)


def first_rule(rules: Sequence[FleetRule], name: str) -> FleetRule | None:
    """Return the first rule that matches a name, or None if there is none."""
    return next((rule for rule in rules if matches(rule.name, name)), None)


def matches_any(patterns: Sequence[str], name: str) -> bool:
    return any(matches(pattern, name) for pattern in patterns)


def matches(pattern: str, name: str) -> bool:
    """Return whether a name matches a pattern with `*` and `**`.

    >>> matches("/camera/*", "/camera/info"), matches("/camera/*", "/camera/a/b"), matches("/**", "/a/b")
    (True, False, True)
    """
    return _compiled(pattern).fullmatch(name) is not None


@lru_cache(maxsize=1000)
def _compiled(pattern: str) -> re.Pattern[str]:
    parts = re.split(r"(\*+)", pattern)
    wild = {"*": "[^/]*"}
    return re.compile("".join(wild.get(part, ".*") if "*" in part else re.escape(part) for part in parts))
