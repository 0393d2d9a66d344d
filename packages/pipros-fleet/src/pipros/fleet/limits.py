"""The limits of fleets."""

from typing import NamedTuple

_KIB = 1024
_MIB = 1024 * 1024


class FleetLimits(NamedTuple):
    """The limits of fleets. Get them with `limits.of(FleetLimits)`, where `limits` is a `Limits`.

    Attributes:
        fleet_file_bytes: maximum size of a member's YAML file.
        fleet_members: maximum number of other members that a member shows.
        fleet_topics: maximum number of topics and services of these members, in total.
        fleet_directory_bytes: maximum size of a member's directory of the topics and services that it offers.
        fleet_message_bytes: maximum size of a message, request or reply on a fleet link, both compressed and
            decompressed.
        fleet_queue_bytes: maximum total size of the messages waiting to be sent over a fleet link, or to be
            recorded by a router.
        fleet_latched_bytes: maximum total size of the latched messages that a member keeps for others,
            or that a router repeats in its history.
        fleet_definition_bytes: maximum total size of the other members' message definitions that a member
            keeps, or that a router keeps for its history.
        fleet_history_files: maximum number of files in a router's history, for all members together.
        fleet_calls: maximum number of calls from other members that a member handles at a time; also of
            pending calls to one service of another member.
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
