"""Checks for a running system. They derive findings from a `SystemReport`, and perform no I/O."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Sequence

from pipros.basics.printable import listed
from pipros.basics.uri import split_uri
from pipros.net.address import is_loopback
from pipros_tools.health.clock_checks import clocks
from pipros_tools.health.finding import Finding, Findings, error, findings_of, warning
from pipros_tools.health.nodelet_checks import slow_nodelets
from pipros_tools.health.system_report import Failure, SystemReport
from pipros_tools.health.type_checks import definitions, type_mismatches, types_differ

_CLOSE_NAMES = 0.75  # minimum similarity for a name to count as a misspelling of another name


def check_graph(system: SystemReport) -> list[Finding]:
    """Run all checks and return the findings, in the order of the checks."""
    return findings_of(CHECKS, system)


def unreachable_nodes(system: SystemReport) -> Findings:
    """Find registered nodes that do not answer."""
    for node, report in sorted(system.nodes.items()):
        failure = report.failure
        if failure is None:
            continue
        rule, cure = _why_node(report.api, failure)
        yield error(
            rule,
            f"Node [{listed(node)}] is registered, but does not answer at [{listed(report.api)}]: "
            f"{failure.reason}",
            cure,
            node,
        )


def _why_node(api: str, failure: Failure) -> tuple[str, str]:
    host = _host(api)
    if failure.is_unknown_host:
        return "unknown-host", (
            f"The name [{host}] cannot be resolved here. Set ROS_IP to an address of the node's machine "
            f"and start the node again, or add a line 'ADDRESS {host}' to /etc/hosts on this machine."
        )
    if failure.is_refused:
        return "ghost-node", (
            "The node has exited without unregistering. Remove it with `rosnode cleanup`, and start it "
            "again if it is needed."
            + (
                " If it runs on another machine, set ROS_IP there, because the address that it registered is "
                "local on every machine."
                if is_loopback(host)
                else ""
            )
        )
    if is_loopback(host):
        return "silent-node", (
            "The node hangs, or Ctrl-Z has suspended it: type `fg` in its terminal, or restart the node."
        )
    return "silent-node", (
        f"The node hangs, or a firewall or a wrong address keeps it out of reach. Try `ping {host}`, set "
        "ROS_IP on its machine to an address that can be reached from here, or restart the node."
    )


def nodes_of_other_masters(system: SystemReport) -> Findings:
    """Find nodes that are registered here but use another master."""
    port = _port(system.master_uri)
    for node, report in sorted(system.nodes.items()):
        theirs = _port(report.master_uri)
        if report.failure is None and theirs and port and theirs != port:
            yield warning(
                "other-master",
                f"Node [{listed(node)}] is registered here, but says that its master is "
                f"[{listed(report.master_uri)}]",
                "The registration is left over, or ports are forwarded. Run `rosnode cleanup`, or restart "
                "the node.",
                node,
            )


def unreachable_publishers(system: SystemReport) -> Findings:
    """Find publishers whose node answers, but whose data cannot be received."""
    for (topic, node), report in sorted(system.publishers.items()):
        failure = report.failure
        if failure is None:
            continue
        what = f"Node [{listed(node)}] publishes [{listed(topic)}]"
        if not report.address:
            yield error(
                "no-publisher",
                f"{what} according to its registration, but refuses subscribers: {failure.reason}",
                "The registration is left over from an earlier run. Restart the node, or run `rosnode "
                "cleanup`.",
                topic,
                node,
            )
            continue
        host = report.address.rpartition(":")[0]
        cure = (
            f"The name [{host}] cannot be resolved here. Set ROS_IP on the node's machine, or add the name "
            "to /etc/hosts."
            if failure.is_unknown_host
            else "A firewall, a container or a wrong ROS_IP is in the way. Genuine nodes choose any free "
            f"port for data, so all ports of [{host}] must be open, and a container needs the host's network."
            " Nodes that run on pipros need PIPROS_PORTS, and in a container also PIPROS_ADVERTISE."
        )
        yield error(
            "unreachable-publisher",
            f"{what}, but cannot be reached at [{listed(report.address)}]: {failure.reason}",
            cure,
            topic,
            node,
        )


def connections(system: SystemReport) -> Findings:
    """Find pairs of nodes that should be connected but are not, or that do not both report the connection."""
    for topic, publisher, subscriber in system.pairs():
        by_publisher, by_subscriber = system.is_connected(topic, publisher, subscriber)
        if by_publisher and by_subscriber:
            continue
        pair = f"[{listed(publisher)}] to [{listed(subscriber)}] on [{listed(topic)}]"
        subjects = topic, publisher, subscriber
        if by_publisher or by_subscriber:
            one, other = (publisher, subscriber) if by_publisher else (subscriber, publisher)
            yield error(
                "one-sided-connection",
                f"Only one side knows of the connection {pair}: {listed(one)} has it, {listed(other)} does "
                "not",
                "The connection was interrupted by a network failure or because a machine was switched off. "
                f"Restart [{listed(other)}]. If it happens again, check the network between their machines.",
                *subjects,
            )
        elif types_differ(system, topic, publisher, subscriber) is None:
            yield _not_connected(system, topic, publisher, subscriber)


def _not_connected(system: SystemReport, topic: str, publisher: str, subscriber: str) -> Finding:
    summary = (
        f"[{listed(subscriber)}] does not receive [{listed(topic)}] from [{listed(publisher)}], though both "
        "answer"
    )
    subjects = topic, publisher, subscriber
    report = system.publishers.get((topic, publisher))
    came_back = (topic, subscriber) in system.reached_back
    if report is not None and report.failure is None and came_back:
        return error(
            "md5-mismatch",
            f"{summary}. It connects to a publisher of any type, so their definitions of [{report.type}] "
            f"differ; the publisher's definition has the md5 sum {report.md5sum}",
            f"Compare `rosmsg md5 {report.type}` on both machines, build both nodes against the same "
            "definition and restart them.",
            *subjects,
        )
    api = system.nodes[publisher].api
    reach = (
        f"The subscriber's machine does not reach [{listed(api)}]. Try `rosnode ping {publisher}` there, and "
        "set the publisher's ROS_IP to an address that all machines can reach."
    )
    if (topic, subscriber) in system.tried_back:
        return error(
            "subscriber-cannot-reach",
            f"{summary}, and it did not connect to a publisher on this machine either",
            reach,
            *subjects,
        )
    return error(
        "not-connected",
        summary,
        f"{reach} Or their definitions of the type differ; `pipros doctor --both-ways` checks this.",
        *subjects,
    )


def topics_without_publishers(system: SystemReport) -> Findings:
    """Find topics that have subscribers but no publisher."""
    for topic, subscribers in sorted(system.state.subscribers.items()):
        alive = [node for node in subscribers if system.is_alive(node) and node not in system.plugin_replies]
        if not alive or system.state.publishers.get(topic) or _needs_no_publisher(system, topic, alive):
            continue
        like = published_like(topic, system)
        hint = f", or correct a name. {correct_name(topic, like, system)}" if like else "."
        yield warning(
            "no-publishers",
            f"No node publishes [{listed(topic)}], subscribed by {', '.join(map(listed, alive))}",
            f"Start its publisher{hint}",
            topic,
            *alive,
        )


def published_like(topic: str, system: SystemReport) -> list[str]:
    """Return the published topics with a similar name, or with the same name in another namespace.

    Topics of other types are left out, because they cannot be meant.
    """
    kinds = {system.types.get(topic, "*"), "*"}
    published = [
        name
        for name in system.state.publishers
        if name != topic and (kinds == {"*"} or system.types.get(name, "*") in kinds)
    ]
    like = difflib.get_close_matches(topic, published, n=2, cutoff=_CLOSE_NAMES)
    return like + [name for name in published if _base(name) == _base(topic) and name not in like][:2]


def correct_name(topic: str, like: Sequence[str], system: SystemReport) -> str:
    """Return advice to correct the wrong one of two similar names: the one that fewer nodes use.

    If as many nodes use both, the name without a publisher is wrong.

    Args:
        topic: the name without a publisher.
        like: the published names that are similar, at least one.
    """
    readers = set(system.state.subscribers.get(topic, ()))
    users = {*system.state.publishers[like[0]], *system.state.subscribers.get(like[0], ())}
    if len(readers) > len(users):
        wrong, right, nodes = like[0], topic, sorted(users)
    else:
        wrong, right, nodes = topic, like[0], sorted(readers)
    text = f"Published topics with similar names: {', '.join(map(listed, like))}."
    if not nodes:
        return f"{text} If [{listed(right)}] is the intended topic, use this name."
    where = ", ".join(map(listed, nodes))
    return (
        f"{text} Probably [{listed(wrong)}] is wrong: correct it in {where}, or remap {wrong}:={right} there."
    )


def _needs_no_publisher(system: SystemReport, topic: str, subscribers: Sequence[str]) -> bool:
    """Return True for topics that have no publisher in some healthy systems."""
    publishers = system.state.publishers
    if topic in ("/rosout", "/clock"):  # `clocks` reports a missing /clock
        return True
    # TF listeners subscribe to both topics, and many systems need only one of them
    if topic in ("/tf", "/tf_static"):
        return bool(publishers.get("/tf") or publishers.get("/tf_static"))
    action, _, part = topic.rpartition("/")
    # the topics of an action server without a client
    return part in ("goal", "cancel") and any(
        node in publishers.get(f"{action}/status", ()) for node in subscribers
    )


def services(system: SystemReport) -> Findings:
    """Find registered services whose node answers but whose server does not."""
    for service, report in sorted(system.services.items()):
        if report.failure is not None and system.is_alive(report.node):
            yield error(
                "service-failed",
                f"Service [{listed(service)}] of [{listed(report.node)}] does not answer at "
                f"[{listed(report.uri)}]: {report.failure.reason}",
                "Restart its node. If the node runs on another machine, its ROS_IP may be wrong, "
                "or a firewall may block it.",
                service,
                report.node,
            )


def _base(topic: str) -> str:
    return topic.rpartition("/")[2]


def _host(uri: str) -> str:
    try:
        return split_uri(uri, ["http", "rosrpc"])[0]
    except ValueError:
        return listed(uri)


def _port(uri: str) -> int:
    try:
        return split_uri(uri)[1]
    except ValueError:
        return 0


def plugins(system: SystemReport) -> Findings:
    """Find the problems that the plugins' checks derive from their nodes' replies."""
    for node, reply in sorted(system.plugin_replies.items()):
        yield from reply.check.judge(node, reply)


CHECKS: tuple[Callable[[SystemReport], Findings], ...] = (
    unreachable_nodes,
    nodes_of_other_masters,
    unreachable_publishers,
    type_mismatches,
    connections,
    definitions,
    topics_without_publishers,
    services,
    clocks,
    plugins,
    slow_nodelets,
)
