"""The networks that may connect to a master."""

from __future__ import annotations

import ipaddress
from collections.abc import Sequence

from pipros.net.this_machine import ThisMachineCaller


class AllowedNetworks:
    """The networks from which callers may connect. Callers on this machine may always connect.

    >>> allowed = AllowedNetworks(["10.0.0.0/8", "192.168.1.7"])
    >>> str(allowed)
    '10.0.0.0/8, 192.168.1.7/32'
    """

    def __init__(self, networks: Sequence[str]) -> None:
        """Parse the networks. Raises ValueError if one is invalid."""
        self._networks = [_network(network) for network in networks]

    def admits(self, caller: ThisMachineCaller) -> bool:
        """Return whether a caller is in one of the networks, or on this machine."""
        try:
            ip = ipaddress.ip_address(caller.host)
        except ValueError:
            return False
        return any(ip in network for network in self._networks) or caller.is_here

    def __str__(self) -> str:
        return ", ".join(map(str, self._networks))


def _network(text: str) -> ipaddress.IPv4Network | ipaddress.IPv6Network:
    try:
        return ipaddress.ip_network(text, strict=False)
    except ValueError:
        raise ValueError(f"an allowed network must be like 10.0.0.0/8 or 10.0.0.7, got [{text}]") from None
