"""Status reports of a gateway: topics, services and actions with their rates, and names left out.

This module performs no I/O.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from pipros_libraries.diagnostics.link_status import LinkLevel, LinkStatus
from pipros_ros2.interface import EndpointKind, EngineProblem
from pipros_ros2.rules import Direction, RuleKind

_SHOWN: Final = 200
"""Maximum number of topics, services and actions that a diagnostic status lists."""


@dataclass(frozen=True, slots=True)
class Row:
    """A topic, service or action that the gateway passes.

    Attributes:
        kind, direction: as in rule files.
        types: the types in ROS 1 and ROS 2.
        active: whether the gateway subscribes to the topic; always true for services and actions.
        count: number of messages, calls or goals.
        rate: messages, calls or goals per second.
        dropped: number of messages, calls or goals that failed or were dropped.
        reason: why a message, call or goal last failed or was dropped, or empty.
    """

    kind: str
    direction: str
    name: str
    types: tuple[str, str]
    active: bool = True
    count: int = 0
    rate: float = 0.0
    dropped: int = 0
    reason: str = ""


@dataclass(frozen=True, slots=True)
class NotBridged:
    """The reason why a name is left out. `by_rule` is true if the rules or their defaults exclude it."""

    reason: str
    by_rule: bool = False


@dataclass(frozen=True, slots=True)
class GatewayStatus:
    """A status report.

    Keys of `left_out` have the form `topics: to_ros1: /name`. For problems with a peer's endpoint,
    ` (subscriber /node)` is appended.
    """

    identity: str
    passed: Sequence[Row] = ()
    left_out: Mapping[str, NotBridged] = field(default_factory=dict)

    def values(self) -> dict[str, Any]:
        """Return the report as JSON-serializable values, as printed by `pipros ros2 status --json`."""
        return {
            "identity": self.identity,
            "passed": [
                {
                    "kind": row.kind,
                    "direction": row.direction,
                    "name": row.name,
                    "ros1_type": row.types[0],
                    "ros2_type": row.types[1],
                    "active": row.active,
                    "count": row.count,
                    "rate": row.rate,
                    "dropped": row.dropped,
                    "reason": row.reason,
                }
                for row in self.passed
            ],
            "left_out": {key: each.reason for key, each in self.left_out.items()},
            "by_rule": [key for key, each in self.left_out.items() if each.by_rule],
        }

    def diagnosis(self, node: str) -> LinkStatus:
        """Return the report as the diagnostic status of a gateway's node."""
        problems = {key: each for key, each in self.left_out.items() if not each.by_rule}
        dropped = sum(row.dropped for row in self.passed)
        values = {
            f"{row.kind}: {row.direction}: {row.name}": f"{row.rate:.1f}/s, {row.dropped} dropped"
            + (f": {row.reason}" if row.reason else "")
            for row in self.passed
        }
        values |= {key: f"left out: {each.reason}" for key, each in problems.items()}
        texts = [f"{len(self.passed)} topics, services and actions pass"]
        texts += [f"{dropped} messages, calls or goals dropped"] if dropped else []
        texts += [f"{len(problems)} left out"] if problems else []
        return LinkStatus(
            f"/ROS 2/{node.removeprefix('/')}",
            LinkLevel.WARN if dropped or problems else LinkLevel.OK,
            ", ".join(texts),
            dict(list(values.items())[:_SHOWN]),
        )


def problem_key(problem: EngineProblem) -> str:
    """Return the key of a problem in `GatewayStatus.left_out`."""
    direction = Direction.TO_ROS1 if problem.kind is EndpointKind.PUBLISHER else Direction.TO_ROS2
    kind = RuleKind.TOPIC.value if problem.kind else "nodes"
    node = f" ({problem.kind.value} {problem.node})" if problem.kind else ""
    return f"{kind}: {direction.value}: {problem.name}{node}"
