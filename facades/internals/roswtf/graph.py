"""Rules about the running system. Facade of `pipros.health.wtf.graph`."""

from __future__ import annotations

import sys

from pipros.basics.lazy_names import star_names as _star_names
from pipros.health.wtf import graph as _rules
from roswtf.context import WtfContext
from roswtf.rules import Rule, apply, of_context, of_contexts

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

missing_edges = of_context(_rules.missing_edges)
ping_check = of_context(_rules.ping_check)
probe_all_services = of_context(_rules.probe_all_services)
simtime_check = of_context(_rules.simtime_check)
unconnected_subscriptions = of_context(_rules.unconnected_subscriptions)
unexpected_edges = of_context(_rules.unexpected_edges)

graph_errors = of_contexts(_rules.graph_errors)
graph_warnings = of_contexts(_rules.graph_warnings)


topic_errors: list[Rule] = []
topic_warnings: list[Rule] = []
node_errors: list[Rule] = []
node_warnings: list[Rule] = []
service_errors: list[Rule] = []
service_warnings: list[Rule] = []
"""Noetic has these lists, but does not apply the rules in them."""


def wtf_check_graph(ctx: WtfContext, names: object = None) -> None:
    """Apply all rules of this module. If necessary, first collect information about the running system.

    `names` is ignored, for compatibility.
    """
    del names
    subject = ctx.subject()
    if subject.system is None:
        ctx.set_subject(_rules.with_running_system(subject, lambda text: print(text, file=sys.stderr)))
    apply(ctx, graph_warnings, graph_errors)
