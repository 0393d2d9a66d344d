"""ROS 2 MCAP files, the default since Iron (https://mcap.dev/spec/registry, profile `ros2`)."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

from pipros.basics.input_file import open_file
from pipros.basics.limits import process_limits
from pipros_rosbag2.bags.metadata import is_latched, qos_text
from pipros_rosbag2.bags.storage import NewTopic, StoredTopic
from pipros_rosbag2.distribution import Distribution
from pipros_tools.bag.errors import BagError, BagFormatError, NotIndexed
from pipros_tools.bag.mcap_files import (
    COMPRESSIONS,
    add_record,
    copy_beside,
    count_beside,
    mcap_library,
    summary_of,
    translated,
)
from pipros_tools.bag.mcap_messages import McapMessages, OnDamage
from pipros_tools.bag.mcap_records import read_profile
from pipros_tools.bag.source import Source

_ENCODINGS = ("ros2msg",)
_CHUNK_BYTES = 1024 * 1024


class McapStorage:
    """An MCAP file open for reading.

    Raises:
        NotIndexed: the file has no summary.
        BagError: the library `mcap` is missing, or the file is damaged.
    """

    def __init__(self, path: Path) -> None:
        mcap_library()
        self._limits = process_limits()
        self._file = open_file(path)
        try:
            self._source = Source(self._file, os.fspath(path))
            self._summary = summary_of(self._source)
            schemas, channels = self._summary.schemas, self._summary.channels
            self.topics = [self._topic(each, schemas.get(each.schema_id)) for each in channels.values()]
            self.definitions: Mapping[str, str] = {
                schema.name: bytes(schema.data).decode("utf-8", "replace")
                for schema in schemas.values()
                if schema.encoding in _ENCODINGS
            }
        except BaseException:
            self.close()
            raise

    @property
    def count_by_topic(self) -> Mapping[int, int]:
        counts: Mapping[int, int] = self._summary.statistics.channel_message_counts
        return counts

    def beside(self) -> Mapping[str, int]:
        return count_beside(self._source, self._summary)

    def copy_beside(self, writer: Any) -> set[str]:
        return copy_beside(self._source, self._summary, writer)

    @property
    def range_ns(self) -> tuple[int, int] | None:
        statistics = self._summary.statistics
        if not statistics.message_count:
            return None
        return statistics.message_start_time, statistics.message_end_time

    def messages(
        self, topics: Collection[int], first_ns: int, last_ns: int, on_damage: OnDamage
    ) -> Iterator[tuple[int, int, Any, int, int]]:
        found = McapMessages(
            self._source,
            self._summary.chunk_indexes,
            self._limits,
            topics,
            first_ns,
            last_ns,
            False,
            on_damage,
        )
        with translated(self._source.name):
            yield from found

    def close(self) -> None:
        self._file.close()

    def _topic(self, channel: Any, schema: Any) -> StoredTopic:
        profiles = channel.metadata.get("offered_qos_profiles", "")
        name = "" if schema is None else schema.name
        encoding, latched = channel.message_encoding, is_latched(profiles)
        return StoredTopic(channel.id, channel.topic, name, encoding, latched, profiles)


def is_of_ros2(path: Path) -> bool:
    """Return whether an MCAP file has the profile `ros2`, or channels with ROS 2 messages.

    Return False if its header, or the summary of a file without the profile, is unreadable.

    Raises:
        BagError: the library `mcap` is missing.
    """
    mcap_library()
    try:
        with open_file(path) as file, translated(os.fspath(path)):
            if read_profile(Source(file, os.fspath(path))) == "ros2":
                return True
        storage = McapStorage(path)
    except (NotIndexed, BagFormatError):
        return False
    storage.close()
    return any(topic.encoding == "cdr" for topic in storage.topics)


class McapStorageWriter:
    """A new MCAP file.

    Args:
        compression: `none`, `lz4` or `zstd`.

    Raises:
        BagError: the library `mcap` is missing, or the compression is unknown.
    """

    def __init__(self, path: Path, distribution: Distribution, compression: str) -> None:
        library = mcap_library()
        if compression not in COMPRESSIONS:
            raise BagError(f"compression must be one of {', '.join(COMPRESSIONS)}, got [{compression}]")
        self._version = distribution.bag_version
        self._file = path.open("wb")
        self._writer = library.writer.Writer(
            self._file,
            chunk_size=_CHUNK_BYTES,
            compression=getattr(library.writer.CompressionType, COMPRESSIONS[compression]),
        )
        self._writer.start(profile="ros2", library="pipros")
        self._schemas: dict[str, int] = {}

    def add_topic(self, topic: NewTopic) -> int:
        if topic.type not in self._schemas:
            definition = topic.definition.encode()
            self._schemas[topic.type] = self._writer.register_schema(topic.type, "ros2msg", definition)
        metadata = {
            "offered_qos_profiles": qos_text(topic.qos, self._version),
            "topic_type_hash": topic.type_hash,
        }
        channel: int = self._writer.register_channel(topic.name, "cdr", self._schemas[topic.type], metadata)
        return channel

    def write(self, topic: int, time_ns: int, cdr: bytes, sequence: int = 0, published_ns: int = 0) -> None:
        self._writer.add_message(topic, time_ns, cdr, published_ns or time_ns, sequence)

    def add_beside(self, record: Any) -> None:
        """Add an attachment, a schema or a metadata record."""
        add_record(self._writer, record)

    def finish(self, metadata: str) -> None:
        self._writer.add_metadata("rosbag2", {"serialized_metadata": metadata})
        self._writer.finish()
        self._file.flush()
        os.fsync(self._file.fileno())
        self.close()

    def close(self) -> None:
        self._file.close()
