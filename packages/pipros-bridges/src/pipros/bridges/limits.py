"""The limits of the servers for rosbridge and Foxglove."""

from typing import NamedTuple

_MIB = 1024 * 1024


class BridgeLimits(NamedTuple):
    """The limits of the servers for rosbridge and Foxglove.

    Get them with `limits.of(BridgeLimits)`, where `limits` is a `Limits`. Each limit is a maximum.

    Attributes:
        bridge_clients: clients of a server, for rosbridge and Foxglove together.
        bridge_topics: topics that all clients of one protocol receive together; also topics that all
            rosbridge clients publish together.
        bridge_subscriptions: subscriptions of one client; also the topics and services that it advertises.
        bridge_queue_bytes: the messages and responses queued for one client.
        bridge_message_bytes: a message from a client.
        bridge_reader_bytes: a message from a client that may not change the system.
        bridge_parsed_bytes: the approximate memory for a client's parsed message, and also for the requests
            of its pending service calls; a quarter of it for a client that may not change the system. In
            addition, the memory for a client's published messages that are kept for later subscribers.
        bridge_asset_bytes: an asset that a Foxglove client fetches. All assets that are being sent may
            together be twice as large.
        bridge_kept_bytes: the names and ids that a server stores for one client.
        bridge_client_bytes: everything that a server holds for one client: incomplete, parsed, queued and
            latched messages, names and ids. The sum of `bridge_queue_bytes` and three times
            `bridge_message_bytes` applies instead if it is larger.
        bridge_total_bytes: the same for all clients of a server together, in addition to 256 KiB per client.
            Twice the sum above applies instead if it is larger. A client may use at most half of the memory
            that the other clients leave free.
        bridge_stall_s: the time after which a client that does not read from a full connection is
            disconnected.
        bridge_client_rate: messages per second that a client may send; faster clients are slowed down.
        bridge_client_rate_bytes: bytes per second that a client may send; faster clients are slowed down.
    """

    bridge_clients: int = 250
    bridge_topics: int = 1000
    bridge_subscriptions: int = 2000
    bridge_queue_bytes: int = 16 * _MIB
    bridge_message_bytes: int = 10 * _MIB
    bridge_reader_bytes: int = 1 * _MIB
    bridge_parsed_bytes: int = 32 * _MIB
    bridge_asset_bytes: int = 48 * _MIB
    bridge_kept_bytes: int = 4 * _MIB
    bridge_client_bytes: int = 48 * _MIB
    bridge_total_bytes: int = 160 * _MIB
    bridge_stall_s: float = 10.0
    bridge_client_rate: int = 10_000
    bridge_client_rate_bytes: int = 256 * _MIB
