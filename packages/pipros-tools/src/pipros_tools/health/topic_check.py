"""Find the first step at which a topic's messages are lost. Performs no I/O.

The steps lead from the publisher to the subscribers: the publisher, its type, its connections, its address,
the first message, the rate, the stamp, the frame, and the subscribers' queues. A step is checked only if all
previous steps pass, because a later fault is usually a consequence of an earlier one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from statistics import median
from typing import Final

from pipros.basics.printable import listed
from pipros_tools.health.clock_checks import STAMP_TOLERANCE_S, clocks
from pipros_tools.health.finding import Finding, Findings, error, warning
from pipros_tools.health.graph_checks import (
    connections,
    correct_name,
    nodes_of_other_masters,
    published_like,
    unreachable_nodes,
    unreachable_publishers,
)
from pipros_tools.health.topic_facts import CheckStep, TopicCheck, TopicFacts
from pipros_tools.health.type_checks import definitions, type_mismatches

STOPPED_PERIODS: Final = 5.0
STOPPED_S: Final = 1.0
"""A topic has stopped if its last message is older than both this time and `STOPPED_PERIODS` periods."""

_WITHOUT_FRAME: Final = {
    "sensor_msgs/JointState", "sensor_msgs/BatteryState", "sensor_msgs/Joy", "sensor_msgs/TimeReference",
    "diagnostic_msgs/DiagnosticArray", "actionlib_msgs/GoalStatusArray",
}  # fmt: skip
"""Types whose messages are not about a place, and often have an empty `frame_id`."""


def check_topic(facts: TopicFacts) -> TopicCheck:
    """Check the steps in order, up to the first that fails."""
    steps = []
    for name, check in STEPS:
        found = check(facts)
        if isinstance(found, Finding):
            steps.append(CheckStep(name, found.summary, found))
            break
        steps.append(CheckStep(name, found))
    return TopicCheck(facts.topic, facts.system.types.get(facts.topic, ""), steps)


def _publisher(facts: TopicFacts) -> Finding | str:
    if facts.publishers:
        return f"{_names(facts.publishers)} {'publishes' if len(facts.publishers) == 1 else 'publish'} it"
    topic = listed(facts.topic)
    summary = (
        f"No node publishes [{topic}]"
        if facts.topic in facts.system.state.subscribers
        else f"The topic [{topic}] does not exist"
    )
    if offered := facts.system.state.services.get(facts.topic):
        return error(
            "service",
            f"[{topic}] is a service of {_names(offered)}, not a topic",
            f"Examine it with `rosservice info {facts.topic}` and `rosservice call`.",
            facts.topic,
        )
    like = published_like(facts.topic, facts.system)
    if like:
        return error(
            "similar-topic",
            f"{summary}, but {_names(like)} {'is' if len(like) == 1 else 'are'} published",
            correct_name(facts.topic, like, facts.system),
            facts.topic,
            *like,
        )
    return error(
        "no-publishers",
        summary,
        "Start its publisher; `rostopic list -p` names the topics that are published.",
        facts.topic,
    )


def _types(facts: TopicFacts) -> Finding | str:
    about = _about(facts, (*type_mismatches(facts.system), *definitions(facts.system)))
    differing = [
        each for each in (*about, *_about(facts, connections(facts.system))) if each.rule in _TYPE_RULES
    ]
    if differing:
        return differing[0]
    return "publishers and subscribers have the same type"


_TYPE_RULES: Final = ("type-mismatch", "publishers-differ", "md5-mismatch", "definition-differs")


def _connections(facts: TopicFacts) -> Finding | str:
    missing = _about(facts, connections(facts.system))
    if missing:
        return missing[0]
    count = sum(topic == facts.topic for topic, _, _ in facts.system.pairs())
    if not count:
        return "no other node subscribes" if not facts.subscribers else "none to check"
    return f"{count} of {count} {'exists' if count == 1 else 'exist'}"


def _addresses(facts: TopicFacts) -> Finding | str:
    checks = unreachable_nodes, nodes_of_other_masters, unreachable_publishers
    for check in checks:
        for finding in check(facts.system):
            is_theirs = facts.topic in finding.subjects or {*facts.publishers} & {*finding.subjects}
            if is_theirs:
                return finding
    return "all publishers can be reached from here"


def _first_message(facts: TopicFacts) -> Finding | str:
    if facts.received:
        return f"{facts.count} {'message' if facts.count == 1 else 'messages'} in {facts.wait_s:.1f} s"
    stopped = [each for each in clocks(facts.system) if each.rule == "no-clock"]
    if stopped:
        return stopped[0]
    waiting = _unpublished_inputs(facts)
    return error(
        "no-message",
        f"{_names(facts.publishers)} {'is' if len(facts.publishers) == 1 else 'are'} connected, but sent "
        f"nothing on [{listed(facts.topic)}] for {facts.wait_s:.1f} s",
        (
            f"It may wait for its own input: no node publishes {_names(waiting)}. It may also"
            if waiting
            else "It may"
        )
        + " publish rarely, have failed (see its log), or have sent its only message before, "
        "without latching.",
        facts.topic,
        *facts.publishers,
    )


def _unpublished_inputs(facts: TopicFacts) -> list[str]:
    """Return the topics to which the topic's publishers subscribe, but which no node publishes."""
    state = facts.system.state
    return [
        topic
        for topic, nodes in sorted(state.subscribers.items())
        if not state.publishers.get(topic) and {*facts.publishers} & {*nodes}
    ]


