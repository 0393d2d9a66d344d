"""The limits of fleets."""

from typing import NamedTuple

_MIB = 1024 * 1024


class FleetLimits(NamedTuple):
    """The limits of fleets. Get them with `limits.of(FleetLimits)`, where `limits` is a `Limits`.

    Attributes:
        fleet_message_bytes: maximum size of a message, request or reply on a fleet link, both compressed and
            decompressed.
        fleet_queue_bytes: maximum total size of the messages waiting to be sent over a fleet link, or to be
            recorded by a router.
    """

    fleet_message_bytes: int = 64 * _MIB
    fleet_queue_bytes: int = 32 * _MIB
