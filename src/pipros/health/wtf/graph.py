"""Rules about the running system."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pipros.basics.printable import listed
from pipros.basics.uri import split_uri
from pipros.health.gather_system import gather_system
from pipros.health.wtf.context import WtfContext
from pipros.health.wtf.rules import Rule, error_rule, warning_rule
from pipros.net.master_client import MasterClient

CALLER_ID = "/roswtf"


def simtime_check(ctx: WtfContext) -> bool:
    if ctx.system is None:
        return False
    return bool(ctx.use_sim_time) and not ctx.system.state.publishers.get("/clock")


def ping_check(ctx: WtfContext) -> list[str]:
    return [listed(node) for node in ctx.nodes or () if ctx.system and not ctx.system.is_alive(node)]


def _edges(edges: set[tuple[str, str, str]]) -> list[str]:
    return [
        f"{listed(source)}->{listed(target)} ({listed(topic)})" for source, target, topic in sorted(edges)
    ]


def missing_edges(ctx: WtfContext) -> list[str]:
    return _edges((ctx.expected_edges or set()) - (ctx.actual_edges or set()))


def unexpected_edges(ctx: WtfContext) -> list[str]:
    return _edges((ctx.actual_edges or set()) - (ctx.expected_edges or set()))


def probe_all_services(ctx: WtfContext) -> list[str]:
    services = ctx.system.services.items() if ctx.system else ()
    return [
        f"service [{listed(name)}] appears to be malfunctioning: Unable to communicate with service "
        f"[{listed(name)}], address [{listed(report.uri)}]"
        for name, report in sorted(services)
        if report.failure is not None
    ]


def unconnected_subscriptions(ctx: WtfContext) -> str:
    text = ""
    for node, topics in sorted((ctx.unconnected_subscriptions or {}).items()):
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


topic_errors: list[Rule] = []
topic_warnings: list[Rule] = []
node_errors: list[Rule] = []
node_warnings: list[Rule] = []
service_errors: list[Rule] = []
service_warnings: list[Rule] = []
"""Genuine roswtf has these lists, but applies no rules in them."""


def load_online(ctx: WtfContext, complain: Callable[[str], Any]) -> None:
    """Gather the running system into the context; call `complain` for each node that does not answer.

    Raises:
        PiprosError: the master does not answer.
    """
    system = gather_system(ctx.ros_master_uri)
    ctx.set_system(system)
    master = MasterClient(ctx.ros_master_uri, CALLER_ID)
    try:
        names = [name for name in master.get_param_names() if name.startswith("/roslaunch/uris/")]
        ctx.roslaunch_uris = [str(master.get_param(name)) for name in names]
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


def _host(api: str) -> str:
    try:
        return split_uri(api)[0]
    except ValueError:
        return listed(api)


def wtf_check_graph(ctx: WtfContext, names: object = None) -> None:
    """Apply all rules of this module to the data of `load_online`. `names` is ignored, for compatibility."""
    del names
    for rule in graph_warnings:
        warning_rule(rule, rule[0](ctx), ctx)
    for rule in graph_errors:
        error_rule(rule, rule[0](ctx), ctx)
