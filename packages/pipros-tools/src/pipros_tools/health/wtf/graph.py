"""`roswtf` rules that check the running system."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from pipros.basics.printable import listed
from pipros.basics.uri import split_uri
from pipros.health.gather_system import gather_system
from pipros.health.system_report import SystemReport
from pipros.health.wtf.rules import Problem, Rule, problems_of
from pipros.health.wtf.subject import Subject
from pipros.net.master_client import MasterClient

CALLER_ID = "/roswtf"


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


def simtime_check(subject: Subject) -> bool:
    system = subject.system
    return system is not None and system.is_time_simulated and not system.state.publishers.get("/clock")


def ping_check(subject: Subject) -> list[str]:
    system = subject.system
    nodes = system.state.nodes() if system else ()
    return [listed(node) for node in nodes if system and not system.is_alive(node)]


def missing_edges(subject: Subject) -> list[str]:
    system = subject.system
    return described(expected_links(system) - actual_links(system)) if system else []


def unexpected_edges(subject: Subject) -> list[str]:
    system = subject.system
    return described(actual_links(system) - expected_links(system)) if system else []


def described(links: set[Link]) -> list[str]:
    """Return sorted, printable descriptions of links."""
    return [
        f"{listed(source)}->{listed(target)} ({listed(topic)})" for source, target, topic in sorted(links)
    ]


def probe_all_services(subject: Subject) -> list[str]:
    services = subject.system.services.items() if subject.system else ()
    return [
        f"service [{listed(name)}] appears to be malfunctioning: Unable to communicate with service "
        f"[{listed(name)}], address [{listed(report.uri)}]"
        for name, report in sorted(services)
        if report.failure is not None
    ]


def unconnected_subscriptions(subject: Subject) -> str:
    text = ""
    unconnected = topics_without_publisher(subject.system) if subject.system else {}
    for node, topics in sorted(unconnected.items()):
        text += f" * {listed(node)}:\n" + "".join(f"   * {listed(topic)}\n" for topic in topics)
    return text


graph_errors: list[Rule] = [
    (simtime_check, "/use_sim_time is set but no publisher of /clock is present"),
    (ping_check, "Could not contact the following nodes:"),
    (missing_edges, "The following nodes should be connected but aren't:"),
    (probe_all_services, "Errors connecting to the following services:"),
]

graph_warnings: list[Rule] = [
    (unconnected_subscriptions, "The following node subscriptions are unconnected:\n"),
    (unexpected_edges, "The following nodes are unexpectedly connected:"),
]


def with_running_system(subject: Subject, complain: Callable[[str], Any]) -> Subject:
    """Return a copy of the subject with the running system.

    Call `complain` for each node that does not respond.

    Raises:
        PiprosError: the master does not answer.
    """
    system = gather_system(subject.master_uri)
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
    """Apply all rules in this module."""
    return problems_of(subject, graph_warnings, graph_errors)
