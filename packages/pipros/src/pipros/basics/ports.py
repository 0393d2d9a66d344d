"""The ports that the nodes of a process may open, and the address at which peers reach them.

`PIPROS_PORTS=11400-11420` limits the nodes to a range. `PIPROS_ADVERTISE` is for nodes that peers reach at an
address other than the bound address, such as nodes in a container or behind a router. Its value is `HOST` if
the ports are the same, `HOST:31400-31420` to map these ports to those in `PIPROS_PORTS` in the same order, or
`HOST:31400-31420=11400-11420,21311=11311` to map each advertised range to a range of bound ports.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from pipros.basics.graph_variables import InvalidEnvironment
from pipros.basics.uri import host_and_port, split_uri

PORTS = "PIPROS_PORTS"
ADVERTISE = "PIPROS_ADVERTISE"

_ENTRIES_LIMIT = 1_000


class PortRange:
    """The ports from `first` to `last`, inclusive."""

    __slots__ = ("first", "last")

    def __init__(self, first: int, last: int) -> None:
        self.first = first
        self.last = last

    def __repr__(self) -> str:
        return f"PortRange(first={self.first}, last={self.last})"

    @classmethod
    def parse(cls, text: str, source: str = PORTS) -> PortRange:
        """Read `11400-11420`, or a single port.

        Raises:
            InvalidEnvironment: the text is malformed, a port is not from 1 to 65535, or the range is empty.
                The error names `source`.

        >>> PortRange.parse("11400-11420")
        PortRange(first=11400, last=11420)
        """
        first, dash, last = (part.strip() for part in text.partition("-"))
        if not dash:
            last = first
        if not all(part.isascii() and part.isdecimal() and len(part) <= 5 for part in (first, last)):
            raise InvalidEnvironment(
                f"{source} [{text}] must have the form FIRST-LAST or PORT, for example 11400-11420"
            )
        if not 0 < int(first) <= int(last) <= 65535:
            raise InvalidEnvironment(
                f"{source} [{text}] must be a range within 1 to 65535, with the smaller port first"
            )
        return cls(int(first), int(last))

    def __contains__(self, port: object) -> bool:
        return isinstance(port, int) and self.first <= port <= self.last

    def __iter__(self) -> Iterator[int]:
        return iter(range(self.first, self.last + 1))

    def __len__(self) -> int:
        return self.last - self.first + 1

    def __str__(self) -> str:
        return f"{self.first}-{self.last}" if len(self) > 1 else f"{self.first}"


class AdvertisedAddress(NamedTuple):
    """The host at which peers reach a process, and the mapping of advertised ports to bound ports.

    Attributes:
        host: a host name or an IP address.
        ports: pairs of ranges of equal length: the advertised ports, and the bound ports.
    """

    host: str
    ports: tuple[tuple[PortRange, PortRange], ...] = ()

    @classmethod
    def parse(cls, text: str, ports: PortRange | None) -> AdvertisedAddress:
        """Read the value of `PIPROS_ADVERTISE`.

        Args:
            text: see the module docstring.
            ports: the ports that nodes may open; None if nodes may open any port.

        Raises:
            InvalidEnvironment: the text is malformed, lists advertised ports without bound ports while
                `ports` is None, or maps a range to one of a different length.
        """
        host, entries = _split_host(text.strip())
        try:
            split_uri(f"http://{host_and_port(host, 1)}/")
        except ValueError:
            raise InvalidEnvironment(
                f"{ADVERTISE} [{text}] must have the form HOST, HOST:PORTS or HOST:PORTS=BOUND_PORTS, "
                "for example robot.example:31400-31420=11400-11420"
            ) from None
        pairs = []
        for entry in entries.split(",", _ENTRIES_LIMIT) if entries else ():
            outer, equals, inner = entry.partition("=")
            outside = PortRange.parse(outer, ADVERTISE)
            inside = PortRange.parse(inner, ADVERTISE) if equals else ports
            if inside is None:
                raise InvalidEnvironment(
                    f"{ADVERTISE} [{text}] must map {outside} to bound ports: set {PORTS}, or write "
                    f"{host_and_port(host, outside.first)}=PORT"
                )
            if len(outside) != len(inside):
                raise InvalidEnvironment(
                    f"{ADVERTISE} [{text}]: {outside} and {inside} must have the same number of ports"
                )
            pairs.append((outside, inside))
        return cls(host, tuple(pairs))

    def outside(self, port: int) -> tuple[str, int]:
        """Return the host and port at which peers reach a bound port.

        If the port is not listed, its number does not change.
        """
        for outer, inner in self.ports:
            if port in inner:
                return self.host, outer.first + port - inner.first
        return self.host, port

    def inside(self, port: int) -> int | None:
        """Return the bound port for an advertised port, or None if the port is not listed."""
        for outer, inner in self.ports:
            if port in outer:
                return inner.first + port - outer.first
        return None


def _split_host(text: str) -> tuple[str, str]:
    """Split a value into `HOST` and the list of ports. An IPv6 address followed by ports is in brackets."""
    if text.startswith("["):
        host, _, ports = text[1:].partition("]")
        return host, ports.removeprefix(":")
    if text.count(":") > 1:
        return text, ""
    host, _, ports = text.partition(":")
    return host, ports
