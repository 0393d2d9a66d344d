"""The limits of the servers for rosbridge and Foxglove."""

from typing import NamedTuple

_MIB = 1024 * 1024


class BridgeLimits(NamedTuple):
    """The limits of the servers for rosbridge and Foxglove.

    Get them with `limits.of(BridgeLimits)`, where `limits` is a `Limits`. Each limit is a maximum.

    Attributes:
        bridge_clients: clients of a server, for rosbridge and Foxglove together.
        bridge_queue_bytes: the messages and responses queued for one client.
        bridge_message_bytes: a message from a client.
        bridge_client_rate: messages per second that a client may send; faster clients are slowed down.
        bridge_client_rate_bytes: bytes per second that a client may send; faster clients are slowed down.
    """

    bridge_clients: int = 250
    bridge_queue_bytes: int = 16 * _MIB
    bridge_message_bytes: int = 10 * _MIB
    bridge_client_rate: int = 10_000
    bridge_client_rate_bytes: int = 256 * _MIB
