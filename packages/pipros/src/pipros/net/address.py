"""Determine the address to bind and the address to advertise.

`PIPROS_ADVERTISE` changes only the advertised address, never the bound one.

Genuine ROS binds every interface unless `ROS_IP` or `ROS_HOSTNAME` is a loopback address. pipros binds
loopback unless the environment opens the node: if `ROS_MASTER_URI` is local and neither variable is set, no
port can be reached from the network.

If `ROS_IPV6=on`, the same applies to IPv6: a node binds `::1` or, if opened, `::`, which also accepts IPv4.
Genuine nodes support names that resolve to an IPv6 address. However, roscpp does not support URIs that
contain an IPv6 address, and rospy does not support them for services, so a host name is advertised if the
machine has one.
"""

from __future__ import annotations

import os
import socket
from typing import TYPE_CHECKING

from pipros.basics.errors import PiprosError
from pipros.basics.graph_variables import InvalidEnvironment, split_master_uri
from pipros.basics.uri import host_and_port as host_and_port
from pipros.basics.uri import split_uri as split_uri
from pipros.net.lookup import process_lookups

if TYPE_CHECKING:
    from pipros.basics.env import Environment
    from pipros.basics.ports import AdvertisedAddress, PortRange

LOOPBACK = "127.0.0.1"
LOOPBACK_IPV6 = "::1"
ANY = "0.0.0.0"  # noqa: S104  # bound only when the environment opens it
ANY_IPV6 = "::"


def is_loopback(host: str) -> bool:
    """Return True for `localhost`, `….localhost`, `127.x.y.z` and `::1`. Names are not looked up.

    >>> is_loopback("localhost"), is_loopback("127.0.1.1"), is_loopback("robot")
    (True, True, False)
    """
    host = host.strip("[]").lower()
    if host in ("localhost", "::1", "ip6-localhost", "ip6-loopback") or host.endswith(".localhost"):
        return True
    parts = host.split(".")
    return len(parts) == 4 and parts[0] == "127" and all(part.isdigit() for part in parts)


def plain_address(peer: str) -> str:
    """Return a peer's IP address in a form that can be compared.

    A zone, such as `%eth0`, is removed, and an IPv4-mapped IPv6 address is converted to IPv4.

    >>> plain_address("::ffff:10.0.0.5"), plain_address("fe80::1%eth0")
    ('10.0.0.5', 'fe80::1')
    """
    return peer.partition("%")[0].removeprefix("::ffff:")


def is_master_local(environment: Environment) -> bool:
    """Return True if the host in the master URI is loopback, or if the URI is malformed.

    A URI with this machine's name is not local in this sense.
    """
    try:
        host, _ = split_master_uri(environment.master_uri)
    except PiprosError:
        return True
    return is_loopback(host)


def bind_host(environment: Environment) -> str:
    """Return the address to listen on: loopback, or every interface if the environment opens the node.

    The node is opened by a `ROS_HOSTNAME` or `ROS_IP` that is not loopback or, if neither is set, by a
    `ROS_MASTER_URI` whose host is not loopback.
    """
    configured = environment.hostname or environment.ip
    if not (is_loopback(configured) if configured else is_master_local(environment)):
        return ANY_IPV6 if environment.ipv6 or ":" in (configured or "") else ANY
    if not configured:
        is_ipv6 = environment.ipv6
    elif _is_address(configured):
        return configured.strip("[]")  # bind the advertised loopback address
    else:
        is_ipv6 = environment.ipv6 and _means_ipv6_loopback(configured)
    return LOOPBACK_IPV6 if is_ipv6 else LOOPBACK


def advertised_host(environment: Environment) -> str:
    """Return the host name or address to advertise: `ROS_HOSTNAME`, or else `ROS_IP`, or else a default.

    The default is loopback if only loopback is bound, otherwise this machine's name. If that is localhost,
    the default is the address from which this machine would reach the master.
    """
    configured = environment.hostname or environment.ip
    if configured:
        return configured
    if not is_master_local(environment):
        return own_name(environment)
    if environment.ipv6:
        return "localhost" if _means_ipv6_loopback("localhost") else LOOPBACK_IPV6
    return LOOPBACK


