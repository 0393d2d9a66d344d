"""Checks for the types and definitions of topics."""

from __future__ import annotations

from pipros.basics.printable import listed
from pipros.basics.windows import SETUP_FILE
from pipros_tools.health.finding import Findings, error, warning
from pipros_tools.health.system_report import SystemReport


def type_mismatches(system: SystemReport) -> Findings:
    """Find topics whose publishers and subscribers have different types or definitions."""
    for topic, publisher, subscriber in system.pairs():
        differ = types_differ(system, topic, publisher, subscriber)
        if differ is not None:
            yield error(
                "type-mismatch",
                f"[{listed(publisher)}] publishes [{listed(topic)}] as [{listed(differ[0])}], but "
                f"[{listed(subscriber)}] subscribes to it as [{listed(differ[1])}]",
                "Give both the same type, or remap one of them to its own topic.",
                topic,
                publisher,
                subscriber,
            )
    for topic in sorted(system.state.publishers):
        reports = {
            node: system.publishers[topic, node]
            for node in system.state.publishers[topic]
            if (topic, node) in system.publishers and system.publishers[topic, node].md5sum not in ("", "*")
        }
        if len({report.md5sum for report in reports.values()}) > 1:
            listing = ", ".join(
                f"{listed(node)}: {report.type} {report.md5sum}" for node, report in reports.items()
            )
            yield error(
                "publishers-differ",
                f"The publishers of [{listed(topic)}] disagree about its type: {listing}",
                "Build all of them against the same definition, or remap one to its own topic.",
                topic,
                *reports,
            )


def types_differ(system: SystemReport, topic: str, publisher: str, subscriber: str) -> tuple[str, str] | None:
    """Return the publisher's and the subscriber's types if they are known and differ."""
    report = system.publishers.get((topic, publisher))
    sent = (report.type if report else "") or system.nodes[publisher].publications.get(topic, "")
    wanted = system.nodes[subscriber].subscriptions.get(topic, "")
    return None if not sent or not wanted or "*" in (sent, wanted) or sent == wanted else (sent, wanted)


def definitions(system: SystemReport) -> Findings:
    """Find types that are not installed on this machine, or are installed with a different definition."""
    users: dict[str, list[str]] = {}
    for topic, type_name in system.types.items():  # the master also stores the types of ended topics
        if topic in system.state.publishers or topic in system.state.subscribers:
            users.setdefault(type_name, []).append(topic)
    for type_name, md5sum in sorted(system.installed.items()):
        topics = sorted(users.get(type_name, []))
        if md5sum is None and topics:
            package = type_name.partition("/")[0]
            yield warning(
                "unknown-type",
                f"Type [{listed(type_name)}] of {', '.join(map(listed, topics))} is not defined by any "
                "package that is set up here",
                f"source {SETUP_FILE} of the workspace that contains package [{listed(package)}], "
                "or install it; programs that publish, subscribe or decode the type need it.",
                type_name,
                *topics,
            )
    for (topic, node), report in sorted(system.publishers.items()):
        ours = system.installed.get(report.type)
        if ours is not None and report.md5sum not in ("", "*", ours):
            yield error(
                "definition-differs",
                f"[{listed(node)}] publishes [{listed(topic)}] with another definition of [{report.type}] "
                f"(md5 sum {report.md5sum}) than the one on this machine ({ours}), so programs on this "
                "machine cannot subscribe to it",
                "Build both from the same source, restart the nodes, and source the setup file of that "
                "workspace.",
                topic,
                node,
            )
