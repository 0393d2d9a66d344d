"""The limits of gateways to ROS 2."""

from typing import NamedTuple

_MIB = 1024 * 1024


class Ros2Limits(NamedTuple):
    """The limits of gateways to ROS 2. Get them with `limits.of(Ros2Limits)`, where `limits` is a `Limits`.

    `ros2_topics` and `ros2_calls` are maximum numbers; all others are maximum sizes.

    Attributes:
        ros2_topics: topics, services and actions that a gateway bridges in total.
        ros2_calls: calls or goals that a gateway forwards at a time to one ROS 2 service or action.
        ros2_definition_bytes: all definitions of ROS 1 types that are not installed.
        zenoh_message_bytes: a message from ROS 2 through Zenoh; also a message that contains all static
            transforms.
        ros2_discovery_bytes: all stored announcements of ROS 2 participants and endpoints.
        ros2_peer_bytes: the stored announcements of one participant.
        ros2_graph_bytes: all endpoints of other processes that a gateway on Zenoh stores.
        ros2_sample_bytes: a message from ROS 2.
        ros2_incomplete_bytes: the fragments and early messages of one participant, until they are complete.
        ros2_incomplete_total_bytes: the fragments and early messages of all participants together.
        ros2_history_bytes: the messages that one writer keeps for ROS 2 readers; also the latched messages of
            a ROS 2 topic, and the results of a ROS 1 action.
        ros2_backlog_bytes: the datagrams from ROS 2 that a participant has read but not yet handled.
        ros2_inbox_bytes: the ROS 2 messages queued for one callback, or the requests queued for one service.
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
