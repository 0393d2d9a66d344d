"""Discovery of participants: domains, ports, and ROS 2's environment variables."""

from __future__ import annotations

import ipaddress
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Final

from pipros.basics.graph_variables import InvalidEnvironment

MULTICAST_GROUP: Final = "239.255.0.1"
MAX_DOMAIN: Final = 101
"""The highest supported domain. The ports of higher domains are in Linux's ephemeral port range."""
PROBED_PARTICIPANTS: Final = 33
"""Number of participants to look for on a host without multicast, as in ROS 2."""

_PORT_BASE, _DOMAIN_GAIN, _PARTICIPANT_GAIN = 7400, 250, 2
_DISCOVERY_OFFSET, _DATA_OFFSET = 10, 11
MAX_PARTICIPANT: Final = (_DOMAIN_GAIN - _DATA_OFFSET) // _PARTICIPANT_GAIN


class DiscoveryRange(Enum):
    """The values of `ROS_AUTOMATIC_DISCOVERY_RANGE`. SYSTEM_DEFAULT means SUBNET."""

    OFF = "OFF"
    LOCALHOST = "LOCALHOST"
    SUBNET = "SUBNET"


@dataclass(frozen=True, slots=True)
class Discovery:
    """Settings that determine which participants are found.

    Attributes:
        static_peers: further host names or addresses to contact; ignored if the range is OFF.
    """

    domain: int = 0
    range: DiscoveryRange = DiscoveryRange.LOCALHOST
    static_peers: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not 0 <= self.domain <= MAX_DOMAIN:
            raise InvalidEnvironment(f"the ROS 2 domain must be from 0 to {MAX_DOMAIN}, got {self.domain}")

    @property
    def reaches_out(self) -> bool:
        """Whether participants on other machines can be reached, and can reach this one."""
        if self.range is DiscoveryRange.OFF:
            return False
        return self.range is DiscoveryRange.SUBNET or not all(map(_is_loopback, self.static_peers))

    @classmethod
    def from_environment(cls, variables: Mapping[str, str]) -> Discovery:
        """Read `ROS_DOMAIN_ID`, `ROS_AUTOMATIC_DISCOVERY_RANGE`, `ROS_LOCALHOST_ONLY`, `ROS_STATIC_PEERS`.

        If they are set, the variables have the same meanings as in ROS 2. If neither the range nor
        `ROS_LOCALHOST_ONLY` is set, the range is LOCALHOST, whereas it is SUBNET in ROS 2.

        Raises:
            InvalidEnvironment: a variable has an invalid value.
        """
        domain = variables.get("ROS_DOMAIN_ID") or "0"
        if not domain.isascii() or not domain.isdigit():
            raise InvalidEnvironment(
                f"the ROS 2 domain (--domain or ROS_DOMAIN_ID) must be a whole number >= 0, got [{domain}]"
            )
        peers = variables.get("ROS_STATIC_PEERS", "").split(";")
        return cls(int(domain), _range_of(variables), tuple(filter(None, map(str.strip, peers))))


def _is_loopback(host: str) -> bool:
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _range_of(variables: Mapping[str, str]) -> DiscoveryRange:
    localhost_only = variables.get("ROS_LOCALHOST_ONLY", "")
    if localhost_only == "1":
        return DiscoveryRange.LOCALHOST
    named = variables.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "")
    if not named:
        return DiscoveryRange.SUBNET if localhost_only == "0" else DiscoveryRange.LOCALHOST
    if named == "SYSTEM_DEFAULT":
        return DiscoveryRange.SUBNET
    try:
        return DiscoveryRange(named)
    except ValueError:
        known = ", ".join([*(each.value for each in DiscoveryRange), "SYSTEM_DEFAULT"])
        raise InvalidEnvironment(
            f"ROS_AUTOMATIC_DISCOVERY_RANGE must be one of {known}, got [{named}]"
        ) from None


def multicast_port(domain: int) -> int:
    """Return the port for multicast announcements of participants."""
    return _PORT_BASE + _DOMAIN_GAIN * domain


def discovery_port(domain: int, participant: int) -> int:
    """Return the port at which a participant receives announcements.

    The participants on a host are numbered from 0.

    >>> discovery_port(1, 3)
    7666
    """
    return _PORT_BASE + _DOMAIN_GAIN * domain + _DISCOVERY_OFFSET + _PARTICIPANT_GAIN * participant


def data_port(domain: int, participant: int) -> int:
    """Return the port at which a participant receives samples."""
    return discovery_port(domain, participant) + _DATA_OFFSET - _DISCOVERY_OFFSET