def _rate(facts: TopicFacts) -> Finding | str:
    times = [each.time_s for each in facts.received]
    if len(times) < 3:
        return "too few messages to measure it"
    period_s = median(later - earlier for earlier, later in pairwise(times))
    silence_s = facts.end_s - times[-1]
    hz = f"{1 / period_s:.3g} Hz" if period_s > 0 else "a burst"
    if silence_s > max(STOPPED_PERIODS * period_s, STOPPED_S):
        return error(
            "stopped",
            f"[{listed(facts.topic)}] arrived at {hz}, but stopped {silence_s:.1f} s ago",
            f"Look at the log and the load of {_names({each.publisher for each in facts.received})}, and at "
            "its inputs.",
            facts.topic,
        )
    return hz


def _stamp(facts: TopicFacts) -> Finding | str:
    if all(each.frame is None for each in facts.received):
        return "the messages have none"
    ages = [each.age_s for each in facts.received if not each.is_latched and each.age_s is not None]
    if not ages:
        return "zero or latched, so it was not compared with the clock"
    age_s = median(ages)
    if abs(age_s) <= STAMP_TOLERANCE_S:
        return f"{age_s:.2f} s old on arrival"
    which = "simulated time" if facts.system.is_time_simulated else "this machine's clock"
    return error(
        "stamps-differ",
        f"The stamps of [{listed(facts.topic)}] are {abs(age_s):.3g} s "
        f"{'behind' if age_s > 0 else 'ahead of'} {which}, so tf and message filters drop the messages",
        "Stamp with rospy.Time.now(); synchronize the clocks of the machines with NTP; for recorded data use "
        "simulated time (/use_sim_time and `rosbag play --clock`).",
        facts.topic,
    )


def _frame(facts: TopicFacts) -> Finding | str:
    frames = sorted({each.frame.lstrip("/") for each in facts.received if each.frame is not None})
    if not frames:
        return "the messages have none"
    if not facts.frames:
        return f"{_names(frames)}; no transforms are published, so it was not looked up"
    unknown = [frame for frame in frames if frame not in facts.frames]
    if not unknown:
        return f"{_names(frames)}, which {'has' if len(frames) == 1 else 'have'} transforms"
    if unknown == [""] and facts.system.types.get(facts.topic) in _WITHOUT_FRAME:
        return "empty, as usual for this type"
    if unknown == [""]:
        return warning(
            "no-frame",
            f"The messages on [{listed(facts.topic)}] have an empty frame_id",
            "Set header.frame_id in the publisher; tf, message filters and 3D views need it.",
            facts.topic,
        )
    from difflib import get_close_matches

    near = get_close_matches(unknown[-1], sorted(facts.frames), n=2)
    return error(
        "unknown-frame",
        f"No transform leads to the frame {_names(unknown)} of [{listed(facts.topic)}]",
        (f"Frames with similar names: {_names(near)}. " if near else "")
        + "Correct frame_id, or publish the transform, for example with static_transform_publisher.",
        facts.topic,
    )


def _queues(facts: TopicFacts) -> Finding | str:
    losing = {node: count for node, count in facts.dropped.items() if count}
    if not losing:
        return "no subscriber reports dropped messages"
    node, count = max(losing.items(), key=lambda each: each[1])
    return warning(
        "dropped",
        f"[{listed(node)}] dropped {count} messages of [{listed(facts.topic)}] in {facts.wait_s:.1f} s",
        "Its callback takes longer than the messages' period: make it faster, or lower the rate, for example "
        "with topic_tools throttle. A queue_size of 1 keeps the newest message.",
        facts.topic,
        *losing,
    )


STEPS: Final[Sequence[tuple[str, Callable[[TopicFacts], Finding | str]]]] = (
    ("publisher", _publisher),
    ("types", _types),
    ("connections", _connections),
    ("addresses", _addresses),
    ("messages", _first_message),
    ("rate", _rate),
    ("stamp", _stamp),
    ("frame", _frame),
    ("queues", _queues),
)


def _about(facts: TopicFacts, findings: Findings | Iterable[Finding]) -> list[Finding]:
    return [each for each in findings if facts.topic in each.subjects]


def _names(names: Iterable[str]) -> str:
    return ", ".join(f"[{listed(name)}]" for name in sorted(names))
