"""Queries to running launchers."""

from __future__ import annotations

from collections.abc import Sequence

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.basics.lazy_names import star_names as _star_names
from pipros.net.master_client import MasterClient
from pipros.net.rpc_client import RpcClient
from rosgraph.network import parse_http_host_and_port

_star_names(__name__, "rosgraph xmlrpc.client:ServerProxy")

_CALLER_ID = "/roslaunch_netapi"
_TIMEOUT_S = 5.0


class NetProcess:
    """A launcher's process: its name, state and start count, and the launcher's URI."""

    def __init__(self, name: str, respawn_count: int, is_alive: bool, roslaunch_uri: str) -> None:
        self.is_alive = is_alive
        self.respawn_count = respawn_count
        self.name = name
        self.roslaunch_uri = roslaunch_uri
        self.machine, _ = parse_http_host_and_port(roslaunch_uri)


def get_roslaunch_uris() -> list[str] | None:
    """Return the URIs of the registered launchers, or None if there are none or no master responds."""
    client = MasterClient(Environment.from_os().master_uri, _CALLER_ID, timeout_s=_TIMEOUT_S)
    try:
        uris = client.get_param("/roslaunch/uris")
    except PiprosError:
        return None
    finally:
        client.close()
    return list(uris.values()) if isinstance(uris, dict) else None


def list_processes(roslaunch_uris: Sequence[str] | None = None) -> list[NetProcess]:
    """Return the processes of the launchers that respond. By default, query all registered launchers."""
    found = []
    for uri in roslaunch_uris or get_roslaunch_uris() or ():
        try:
            with RpcClient(uri, timeout_s=_TIMEOUT_S) as client:
                _, _, lists = client.call("list_processes")
            for is_alive, processes in zip((True, False), lists, strict=False):
                found += [NetProcess(name, count, is_alive, uri) for name, count in processes]
        except (PiprosError, ValueError, TypeError):
            continue
    return found
