"""The processes of running launchers, as these report them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from pipros.basics.errors import PiprosError
from pipros.net.rpc_client import RpcClient

ANSWER_LIMIT_S = 3.0


class LaunchedProcess(NamedTuple):
    """A process of the launcher at `uri`. `starts` is the number of its starts."""

    name: str
    starts: int
    is_alive: bool
    uri: str


def processes_of(uris: Iterable[str]) -> list[LaunchedProcess]:
    """Return the processes of the launchers at these URIs. A launcher that does not answer is left out."""
    found: list[LaunchedProcess] = []
    for uri in uris:
        try:
            with RpcClient(uri, timeout_s=ANSWER_LIMIT_S) as client:
                _, _, (alive, ended) = client.call("list_processes")
            found += [
                LaunchedProcess(str(name), int(starts), is_alive, uri)
                for is_alive, processes in ((True, alive), (False, ended))
                for name, starts in processes
            ]
        except (PiprosError, ValueError, TypeError):
            continue  # the launcher has exited without deleting its parameter
    return found
