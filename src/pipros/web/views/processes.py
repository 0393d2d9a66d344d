"""Resource usage of nodes on this machine: `rqt_top`. Needs psutil."""

from __future__ import annotations

import asyncio
import importlib
import time
from collections import Counter
from collections.abc import AsyncIterator, Mapping
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.graph.observer import Observation
from pipros.net.address import split_uri
from pipros.net.rpc_client import RpcClient
from pipros.net.this_machine import is_this_machine
from pipros.web.bounded_list import bounded_list
from pipros.web.server import RequestRefused
from pipros.web.watched_system import WatchedSystem

LOOK_INTERVAL_S = 2.0
ANSWER_DEADLINE_S = 1.0
ASKING_S = 3.0
"""Time for querying process ids in one update. The remaining nodes wait for the next."""


class ProcessViews:
    """The view of the Nodes tab."""

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system

    async def processes(self, _: Mapping[str, Any]) -> AsyncIterator[Any]:
        """Yield each node with its host and, on this machine, its load, memory, threads and connections."""
        psutil = _psutil()
        table = _Table(psutil, self._system.graph.caller_id)
        async for observation in self._system.observations():
            yield {
                "nodes": bounded_list(await self._system.questions.run(table.rows, observation)),
                "error": "" if psutil else "processor and memory need psutil: {install_command('monitor')}",
            }
            await asyncio.sleep(LOOK_INTERVAL_S)


def _psutil() -> Any:
    try:
        return importlib.import_module("psutil")
    except ImportError:
        return None


class _Table:
    """Table of processes, kept because processor load is the difference of two readings."""

    def __init__(self, psutil: Any, caller_id: str) -> None:
        self._psutil = psutil
        self._caller_id = caller_id
        self._processes: dict[str, Any] = {}

    def rows(self, observation: Observation) -> list[Mapping[str, Any]]:
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
            row["host"] = split_uri(node.uri)[0]
            if self._psutil is None or node.error or not is_this_machine(row["host"]):
                continue
            process = self._processes.get(node.uri)
            if process is None and time.monotonic() < asking_until_s:
                process = self._process_of(node.uri)
            if process is not None:
                kept[node.uri] = process
                row.update(self._figures(process))
        self._processes = kept
        return rows

    def _process_of(self, uri: str) -> Any:
        try:
            with RpcClient(uri, timeout_s=ANSWER_DEADLINE_S) as api:
                answer = api.call("getPid", self._caller_id)
            pid = answer[2] if isinstance(answer, list) and len(answer) == 3 else None
            if not isinstance(pid, int) or pid <= 0:
                raise RequestRefused(f"getPid must return a number above 0, got {pid!r}")
            process = self._psutil.Process(pid)
            process.cpu_percent()
        except (PiprosError, OSError, ValueError, self._psutil.Error):
            return None
        return process

    def _figures(self, process: Any) -> Mapping[str, Any]:
        try:
            with process.oneshot():
                return {
                    "pid": process.pid,
                    "cpu": round(process.cpu_percent(), 1),
                    "memory": process.memory_info().rss,
                    "threads": process.num_threads(),
                    "files": process.num_fds() if hasattr(process, "num_fds") else None,
                    "started": process.create_time(),
                }
        except self._psutil.Error:
            return {}
