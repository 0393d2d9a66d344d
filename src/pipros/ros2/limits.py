"""The limits of gateways to ROS 2."""

from typing import NamedTuple

_MIB = 1024 * 1024


class Ros2Limits(NamedTuple):
    """The limits of gateways to ROS 2. `limits.of(Ros2Limits)` returns those in a `Limits` object.

    Attributes:
        ros2_topics: topics, services and actions that a gateway bridges.
        ros2_calls: calls of one service or action that a gateway has open at a time.
        ros2_definition_bytes: definitions of ROS 1 types that are not installed.
        zenoh_message_bytes: a message from ROS 2 through Zenoh, and all static transforms of ROS 2.
        ros2_discovery_bytes: all stored announcements of ROS 2 participants and endpoints.
        ros2_peer_bytes: the announcements of one participant.
        ros2_graph_bytes: the endpoints of other processes that a gateway to ROS 2 remembers.
        ros2_sample_bytes: a message from ROS 2.
        ros2_incomplete_bytes: fragments and early messages of one participant, until they are complete.
        ros2_incomplete_total_bytes: fragments and early messages of all participants together.
        ros2_history_bytes: the messages that one writer keeps for ROS 2 readers.
        ros2_backlog_bytes: datagrams from ROS 2 that a participant has read but not yet handled.
        ros2_inbox_bytes: ROS 2 messages that are queued for one callback, or requests queued for one service.
    """

    ros2_topics: int = 1000
    ros2_calls: int = 64
    ros2_definition_bytes: int = 16 * _MIB
    zenoh_message_bytes: int = 64 * _MIB
    ros2_discovery_bytes: int = 32 * _MIB
    ros2_peer_bytes: int = 4 * _MIB
    ros2_sample_bytes: int = 128 * _MIB
    ros2_incomplete_bytes: int = 256 * _MIB
    ros2_incomplete_total_bytes: int = 512 * _MIB
    ros2_history_bytes: int = 256 * _MIB
    ros2_backlog_bytes: int = 64 * _MIB
    ros2_inbox_bytes: int = 256 * _MIB
    ros2_graph_bytes: int = 16 * _MIB
