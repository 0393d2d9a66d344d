"""The limits of fleets."""

from typing import NamedTuple

_KIB = 1024
_MIB = 1024 * 1024


class FleetLimits(NamedTuple):
    """The limits of fleets. `limits.of(FleetLimits)` returns those in a `Limits` object.

    Attributes:
        fleet_file_bytes: a fleet member's YAML file.
        fleet_members: other members of a fleet that a member shows.
        fleet_topics: topics and services of these members, in total.
        fleet_directory_bytes: a member's directory of the topics and services that it offers.
        fleet_message_bytes: a message, a request or a reply on a fleet link, compressed or decompressed.
        fleet_queue_bytes: messages waiting to be sent over a fleet link.
        fleet_latched_bytes: latched messages that a member keeps for others.
        fleet_definition_bytes: the other members' message definitions that a member keeps, or that a router
            keeps for its history.
        fleet_history_files: files in a router's history, for all members together.
        fleet_calls: calls from other members that a member handles at a time.
    """

    fleet_file_bytes: int = 256 * _KIB
    fleet_members: int = 1000
    fleet_topics: int = 5000
    fleet_directory_bytes: int = 4 * _MIB
    fleet_message_bytes: int = 64 * _MIB
    fleet_queue_bytes: int = 32 * _MIB
    fleet_latched_bytes: int = 64 * _MIB
    fleet_definition_bytes: int = 64 * _MIB
    fleet_history_files: int = 10_000
    fleet_calls: int = 64