def problem_of(configured: str, *, is_address: bool) -> str | None:
    """Return a description of the error in a host setting, or None if the setting is valid.

    `is_address` is True for a value of `ROS_IP`, and False for a value of `ROS_HOSTNAME`.

    >>> problem_of("http://robot", is_address=False), problem_of("robot", is_address=True)
    ('protocol should not be included', 'must be a valid IPv4 or IPv6 address')
    """
    if not configured:
        return "an empty string"
    if "://" in configured:
        return "protocol should not be included"
    if is_address and 0 <= configured.rfind(".") < configured.rfind(":"):
        return "port should not be included"
    if is_address and not {".", ":"} & {*configured}:
        return "must be a valid IPv4 or IPv6 address"
    return None


def advertised_address(environment: Environment, ports: PortRange | None = None) -> AdvertisedAddress:
    """Return the address at which peers reach this process's ports.

    By default, this is `advertised_host` with the bound ports; `PIPROS_ADVERTISE` overrides it. `ports` is
    the range of ports that nodes may open; it defaults to `PIPROS_PORTS`.

    Raises:
        InvalidEnvironment: `PIPROS_ADVERTISE` or `PIPROS_PORTS` has an invalid value.
    """
    from pipros.basics.ports import AdvertisedAddress

    return environment.advertised_address(ports) or AdvertisedAddress(advertised_host(environment))


def address_here(host: str, port: int) -> tuple[str, int]:
    """Return the address to connect to in order to reach an advertised address.

    The two differ only if `PIPROS_ADVERTISE` maps the advertised address to a port of this machine: a router
    or a container's network may not forward connections from inside to the advertised address. If
    `PIPROS_ADVERTISE` is a host without ports, only the ports in `PIPROS_PORTS` are mapped.
    """
    if "PIPROS_ADVERTISE" not in os.environ:
        return host, port
    from pipros.basics.env import Environment

    environment = Environment.from_os()
    try:
        advertised, ports = environment.advertised_address(), environment.port_range
    except InvalidEnvironment:  # the code that opens the port reports the error
        return host, port
    if advertised is None or host.lower() != advertised.host.lower():
        return host, port
    inside = advertised.inside(port)
    if inside is None and not advertised.ports and ports and port in ports:
        inside = port
    if inside is None:
        return host, port
    bound = bind_host(environment)
    return {ANY: LOOPBACK, ANY_IPV6: LOOPBACK_IPV6}.get(bound, bound), inside


def _is_address(host: str) -> bool:
    return ":" in host or host.replace(".", "").isdigit()


def _means_ipv6_loopback(name: str) -> bool:
    try:
        found = process_lookups().find(name, None, family=socket.AF_INET6)
    except OSError:
        return False
    return any(address[0] == LOOPBACK_IPV6 for *_, address in found)


def own_name(environment: Environment) -> str:
    """Return this machine's name, or its address on the route to the master if the name is localhost."""
    name = socket.gethostname()
    if name and not is_loopback(name):
        return name
    return address_towards(environment.master_uri, prefers_ipv6=environment.ipv6)


def address_towards(master_uri: str, *, prefers_ipv6: bool = False) -> str:
    """Return this machine's address on the route to the master, or loopback if it cannot be determined.

    Nothing is sent to the master.
    """
    try:
        host, port = split_master_uri(master_uri)
        found = process_lookups().find(host, port, type=socket.SOCK_DGRAM)
        if prefers_ipv6:
            found.sort(key=lambda entry: entry[0] != socket.AF_INET6)
        family, kind, protocol, _, address = found[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.connect(address)
            return str(probe.getsockname()[0])
    except (OSError, PiprosError):
        return LOOPBACK


def uri(host: str, port: int, scheme: str = "http") -> str:
    """Return the URI of a node or a service.

    >>> uri("robot", 1234), uri("::1", 80, "rosrpc")
    ('http://robot:1234/', 'rosrpc://[::1]:80')
    """
    return f"{scheme}://{host_and_port(host, port)}" + ("/" if scheme == "http" else "")
