"""Interface of the storage formats for ROS 2 bags."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from pipros_rosbag2.bags.metadata import Profiles
from pipros_tools.bag.mcap_messages import OnDamage


@dataclass(frozen=True, slots=True)
class StoredTopic:
    """A topic in a file. `id` is its number in that file, and `qos` its QoS profiles, as text."""

    id: int
    name: str
    type: str
    encoding: str
    is_latched: bool
    qos: str = ""


@dataclass(frozen=True, slots=True)
class NewTopic:
    """A topic to be written, with the definitions of its type and of all embedded types."""

    name: str
    type: str
    definition: str
    type_hash: str
    qos: Profiles


class StorageReader(Protocol):
    """A file open for reading."""

    @property
    def topics(self) -> Sequence[StoredTopic]: ...

    @property
    def definitions(self) -> Mapping[str, str]:
        """The `ros2msg` definitions, by type. May be empty."""

    @property
    def count_by_topic(self) -> Mapping[int, int]: ...

    @property
    def range_ns(self) -> tuple[int, int] | None:
        """The times of the first and the last message in ns; None if the file has no messages."""

    def messages(
        self, topics: Collection[int], first_ns: int, last_ns: int, on_damage: OnDamage
    ) -> Iterator[tuple[int, int, Any, int, int]]:
        """Yield the messages in a time range, in time order.

        The values are the topic ID, time in ns, CDR data, and sequence number and publish time in ns, or 0.

        The range includes `first_ns` and `last_ns`. Messages with invalid times follow, some of each topic.
        `on_damage` is called with the topic IDs of each chunk that is left out, and may raise the error.
        """

    def close(self) -> None: ...


class StorageWriter(Protocol):
    """A file open for writing."""

    def add_topic(self, topic: NewTopic) -> int:
        """Add a topic, and return its number."""

    def write(
        self, topic: int, time_ns: int, cdr: bytes, sequence: int = 0, published_ns: int = 0
    ) -> None: ...

    def finish(self, metadata: str) -> None:
        """Write the end of the file, with a copy of the metadata, and close it."""

    def close(self) -> None:
        """Close the file without finishing it."""
