"""Facts about one topic, and the results of its check."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from pipros_tools.health.finding import Finding
from pipros_tools.health.system_report import SystemReport


class CheckedMessage(NamedTuple):
    """A message that this process received.

    Attributes:
        time_s: time of receipt on the monotonic clock.
        publisher: the node that sent the message.
        age_s: ROS time of receipt minus the stamp; None if there is no header, or the stamp is zero.
        frame: the `frame_id` in the header; None if there is no header.
        is_latched: whether the publisher latches, so that the message may be old.
    """

    time_s: float
    publisher: str
    age_s: float | None = None
    frame: str | None = None
    is_latched: bool = False


@dataclass(frozen=True, slots=True)
class TopicFacts:
    """The facts about a topic on which the check is based.

    Attributes:
        topic: the topic's global name.
        system: the registrations of all topics, and the replies of this topic's nodes.
        wait_s: the maximum time for which this process received messages.
        received: the last received messages, in the order of their receipt.
        count: the number of all received messages.
        end_s: the end of the wait, on the monotonic clock.
        frames: the frames on `/tf` and `/tf_static`; empty if no transforms are published.
        dropped: the number of messages that each subscriber dropped during the wait, if it counts them.
    """

    topic: str
    system: SystemReport
    wait_s: float
    received: Sequence[CheckedMessage] = ()
    count: int = 0
    end_s: float = 0.0
    frames: frozenset[str] = frozenset()
    dropped: Mapping[str, int] = field(default_factory=dict)

    @property
    def publishers(self) -> Sequence[str]:
        return self.system.state.publishers.get(self.topic, ())

    @property
    def subscribers(self) -> Sequence[str]:
        return self.system.state.subscribers.get(self.topic, ())


class CheckStep(NamedTuple):
    """The result of one step between the publisher and the subscribers.

    Attributes:
        name: the name of the step.
        text: the verified facts, or the summary of the problem.
        finding: the problem; None if the step passes.
    """

    name: str
    text: str
    finding: Finding | None = None


@dataclass(frozen=True, slots=True)
class TopicCheck:
    """The result of a check: the steps up to the first one that fails.

    Attributes:
        topic: the topic's global name.
        type: the topic's type according to the master; empty if unknown.
    """

    topic: str
    type: str
    steps: Sequence[CheckStep]

    @property
    def finding(self) -> Finding | None:
        """The problem; None if all steps pass."""
        return self.steps[-1].finding

    def as_json(self) -> dict[str, Any]:
        return {
            "topic": self.topic,
            "type": self.type,
            "steps": [
                {"step": each.name, "passes": each.finding is None, "text": each.text} for each in self.steps
            ],
            "finding": None if self.finding is None else self.finding.as_json(),
        }
