"""Determine the URI of the master that a session uses, and whether a master responds there."""

from __future__ import annotations

import socket

from pipros.basics.env import DEFAULT_MASTER_PORT, Environment, InvalidEnvironment, split_master_uri
from pipros.basics.errors import ProtocolError, Refused, Unreachable
from pipros.launch.model import LaunchError
from pipros.net import address
from pipros.net.master_client import MasterClient
from pipros.net.rpc_client import Fault
from pipros.net.this_machine import is_this_machine


def master_environment(
    environment: Environment, *, is_core: bool, port: int | None, bind: str | None
) -> Environment:
    """Return the environment with the URI of the session's master.

    As in Noetic, `roscore` ignores the port in `ROS_MASTER_URI`. By default, it advertises loopback. If the
    host in `ROS_MASTER_URI` is a name of this computer other than localhost, `roscore` advertises this
    computer's name, and accepts connections from other machines. `ROS_HOSTNAME` and `ROS_IP` take precedence.

    Args:
        is_core: whether this is a `roscore` session.
        port: the master's port; defaults to 11311 for `roscore`, otherwise to the port in `ROS_MASTER_URI`.
        bind: address that `roscore` listens on; by default derived from the environment.
    """
    if is_core:
        port = port or DEFAULT_MASTER_PORT
        if bind in (address.ANY, address.ANY_IPV6):
            # As in Noetic, a master that listens on all addresses advertises this computer's name.
            host = environment.hostname or environment.ip or socket.gethostname()
        elif bind is not None:
            host = bind
        else:
            host = address.advertised_host(environment._replace(master_uri=_uri_here(environment, port)))
        return environment._replace(master_uri=address.uri(host, port))
    if port is not None:
        host, _ = split_master_uri(environment.master_uri)
        return environment._replace(master_uri=f"http://{address.host_and_port(host, port)}")
    return environment


def _uri_here(environment: Environment, port: int) -> str:
    """Return the URI that determines the address on which a core listens.

    Its host is the host in `ROS_MASTER_URI` if that is this computer and neither ROS_HOSTNAME nor ROS_IP is
    set, otherwise `localhost`.
    """
    try:
        host, _ = split_master_uri(environment.master_uri)
    except InvalidEnvironment:
        host = "localhost"
    if environment.hostname or environment.ip or not is_this_machine(host):
        host = "localhost"
    return address.uri(host, port)


def run_id_of(client: MasterClient) -> str | None:
    """Return the master's run id, an empty string if it has none, or None if no master responds.

    Raises:
        LaunchError: the server at that address is not a master.
    """
    try:
        return str(client.get_param("/run_id"))
    except Refused:
        return ""
    except Unreachable:
        return None
    except (ProtocolError, Fault) as error:
        raise LaunchError(
            f"the server at ROS_MASTER_URI [{client.uri}] is not a ROS master: {error}. "
            "Choose another port with -p or ROS_MASTER_URI"
        ) from None
