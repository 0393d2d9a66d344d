"""The UDP sockets of a participant."""

from __future__ import annotations

import contextlib
import math
import socket
import sys
from collections import deque
from collections.abc import Iterable
from struct import Struct
from typing import Final

from pipros.basics.errors import Unreachable
from pipros.basics.turns import Turns
from pipros.net.address import ANY, LOOPBACK
from pipros.net.this_machine import addresses_of, own_addresses
from pipros_ros2.rtps.domain import (
    MAX_PARTICIPANT,
    MULTICAST_GROUP,
    PROBED_PARTICIPANTS,
    Discovery,
    DiscoveryRange,
    data_port,
    discovery_port,
    multicast_port,
)
from pipros_ros2.rtps.outbox import Outgoing
from pipros_ros2.rtps.parameters import Address

_RECEIVE_BUFFER_BYTES: Final = 8 << 20
"""Requested size; the system often grants 208 KiB (net.core.rmem_max)."""
_MAX_REQUEST_BYTES: Final = 256_000
"""Cyclone DDS keeps no more than 200 fragments, of 1,344 bytes each, in its retransmission queue."""
_MAX_DATAGRAM: Final = 65_536
_DATAGRAM_OVERHEAD_BYTES: Final = 200
_SIOCGIFADDR: Final = 0x8915
_INTERFACE_REQUEST: Final = Struct("256s")


def interface_addresses() -> list[str]:
    """Return the IPv4 addresses of all interfaces, loopback last. On Linux, no host name is looked up."""
    found: list[str] = []
    if sys.platform == "linux":
        import fcntl

        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            for _, name in socket.if_nameindex():
                with contextlib.suppress(OSError):  # the interface has no address
                    request = _INTERFACE_REQUEST.pack(name.encode())
                    answer = fcntl.ioctl(probe.fileno(), _SIOCGIFADDR, request)
                    found.append(socket.inet_ntoa(answer[20:24]))
    else:
        found = own_addresses()
    return sorted(set(found), key=lambda address: (address.startswith("127."), address))


class RtpsSockets:
    """The sockets of one participant: for discovery, for samples, and for multicast.

    Attributes:
        discovery, data: the addresses to announce.
        announce_to: addresses at which other participants may be found.
        local_hosts: this machine's addresses.
        receiving: the sockets to read.
        static_hosts: the addresses of the static peers.
        request_bytes: maximum number of bytes to request at a time. The requested data fits into the receive
            buffer, where a datagram takes up to 1.7 times its size.
    """

    def __init__(self, where: Discovery) -> None:
        """Open the sockets on the first free ports of the domain.

        Raises:
            Unreachable: all ports of the domain are in use.
        """
        self._group = Address(MULTICAST_GROUP, multicast_port(where.domain))
        reaches_out = where.reaches_out
        interfaces = interface_addresses()
        host = ANY if reaches_out else LOOPBACK
        participant, meta, data = _bind_pair(where.domain, host)
        self._meta = meta
        self.receiving = [meta, data]
        buffer_bytes = data.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
        self.request_bytes = min(buffer_bytes * 3 // 5, _MAX_REQUEST_BYTES)
        hosts = [each for each in interfaces if not each.startswith("127.")] if reaches_out else []
        hosts = hosts or [LOOPBACK]
        self.discovery = tuple(Address(each, discovery_port(where.domain, participant)) for each in hosts)
        self.data = tuple(Address(each, data_port(where.domain, participant)) for each in hosts)
        self.local_hosts = frozenset(interfaces)
        self._interfaces = hosts
        static: list[str] = []
        probed = [LOOPBACK] if where.range is not DiscoveryRange.OFF else []
        announce_to: list[Address] = []
        if where.range is not DiscoveryRange.OFF:
            static = [found for peer in where.static_peers for found in _ipv4(peer)]
        self.static_hosts = frozenset(static)
        probed += static
        if where.range is DiscoveryRange.SUBNET:
            announce_to.append(self._group)
            self.receiving.append(_multicast_socket(self._group, hosts))
        own = discovery_port(where.domain, participant)
        for address in dict.fromkeys(probed):
            ports = (discovery_port(where.domain, number) for number in range(PROBED_PARTICIPANTS))
            is_own = address in self.local_hosts or address == LOOPBACK
            announce_to += [Address(address, port) for port in ports if not (is_own and port == own)]
        self.announce_to = tuple(announce_to)

    def send(self, datagrams: Iterable[Outgoing]) -> None:
        """Send datagrams. Those that the system refuses are lost, as if the network had dropped them."""
        for address, parts in datagrams:
            if address == self._group:
                self._send_to_group(parts)
                continue
            with contextlib.suppress(OSError):
                _send(self._meta, parts, address)

    def _send_to_group(self, parts: tuple[bytes | memoryview, ...]) -> None:
        for interface in self._interfaces:
            with contextlib.suppress(OSError):
                self._meta.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(interface))
                _send(self._meta, parts, self._group)

    def close(self) -> None:
        for each in self.receiving:
            each.close()


