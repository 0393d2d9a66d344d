"""Resource usage of nodes on this machine: `rqt_top`. Needs Linux."""

from __future__ import annotations

import asyncio
import time
from collections import Counter
from collections.abc import AsyncIterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.net.address import split_uri
from pipros.net.this_machine import is_this_machine
from pipros_page.bounded_list import bounded_list
from pipros_page.process_usage import ProcessUsage, has_proc, usage_of
from pipros_page.watched_system import WatchedSystem
from pipros_tools.graph.node_clients import NodeClients
from pipros_tools.graph.observer import GraphObservation

POLL_INTERVAL_S = 2.0
ASKING_S = 3.0
"""Maximum time for querying process ids in one update. The remaining nodes are queried in the next update."""


class ProcessViews:
    """The view of the Nodes tab."""

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system

    async def processes(self, _: Mapping[str, object]) -> AsyncIterator[object]:
        """Periodically yield the list of nodes: host, connections and, on this machine, resource usage."""
        table = _Table(self._system.node_clients, self._system.graph.caller_id)
        problem = "" if has_proc() else "Processor and memory are shown on Linux only."
        async for observation in self._system.observations():
            yield {
                "nodes": bounded_list(await self._system.questions.run(table.rows, observation)),
                "error": problem,
            }
            await asyncio.sleep(POLL_INTERVAL_S)


@dataclass(slots=True)
class _Process:
    """A node's process and its last reading. The load is computed from two successive readings."""

    pid: int
    usage: ProcessUsage
    read_s: float


class _Table:
    """Processes of all nodes."""

    def __init__(self, clients: NodeClients, caller_id: str) -> None:
        self._clients = clients
        self._caller_id = caller_id
        self._processes: dict[str, _Process] = {}

    def rows(self, observation: GraphObservation) -> list[Mapping[str, Any]]:
        rows: list[Mapping[str, Any]] = []
        kept = {}
        asking_until_s = time.monotonic() + ASKING_S
        ends = Counter(
            end
            for connection in observation.connections
            for end in {connection.publisher, connection.subscriber}
        )
        for name, node in sorted(observation.nodes.items()):
            row: dict[str, Any] = {"name": name, "host": "", "uri": node.uri, "error": node.error}
            row["connections"] = ends[name]
            rows.append(row)
            if not node.uri:
                continue
            with suppress(ValueError):  # the observation reports the invalid URI
                row["host"] = split_uri(node.uri)[0]
            if node.error or not is_this_machine(row["host"]):
                continue
            process = self._processes.get(node.uri)
            if process is None and time.monotonic() < asking_until_s:
                process = self._process_of(node.uri)
            if process is not None and (figures := _figures(process)):
                kept[node.uri] = process
                row.update(figures)
        self._processes = kept
        return rows

    def _process_of(self, uri: str) -> _Process | None:
        try:
            with self._clients.client(uri) as api:
                answer = api.call("getPid", self._caller_id)
        except (PiprosError, OSError, ValueError):
            return None
        pid = answer[2] if isinstance(answer, list) and len(answer) == 3 else None
        if not isinstance(pid, int) or pid <= 0 or (usage := usage_of(pid)) is None:
            return None
        return _Process(pid, usage, time.monotonic())


def _figures(process: _Process) -> Mapping[str, Any]:
    """Return a process's usage; empty if the process has ended, even if another process has its id now."""
    usage, now_s = usage_of(process.pid), time.monotonic()
    if usage is None or usage.start != process.usage.start:
        return {}
    figures: dict[str, Any] = {
        "pid": process.pid,
        "memory": usage.memory_bytes,
        "threads": usage.threads,
        "files": usage.files,
    }
    if now_s - process.read_s >= POLL_INTERVAL_S / 2:
        used_s = usage.processor_s - process.usage.processor_s
        figures["cpu"] = round(100 * used_s / (now_s - process.read_s), 1)
        process.usage, process.read_s = usage, now_s
    return figures
