"""Which master a session is to use: its address, whether one answers there, and whose computer that is."""

from __future__ import annotations

import socket
from dataclasses import replace

from pipros.env import DEFAULT_MASTER_PORT, Environment, split_master_uri
from pipros.errors import ProtocolError, Refused, Unreachable
from pipros.launch.model import LaunchError, Machine
from pipros.net import address
from pipros.net.master import MasterClient
from pipros.net.rpc import Fault


def master_environment(
    environment: Environment, *, is_core: bool, port: int | None, bind: str | None
) -> Environment:
    """The environment with the master's address that the options of a session lead to.

    `roscore` is reached by the name that this computer tells others; it takes the usual port unless
    told, whatever `ROS_MASTER_URI` says: so Noetic has it.
    """
    if is_core:
        port = port or DEFAULT_MASTER_PORT
        if bind in (address.ANY, address.ANY_IPV6):
            # Opened on purpose: others are told the name of this computer, as in Noetic.
            host = environment.hostname or environment.ip or socket.gethostname()
        elif bind is not None:
            host = bind
        else:
            local = replace(environment, master_uri=f"http://localhost:{port}")
            host = address.advertised_host(local)
        return replace(environment, master_uri=address.uri(host, port))
    if port is not None:
        host, _ = split_master_uri(environment.master_uri)
        return replace(environment, master_uri=f"http://{address.host_and_port(host, port)}")
    return environment


def run_id_of(client: MasterClient) -> str | None:
    """The run of the master that answers there; empty when it has none; None when nobody answers."""
    try:
        return str(client.get_param("/run_id"))
    except Refused:
        return ""
    except Unreachable:
        return None
    except (ProtocolError, Fault) as error:
        raise LaunchError(
            f"what answers at ROS_MASTER_URI [{client.uri}] is no ROS master: {error}. Choose another port "
            "by -p or ROS_MASTER_URI"
        ) from None


def is_here(machine: Machine) -> bool:
    """Whether nodes of a machine are started here, without ssh: it is this computer, and no other user's."""
    if machine.user:
        import getpass

        if machine.user != getpass.getuser():
            return False
    return is_this_computer(machine.address)


def is_this_computer(host: str) -> bool:
    """Whether a host name or address is this computer's: a port can be opened on it."""
    if address.is_loopback(host):
        return True
    try:
        family, kind, protocol, _, where = socket.getaddrinfo(host, 0, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.bind(where)
    except OSError:
        return False
    return True