def _send(through: socket.socket, parts: tuple[bytes | memoryview, ...], address: Address) -> None:
    if sys.platform == "win32":
        through.sendto(b"".join(parts), address)
    else:
        through.sendmsg(parts, (), 0, address)


class SocketBacklog:
    """Datagrams that were read but not yet handled.

    Handling takes longer than reading, and the system's buffers are small: often 208 KiB, enough for only
    14 of the datagrams in which Cyclone DDS sends images. Therefore, the sockets are read repeatedly while
    datagrams are handled.
    """

    def __init__(self, limit_bytes: int) -> None:
        """Create an empty backlog.

        Each sender may use at most half of the space in `limit_bytes` that other senders are not using, but
        always one datagram if the backlog is not full.
        """
        self._limit_bytes = limit_bytes
        self._bytes = 0
        self._bytes_of: dict[tuple[str, int], int] = {}
        self._read_at = -math.inf
        # for each call of `read`: its time, and the number of its datagrams that `next` has not returned
        self._times: deque[list[float]] = deque()
        self._turns: Turns[tuple[str, int], tuple[bytes, list[float]]] = Turns()

    def __bool__(self) -> bool:
        return bool(self._turns)

    @property
    def handled_until(self) -> float:
        """A time such that all datagrams that were read before it have been returned by `next`."""
        while self._times and not self._times[0][1]:
            self._times.popleft()
        return self._times[0][0] if self._times else self._read_at

    def read(self, sources: Iterable[socket.socket], now: float) -> None:
        """Read the datagrams that have arrived, up to the limit. The system may drop further ones.

        A sender's datagrams beyond its part of the limit are dropped.
        """
        time: list[float] = [now, 0]
        for source in sources:
            while self._bytes < self._limit_bytes:
                try:
                    datagram, sender = source.recvfrom(_MAX_DATAGRAM)
                except OSError:  # no datagram is waiting, or an earlier one caused an ICMP error
                    break
                size, held = len(datagram) + _DATAGRAM_OVERHEAD_BYTES, self._bytes_of.get(sender, 0)
                if held and 2 * (held + size) > self._limit_bytes - self._bytes + held:
                    continue
                self._turns.put(sender, (datagram, time))
                self._bytes_of[sender] = held + size
                self._bytes += size
                time[1] += 1
        if time[1]:
            self._times.append(time)
        self._read_at = now

    def next(self) -> tuple[bytes, str] | None:
        """Return the next datagram and the host that sent it, or None if there is no datagram.

        The senders take turns, so that a flood of one delays only its own datagrams.
        """
        if not self._turns:
            return None
        sender, (datagram, time) = self._turns.pop()
        time[1] -= 1
        size = len(datagram) + _DATAGRAM_OVERHEAD_BYTES
        self._bytes -= size
        left = self._bytes_of.pop(sender) - size
        if left:
            self._bytes_of[sender] = left
        return datagram, str(sender[0])


def _ipv4(peer: str) -> list[str]:
    return [address for address in addresses_of(peer) if ":" not in address]


def _bind_pair(domain: int, host: str) -> tuple[int, socket.socket, socket.socket]:
    """Return the first free participant number on this machine, and two sockets bound to its ports."""
    for participant in range(MAX_PARTICIPANT + 1):
        ports = discovery_port(domain, participant), data_port(domain, participant)
        opened: list[socket.socket] = []
        try:
            for port in ports:
                opened.append(_udp_socket())
                opened[-1].bind((host, port))
        except OSError:
            for each in opened:
                each.close()
            continue
        return participant, opened[0], opened[1]
    raise Unreachable(
        f"domain {domain}", f"all ports of its {MAX_PARTICIPANT + 1} participants are in use on this machine"
    )


def _udp_socket() -> socket.socket:
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    opened.setblocking(False)
    opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER_BYTES)
    return opened


def _multicast_socket(group: Address, interfaces: list[str]) -> socket.socket:
    opened = _udp_socket()
    opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    opened.bind((ANY if sys.platform == "win32" else group.host, group.port))
    for interface in interfaces:
        with contextlib.suppress(OSError):  # the interface does not support multicast
            membership = socket.inet_aton(group.host) + socket.inet_aton(interface)
            opened.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
    return opened
