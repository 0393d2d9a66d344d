"""The running system that `roswtf` checks, and its links as plugins see them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from pipros.basics.printable import listed
from pipros.basics.uri import split_uri
from pipros.net.master_client import MasterClient
from pipros_tools.health import graph_checks
from pipros_tools.health.examine import stable_system
from pipros_tools.health.system_report import SystemReport
from pipros_tools.health.wtf.rules import Problem, as_problems
from pipros_tools.health.wtf.subject import Subject

CALLER_ID = "/roswtf"
ANSWER_LIMIT_S = 3.0


Link = tuple[str, str, str]
"""A publisher, a subscriber and a topic."""


def expected_links(system: SystemReport) -> set[Link]:
    """Return the links that the registrations imply."""
    return {
        (publisher, subscriber, topic)
        for topic, publishers in system.state.publishers.items()
        for publisher in publishers
        for subscriber in system.state.subscribers.get(topic, ())
    }


def actual_links(system: SystemReport) -> set[Link]:
    """Return the links that the nodes report."""
    services = set(system.state.services)
    links = set()
    for node, report in system.nodes.items():
        for link in report.connections:
            for peer in () if link.topic in services else system.nodes_at(link.peer):
                if link.direction in ("o", "b"):
                    links.add((node, peer, link.topic))
                if link.direction in ("i", "b"):
                    links.add((peer, node, link.topic))
    return links


def topics_without_publisher(system: SystemReport) -> dict[str, list[str]]:
    """Map each subscriber to its topics that have no publisher."""
    found: dict[str, list[str]] = {}
    for topic, subscribers in system.state.subscribers.items():
        for node in () if system.state.publishers.get(topic) else subscribers:
            found.setdefault(node, []).append(topic)
    return found


def with_running_system(subject: Subject, complain: Callable[[str], Any]) -> Subject:
    """Return a copy of the subject with the running system.

    Call `complain` for each node that does not respond.

    Raises:
        PiprosError: the master does not answer.
    """
    system = stable_system(subject.environment, ANSWER_LIMIT_S)
    master = MasterClient(subject.master_uri, CALLER_ID)
    try:
        names = [name for name in master.get_param_names() if name.startswith("/roslaunch/uris/")]
        uris = tuple(str(master.get_param(name)) for name in names)
    finally:
        master.close()
    for node, report in system.nodes.items():
        failure = report.failure
        if failure is None:
            continue
        if failure.is_unknown_host:
            complain(f"ERROR: Unknown host [{_host(report.api)}] for node [{listed(node)}]")
        elif failure.is_refused:
            complain(f"ERROR: connection refused to [{listed(report.api)}]")
        else:
            complain(f"ERROR: communication with node [{listed(node)}] failed: {failure.reason}")
    return replace(subject, system=system, launcher_uris=uris)


def _host(api: str) -> str:
    try:
        return split_uri(api)[0]
    except ValueError:
        return listed(api)


def check_graph(subject: Subject) -> list[Problem]:
    """Return what `pipros doctor` finds in the running system."""
    return [] if subject.system is None else as_problems(graph_checks.check_graph(subject.system))
