"""Results of the methods of `rosbag.Bag`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from rospy.rostime import Time


class BagMessage(NamedTuple):
    """Item of `read_messages`. `message` is a tuple if `raw` was requested."""

    topic: str
    message: Any
    timestamp: Time


class BagMessageWithConnectionHeader(NamedTuple):
    """Item of `read_messages(return_connection_header=True)`. `message` is a tuple if `raw` was requested."""

    topic: str
    message: Any
    timestamp: Time
    connection_header: Mapping[str, bytes]


class TopicTuple(NamedTuple):
    """Summary of a topic. `frequency` is in Hz, or None if unknown."""

    msg_type: str
    message_count: int
    connections: int
    frequency: float | None


class TypesAndTopicsTuple(NamedTuple):
    """MD5 sums by message type, and topic summaries by topic name."""

    msg_types: dict[str, str]
    topics: dict[str, TopicTuple]


class CompressionTuple(NamedTuple):
    """Most common compression format of the chunks, and their total sizes in bytes."""

    compression: str
    uncompressed: int
    compressed: int
