"""The running launchers of a master and their processes, with Noetic's names."""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Iterable
from typing import NamedTuple

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.net.master_client import MasterClient
from pipros_tools.launch.processes_of import ANSWER_LIMIT_S, processes_of
from rosgraph.network import parse_http_host_and_port


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
    client = MasterClient(Environment.from_os().master_uri, "/roslaunch_netapi", timeout_s=ANSWER_LIMIT_S)
    with contextlib.closing(client), contextlib.suppress(PiprosError):
        found = client.get_param("/roslaunch/uris")
        return [str(uri) for uri in found.values()] if isinstance(found, dict) else None
    return None


def list_processes(roslaunch_uris: str | Iterable[str] | None = None) -> list[NetProcess]:
    """Return the processes of launchers, by default of all. Launchers that do not answer are left out."""
    uris = get_roslaunch_uris() if roslaunch_uris is None else roslaunch_uris
    return [
        NetProcess(each.name, each.starts, each.is_alive, each.uri)
        for each in processes_of([uris] if isinstance(uris, str) else uris or ())
    ]
