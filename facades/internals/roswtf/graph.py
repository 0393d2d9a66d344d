"""Rules about the running system. Facade of `pipros.health.wtf.graph`."""

from __future__ import annotations

import sys

from pipros.basics.lazy_names import star_names as _star_names
from pipros.health.wtf import graph as _graph
from pipros.health.wtf.context import WtfContext
from pipros.health.wtf.graph import (
    graph_errors,
    graph_warnings,
    missing_edges,
    node_errors,
    node_warnings,
    ping_check,
    probe_all_services,
    service_errors,
    service_warnings,
    simtime_check,
    topic_errors,
    topic_warnings,
    unconnected_subscriptions,
    unexpected_edges,
)

__all__ = [
    "graph_errors",
    "graph_warnings",
    "missing_edges",
    "node_errors",
    "node_warnings",
    "ping_check",
    "probe_all_services",
    "service_errors",
    "service_warnings",
    "simtime_check",
    "topic_errors",
    "topic_warnings",
    "unconnected_subscriptions",
    "unexpected_edges",
    "wtf_check_graph",
]

_star_names(
    __name__,
    "roswtf.rules:error_rule roswtf.environment:is_executable itertools os roswtf.environment:paths "
    "rosgraph rosnode rospkg rosservice xmlrpc.client:ServerProxy socket sys threading time "
    "roswtf.rules:warning_rule roswtf.model:WtfError roswtf.context:WtfException roswtf.model:WtfWarning",
)


def wtf_check_graph(ctx: WtfContext, names: object = None) -> None:
    """Gathers the running system, unless the context has it, and applies all rules about it."""
    if ctx.system is None:
        _graph.load_online(ctx, lambda text: print(text, file=sys.stderr))
    _graph.wtf_check_graph(ctx, names)
