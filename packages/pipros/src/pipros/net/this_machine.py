"""Determine whether an address, a host name or a caller belongs to this machine.

All code that trusts "this machine" uses this module. The term means the network namespace of this process: a
container with its own network is another machine. An address belongs to this machine if the system uses it as
its own. Only configured names are looked up. Looking up a caller's name could take half a minute, and would
leave the decision to the name server.
"""

from __future__ import annotations

import socket
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

from pipros.net.address import ANY, ANY_IPV6, LOOPBACK, is_loopback, plain_address
from pipros.net.lookup import Lookups, process_lookups

LOOKUP_S = 5.0
"""Limit: the time for looking up a configured host name to determine whether it belongs to this machine.
Beyond it, the name is treated as the name of another machine.
"""

_DOCUMENTATION_ADDRESSES: Final = {socket.AF_INET: "192.0.2.1", socket.AF_INET6: "2001:db8::1"}
"""Addresses for documentation (RFC 5737, RFC 3849). If the system lets a socket bind even to these, a
successful bind proves nothing.
"""
_DISCARD_PORT: Final = 9

_SOCKET_TABLES: Final = (Path("/proc/net/tcp"), Path("/proc/net/tcp6"))
_ESTABLISHED: Final = "01"
_LISTENING: Final = "0A"
_ORPHAN: Final = "0"
"""The inode of a socket that is no longer open in any process. The table shows root as its owner."""


class ThisMachineCaller(NamedTuple):
    """The two ends of a connection to a server in this process.

    All fields are empty if the connection has closed.

    Attributes:
        host, port: the caller's end.
        own_host, own_port: the address that the caller connected to.
    """

    host: str = ""
    port: int = 0
    own_host: str = ""
    own_port: int = 0

    @classmethod
    def from_names(cls, peer_name: object, socket_name: object) -> ThisMachineCaller:
        """Create a caller from the results of `getpeername` and `getsockname`; empty if either is missing.

        >>> ThisMachineCaller.from_names(("::ffff:10.0.0.5", 4711, 0, 0), ("::ffff:10.0.0.1", 11311, 0, 0))
        ThisMachineCaller(host='10.0.0.5', port=4711, own_host='10.0.0.1', own_port=11311)
        """
        if not (isinstance(peer_name, tuple) and isinstance(socket_name, tuple)):
            return cls()
        (host, port, *_), (own_host, own_port, *_) = peer_name, socket_name
        return cls(plain_address(host), port, plain_address(own_host), own_port)

    @property
    def is_here(self) -> bool:
        """Whether the caller has one of this machine's addresses.

        A local connection comes from the address that it connects to, from another address of this machine,
        or from loopback. Never blocks.
        """
        return bool(self.host) and (self.host == self.own_host or has_address(self.host))

    def user_id(self) -> int | None:
        """Return the user ID of the local process at the caller's end, or None if it is unknown.

        Linux only. This is slow, because it reads the machine's table of all connections.
        """
        ends = {
            (_table_entry(host, self.port), _table_entry(own, self.own_port))
            for host, own in ((self.host, self.own_host), (_mapped(self.host), _mapped(self.own_host)))
        }
        for end in _socket_table():
            if (end.local, end.remote) in ends and end.state == _ESTABLISHED and end.inode != _ORPHAN:
                return end.user
        return None


def knows_users() -> bool:
    """Return True if the owner of a connection can be determined. This requires Linux with `/proc`."""
    return any(table.exists() for table in _SOCKET_TABLES)


def user_listening(host: str, port: int) -> int | None:
    """Return the user ID of the process that listens on `port` at an address of this machine, or None.

    As slow as `ThisMachineCaller.user_id`, and also requires Linux.
    """
    hosts = (host, _mapped(host), ANY, ANY_IPV6)
    places = {_table_entry(place, port) for place in hosts}
    for end in _socket_table():
        if end.local in places and end.state == _LISTENING:
            return end.user
    return None


def listening_inodes() -> dict[str, int]:
    """Map the inodes of this machine's listening sockets to the ports on which they listen. Linux only."""
    return {
        end.inode: int(end.local.rpartition(":")[2], 16) for end in _socket_table() if end.state == _LISTENING
    }


