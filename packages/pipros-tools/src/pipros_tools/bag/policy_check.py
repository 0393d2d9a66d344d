"""Apply a policy to the messages of a bag as if clients had published them."""

from __future__ import annotations

import os
from dataclasses import dataclass, field

from pipros_server.policy.decisions import Act, PolicyState, decide, read_condition
from pipros_server.policy.model import ActKind, ActRefused, Policy
from pipros_tools.bag.opening import open_bag


@dataclass(slots=True)
class RefusedMessages:
    """The messages that one rule refuses: their number, and the time and reason of the first refusal."""

    first_s: float
    first: str
    count: int = 0


@dataclass(slots=True)
class BagCheck:
    """The result of applying a policy to a bag.

    Attributes:
        passed: number of permitted messages.
        refused: the refused messages, by the `place` of the rule.
        other_topics: number of messages on each topic for which the policy has no rule or condition.
    """

    passed: int = 0
    refused: dict[str, RefusedMessages] = field(default_factory=dict)
    other_topics: dict[str, int] = field(default_factory=dict)


def check_bag(policy: Policy, path: str | os.PathLike[str]) -> BagCheck:
    """Apply a policy to all messages of a bag, in the order and at the times at which they were recorded.

    Raises:
        PiprosError, OSError: the bag cannot be read.
    """
    result, state = BagCheck(), PolicyState()
    of_topic: dict[str, list[str]] = {}
    for condition in policy.conditions.values():
        of_topic.setdefault(condition.topic, []).append(condition.name)
    with open_bag(path) as bag:
        start_ns = bag.range_ns[0] if bag.message_count else 0
        counts = bag.count_by_connection()
        wanted = []
        for connection in bag.connections:
            name = connection.topic
            if name in of_topic or (ActKind.TOPIC, name) in policy.rules:
                wanted.append(connection)
            else:
                result.other_topics[name] = result.other_topics.get(name, 0) + counts[connection.id]
        for connection, time_ns, message in bag.decoded(wanted):
            now_s = (time_ns - start_ns) / 1e9
            for name in of_topic.get(connection.topic, ()):
                state.readings[name] = read_condition(policy.conditions[name], message, now_s)
            if connection.topic in of_topic:
                continue
            try:
                act = Act(ActKind.TOPIC, connection.topic, message, connection.type, connection.md5sum)
                decide(policy, act, state, now_s)
                result.passed += 1
            except ActRefused as error:
                known = result.refused.setdefault(error.place, RefusedMessages(now_s, str(error)))
                known.count += 1
    return result
