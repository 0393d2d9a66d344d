"""Which address to bind, and which to tell others.

Genuine ROS binds every interface unless `ROS_IP` or `ROS_HOSTNAME` says loopback. Here it is the
other way round as long as everything is on one machine: with a local `ROS_MASTER_URI` and neither
variable set, loopback is bound, and a stranger on the same network finds nothing to talk to.
"""

from __future__ import annotations

import socket

from pipros.env import Environment, split_master_uri
from pipros.errors import PiprosError
from pipros.wire.uri import host_and_port as host_and_port
from pipros.wire.uri import split_uri as split_uri

LOOPBACK = "127.0.0.1"
ANY = "0.0.0.0"  # noqa: S104  # bound only when the environment opens it
ANY_IPV6 = "::"


def is_loopback(host: str) -> bool:
    """True for `localhost`, `127.x.y.z` and `::1`, as written; no name is looked up.

    >>> is_loopback("localhost"), is_loopback("127.0.1.1"), is_loopback("robot")
    (True, True, False)
    """
    host = host.strip("[]").lower()
    if host in ("localhost", "::1", "ip6-localhost", "ip6-loopback") or host.endswith(".localhost"):
        return True
    parts = host.split(".")
    return len(parts) == 4 and parts[0] == "127" and all(part.isdigit() for part in parts)


def is_master_local(environment: Environment) -> bool:
    """True when the master URI names loopback. The name of this machine does not: it means the network."""
    try:
        host, _ = split_master_uri(environment.master_uri)
    except PiprosError:
        return True
    return is_loopback(host)


def bind_host(environment: Environment) -> str:
    """The address to listen on: loopback, or every interface when the environment opens it.

    It is opened by a `ROS_HOSTNAME` or `ROS_IP` that is not loopback, and, when neither is set, by
    a `ROS_MASTER_URI` on another machine.
    """
    told = environment.hostname or environment.ip
    if is_loopback(told) if told else is_master_local(environment):
        return "::1" if told and ":" in told else LOOPBACK
    return ANY_IPV6 if told and ":" in told else ANY


def advertised_host(environment: Environment) -> str:
    """The host name or address that others are given: `ROS_HOSTNAME`, else `ROS_IP`, else the best known.

    The best known is loopback while only loopback is bound, else the name of this machine, else
    (when it has no name of its own) the address by which it would reach the master.
    """
    told = environment.hostname or environment.ip
    if told:
        return told
    if is_master_local(environment):
        return LOOPBACK
    return own_name(environment)


def own_name(environment: Environment) -> str:
    """The name of this machine, or, when it has none of its own, its address towards the master."""
    name = socket.gethostname()
    return name if name and not is_loopback(name) else address_towards(environment.master_uri)


def address_towards(master_uri: str) -> str:
    """This machine's own address on the way to the master. Nothing is sent: UDP only picks the route."""
    try:
        host, port = split_master_uri(master_uri)
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.connect(address)
            return str(probe.getsockname()[0])
    except (OSError, PiprosError):
        return LOOPBACK


def uri(host: str, port: int, scheme: str = "http") -> str:
    """The URI of a node or a service, as ROS writes it.

    >>> uri("robot", 1234), uri("::1", 80, "rosrpc")
    ('http://robot:1234/', 'rosrpc://[::1]:80')
    """
    return f"{scheme}://{host_and_port(host, port)}" + ("/" if scheme == "http" else "")
