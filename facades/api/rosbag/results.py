"""What the methods of `rosbag.Bag` give."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from rospy.rostime import Time


class BagMessage(NamedTuple):
    """What `read_messages` gives. The message is a tuple when it was asked for raw."""

    topic: str
    message: Any
    timestamp: Time


class BagMessageWithConnectionHeader(NamedTuple):
    """What `read_messages` gives with `return_connection_header`."""

    topic: str
    message: Any
    timestamp: Time
    connection_header: Mapping[str, bytes]


class TopicTuple(NamedTuple):
    """A topic: `frequency` is None if it is not known."""

    msg_type: str
    message_count: int
    connections: int
    frequency: float | None


class TypesAndTopicsTuple(NamedTuple):
    """The md5sums of types by their names, and the topics by theirs."""

    msg_types: dict[str, str]
    topics: dict[str, TopicTuple]


class CompressionTuple(NamedTuple):
    """The most frequent compression of the chunks, and the bytes of all chunks."""

    compression: str
    uncompressed: int
    compressed: int
