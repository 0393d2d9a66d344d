"""The running launchers of a master and their processes, with Noetic's names."""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Iterable
from typing import NamedTuple

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.net.master_client import MasterClient
from pipros.net.rpc_client import RpcClient
from rosgraph.network import parse_http_host_and_port

_ANSWER_LIMIT_S = 5.0


class NetProcess(NamedTuple):
    """A process of a launcher. `respawn_count` is the number of its starts."""

    name: str
    respawn_count: int
    is_alive: bool
    roslaunch_uri: str

    @property
    def machine(self) -> str:
        """The host of the launcher's URI."""
        return parse_http_host_and_port(self.roslaunch_uri)[0]


def get_roslaunch_uris() -> Collection[str] | None:
    """Return the URIs of the launchers that are registered with the master, or None if there are none."""
    client = MasterClient(Environment.from_os().master_uri, "/roslaunch_netapi", timeout_s=_ANSWER_LIMIT_S)
    with contextlib.closing(client), contextlib.suppress(PiprosError):
        found = client.get_param("/roslaunch/uris")
        return [str(uri) for uri in found.values()] if isinstance(found, dict) else None
    return None


def list_processes(roslaunch_uris: str | Iterable[str] | None = None) -> list[NetProcess]:
    """Return the processes of launchers, by default of all. Launchers that do not answer are left out."""
    uris = get_roslaunch_uris() if roslaunch_uris is None else roslaunch_uris
    found: list[NetProcess] = []
    for uri in [uris] if isinstance(uris, str) else uris or ():
        with (
            contextlib.suppress(PiprosError, ValueError, TypeError),
            RpcClient(uri, timeout_s=_ANSWER_LIMIT_S) as client,
        ):
            _, _, (alive, dead) = client.call("list_processes")
            found += [NetProcess(name, count, True, uri) for name, count in alive]
            found += [NetProcess(name, count, False, uri) for name, count in dead]
    return found
