"""A master's statistics, as an XML-RPC value and as text."""

from __future__ import annotations

from collections import deque
from typing import Any, Final

from pipros.master.liveness import Liveness
from pipros.master.notifier import Notifier
from pipros.master.registry import Registry, Role
from pipros.net.rpc_server import RpcServer

METHOD: Final = "pipros.getStatistics"
"""The XML-RPC method that returns the statistics; genuine masters do not have it."""

_RATE_OVER_S: Final = 10


class CallRate:
    """Calls per second, averaged over the last ten seconds. `sample` must be called once a second."""

    def __init__(self) -> None:
        self._samples: deque[tuple[float, int]] = deque(maxlen=_RATE_OVER_S + 1)

    def sample(self, now: float, total: int) -> None:
        self._samples.append((now, total))

    @property
    def per_second(self) -> float:
        if len(self._samples) < 2:
            return 0.0
        (began, first), (ended, last) = self._samples[0], self._samples[-1]
        return (last - first) / (ended - began) if ended > began else 0.0


def collect(
    *,
    uptime_s: float,
    registry: Registry,
    param_count: int,
    rpc: RpcServer,
    notifier: Notifier,
    liveness: Liveness,
    rate: CallRate,
) -> dict[str, Any]:
    """Return the statistics as a dictionary for XML-RPC. Counts that may exceed 32 bits are floats."""
    return {
        "uptime_s": uptime_s,
        "nodes": len(registry.nodes),
        "nodes_met": liveness.met_count,
        "topics_published": sum(1 for _ in registry.keys_of(Role.PUBLISHER)),
        "topics_subscribed": sum(1 for _ in registry.keys_of(Role.SUBSCRIBER)),
        "services": sum(1 for _ in registry.keys_of(Role.SERVICE)),
        "parameters": param_count,
        "calls": float(sum(rpc.calls.values())),
        "calls_per_s": rate.per_second,
        "calls_by_method": {name: float(count) for name, count in rpc.calls.items() if count},
        "connections": len(rpc.connections),
        "connections_accepted": float(rpc.connections.accepted),
        "connections_closed_for_room": float(rpc.connections.evicted),
        "refused": float(rpc.refusals.total),
        "refused_by_peer": {peer: float(count) for peer, count in rpc.refusals.by_peer().items()},
        "notices_delivered": float(notifier.delivered),
        "notices_waiting": notifier.waiting_count,
        "notices_superseded": float(notifier.superseded),
        "notices_dropped": float(notifier.dropped),
        "slow_nodes": notifier.slow_apis,
        "unreachable_nodes": liveness.unreachable,
    }


def describe(uri: str, figures: dict[str, Any]) -> str:
    """Return the statistics as text, in the layout of `rosnode info`."""
    lines = [
        "-" * 80,
        f"Master [{uri}], up for {figures['uptime_s']:.0f} s",
        f"Nodes: {figures['nodes']}, topics published: {figures['topics_published']}, "
        f"subscribed: {figures['topics_subscribed']}, services: {figures['services']}, "
        f"parameters: {figures['parameters']}",
        f"Calls: {figures['calls']:.0f}, recently {figures['calls_per_s']:.1f} a second",
        *_listed("By method", {name: f"{count:.0f}" for name, count in figures["calls_by_method"].items()}),
        f"Connections: {figures['connections']} open, {figures['connections_accepted']:.0f} so far, "
        f"{figures['connections_closed_for_room']:.0f} closed to make room",
        *_listed("Refused", {peer: f"{count:.0f}" for peer, count in figures["refused_by_peer"].items()}),
        f"Notices: {figures['notices_delivered']:.0f} delivered, {figures['notices_waiting']} waiting, "
        f"{figures['notices_superseded']:.0f} superseded, {figures['notices_dropped']:.0f} dropped",
        *_listed("Slow nodes", {api: f"{count} waiting" for api, count in figures["slow_nodes"].items()}),
        *_listed("Unreachable nodes", dict.fromkeys(figures["unreachable_nodes"], "")),
    ]
    return "\n".join(lines)


def _listed(title: str, items: dict[str, str]) -> list[str]:
    if not items:
        return [f"{title}: None"]
    return [f"{title}:", *(f" * {name} {text}".rstrip() for name, text in sorted(items.items()))]
