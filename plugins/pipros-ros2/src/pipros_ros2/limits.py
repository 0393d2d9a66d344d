"""The limits of gateways to ROS 2."""

from typing import NamedTuple

_MIB = 1024 * 1024


class Ros2Limits(NamedTuple):
    """The limits of gateways to ROS 2. Get them with `limits.of(Ros2Limits)`, where `limits` is a `Limits`.

    Attributes:
        ros2_topics: maximum number of topics, services and actions that a gateway bridges in total.
        ros2_sample_bytes: maximum size of a message from ROS 2.
        ros2_backlog_bytes: maximum size of the datagrams that a participant has read but not yet handled.
    """

    ros2_topics: int = 1000
    ros2_sample_bytes: int = 128 * _MIB
    ros2_backlog_bytes: int = 64 * _MIB