def has_address(host: str) -> bool:
    """Return True if an IP address belongs to this machine. Nothing is sent, and names are not looked up."""
    if is_loopback(host):
        return True
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        socket.inet_pton(family, host)
    except (OSError, ValueError):  # the host is a name, not an address
        return False
    # The source address on the route to one of this machine's addresses is the same address, except for
    # secondary addresses of an interface.
    return _source_towards(family, host) == host or (
        _can_bind(family, host) and not _can_bind(family, _DOCUMENTATION_ADDRESSES[family])
    )


def is_this_machine(host: str) -> bool:
    """Return True if a configured host name or address refers to this machine. Blocks like `addresses_of`."""
    return is_loopback(host) or any(has_address(found) for found in addresses_of(host))


def own_addresses() -> list[str]:
    """Return this machine's IPv4 addresses: loopback, those of its host name, and that of the default route.

    Blocks like `addresses_of`.
    """
    named = (found for found in addresses_of(socket.gethostname()) if ":" not in found)
    unreachable = _DOCUMENTATION_ADDRESSES[socket.AF_INET]
    routed = _source_towards(socket.AF_INET, unreachable) or LOOPBACK
    return list(dict.fromkeys([LOOPBACK, *named, routed]))


def own_address() -> str:
    """Return the first address that other machines can reach, or loopback. Blocks like `addresses_of`."""
    return next((found for found in own_addresses() if not is_loopback(found)), LOOPBACK)


def addresses_of(host: str, lookups: Lookups | None = None) -> tuple[str, ...]:
    """Return the IP addresses of a host name or address.

    The result is empty if the name was not resolved within `LOOKUP_S`. Blocks, so do not call this in an
    event loop.
    """
    deadline = time.monotonic() + LOOKUP_S
    try:
        found = (lookups or process_lookups()).find(host, None, deadline=deadline, type=socket.SOCK_STREAM)
    except OSError:
        return ()
    return tuple(dict.fromkeys(plain_address(str(address[0])) for *_, address in found))


def listening_addresses(port: int) -> list[str]:
    """Return the IPv4 addresses, except `0.0.0.0`, at which a program listens on this port. Linux only."""
    entries = [end.local.split(":") for end in _socket_table() if end.state == _LISTENING]
    hosts = [int(host, 16) for host, number in entries if len(host) == 8 and int(number, 16) == port]
    return [socket.inet_ntoa(host.to_bytes(4, sys.byteorder)) for host in hosts if host]


class _SocketEnd(NamedTuple):
    """An entry in Linux's table of TCP sockets."""

    local: str
    remote: str
    state: str
    user: int
    inode: str


def _socket_table() -> Iterator[_SocketEnd]:
    """Yield all TCP sockets on this machine; none on systems other than Linux."""
    for table in _SOCKET_TABLES:
        try:
            lines = table.read_text().splitlines()[1:]
        except OSError:  # the system has no IPv6, or no /proc
            continue
        for line in lines:
            _, local, remote, state, _, _, _, user, _, inode, *_ = line.split()
            yield _SocketEnd(local, remote, state, int(user), inode)


def _source_towards(family: socket.AddressFamily, host: str) -> str | None:
    try:
        with socket.socket(family, socket.SOCK_DGRAM) as probe:  # this sends nothing; it only selects a route
            probe.connect((host, _DISCARD_PORT))
            return plain_address(str(probe.getsockname()[0]))
    except OSError:
        return None


def _can_bind(family: socket.AddressFamily, host: str) -> bool:
    try:
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.bind((host, 0))
    except OSError:
        return False
    return True


def _mapped(host: str) -> str:
    """Return an IPv4 address in the IPv6 form that a dual-stack socket reports."""
    return host if ":" in host else f"::ffff:{host}"


def _table_entry(host: str, port: int) -> str:
    """Return an address in the format of `/proc/net/tcp`: 32-bit words in host byte order."""
    packed = socket.inet_pton(socket.AF_INET6 if ":" in host else socket.AF_INET, host)
    words = (int.from_bytes(packed[start : start + 4], sys.byteorder) for start in range(0, len(packed), 4))
    return f"{''.join(f'{word:08X}' for word in words)}:{port:04X}"
