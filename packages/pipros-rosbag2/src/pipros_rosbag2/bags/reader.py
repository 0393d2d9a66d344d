"""Read ROS 2 bags like ROS 1 bags: messages are converted when they are read."""

from __future__ import annotations

import heapq
import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from pipros.basics.errors import NotFound, PiprosError
from pipros.msg.language.digest import complete
from pipros.msg.language.spec import MessageSpec
from pipros_rosbag2.bags.files import bag_files, is_ros2_bag, opened_files
from pipros_rosbag2.bags.mcap_storage import McapStorage
from pipros_rosbag2.bags.metadata import QOS_FIELD, BagMetadata
from pipros_rosbag2.bags.storage import StorageReader, StoredTopic
from pipros_rosbag2.conversion.errors import ConversionError, NotConvertible
from pipros_rosbag2.conversion.mapping import BUILTIN_RULES, MappingRules
from pipros_rosbag2.conversion.plans import ConversionPlan, Plans
from pipros_rosbag2.distribution import Distribution
from pipros_rosbag2.interfaces.catalog import Catalog, Ros1Definitions
from pipros_rosbag2.interfaces.installed import installed_definitions, installed_package
from pipros_rosbag2.interfaces.parse import is_full_name, messages_from_text
from pipros_rosbag2.interfaces.parts import owner_of
from pipros_rosbag2.interfaces.ros1_text import ros1_definition, ros1_name
from pipros_tools.bag.connection import Connection
from pipros_tools.bag.errors import BagError, BagFormatError, NoMessages
from pipros_tools.bag.index import ChunkHeader, ChunkInfo
from pipros_tools.bag.layout import BagLayout
from pipros_tools.bag.mcap_files import AFTER_ALL
from pipros_tools.bag.opening import open_bag
from pipros_tools.bag.reader import BagReader
from pipros_tools.bag.records import Version, is_valid_time
from pipros_tools.bag.times import received_at

_LAST_WITHOUT_DISTRIBUTION = 5
_CUSTOM = "custom data"
_NAMED = 10
"""Number of topics without a name that are left out one by one; the rest are counted."""
_OPTIONS = "use --msgs to give the folders with ROS 2 definitions"


class Ros2BagReader(BagReader):
    """A ROS 2 bag, with the methods of `BagReader`.

    A topic is left out if its type cannot be converted, or its messages are not encoded as CDR. A file that
    cannot be read is left out if the bag has others, and `metadata.yaml` if the folder has files.

    Args:
        path: a bag folder, with or without `metadata.yaml`, or a single file.
        folders: folders with ROS 2 definitions; see `Catalog`.

    Raises:
        BagError: the bag is damaged, or needs a library that is not installed.
        OSError: a file cannot be read.

    Attributes:
        topic_types: maps each topic to its ROS 2 type.
    """

    def __init__(
        self,
        path: Path,
        *,
        folders: Sequence[str | os.PathLike[str]] = (),
        rules: MappingRules = BUILTIN_RULES,
    ) -> None:
        metadata, paths, unusable = bag_files(path)
        self._path = path
        self._custom_data = metadata.custom_data if metadata is not None else {}
        self.topic_types: dict[str, str] = {}
        storages, skipped = opened_files(paths)
        self._paths, self._storages = list(storages), list(storages.values())
        try:
            super().__init__(self._paths[0], layout=BagLayout(Version(0, 0)), name=os.fspath(path))
            self._again = partial(Ros2BagReader, Path(os.path.abspath(path)), folders=folders, rules=rules)
            self.skipped_files.update(unusable | skipped)
            self._invalid: dict[str, str] = {}
            self._ros1 = _Ros1Types()
            self._catalog = Catalog(_distribution(metadata), self._ros1.definitions, folders)
            self._plans = Plans(self._catalog, self._ros1.definitions, rules)
            self._add_definitions()
            self._fields: dict[str, dict[str, bytes]] = {}
            self._known: dict[tuple[str, str, bool, bytes | None], Connection] = {}
            self._connections: list[dict[int, tuple[Connection, ConversionPlan]]] = []
            for storage in self._storages:
                self._connections.append(self._connect(storage))
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        super().close()
        for storage in self._storages:
            storage.close()

    def beside(self) -> Mapping[str, int]:
        found = Counter({_CUSTOM: len(self._custom_data)} if self._custom_data else {})
        for storage in self._storages:
            found += Counter(storage.beside() if isinstance(storage, McapStorage) else {})
        return found

    def copy_beside(self, writer: Any) -> set[str]:
        kept = set()
        if isinstance(getattr(writer, "custom_data", None), dict):
            writer.custom_data.update(self._custom_data)
            kept.add(_CUSTOM)
        for storage in self._storages:
            kept |= storage.copy_beside(writer) if isinstance(storage, McapStorage) else set()
        return kept

    @property
    def name(self) -> str:
        return os.fspath(self._path)

    @property
    def format_name(self) -> str:
        kind = "mcap" if isinstance(self._storages[0], McapStorage) else "sqlite3"
        return f"ROS 2 {self._catalog.distribution.value}, {kind}"

    @property
    def size(self) -> int:
        return sum(path.stat().st_size for path in self._paths)

    @property
    def chunks(self) -> list[ChunkInfo]:
        return []

    def chunk_header(self, number: int) -> ChunkHeader:
        raise IndexError(f"the bag has no chunk {number}")

    @property
    def message_count(self) -> int:
        return sum(self.count_by_connection().values())

    def count_by_connection(self) -> dict[int, int]:
        counts = dict.fromkeys(self.layout.connections, 0)
        for storage, connections in zip(self._storages, self._connections, strict=True):
            for topic, (connection, _) in connections.items():
                counts[connection.id] += storage.count_by_topic.get(topic, 0)
        return counts

    @property
    def range_ns(self) -> tuple[int, int]:
        ranges = [each.range_ns for each in self._storages]
        filled = [each for each in ranges if each is not None]
        if not filled:
            raise NoMessages(f"{self.name} has no messages")
        return min(first for first, _ in filled), max(last for _, last in filled)

    def times_ns(self) -> dict[int, list[int]]:
        found: dict[int, list[int]] = {}
        wanted = {connection.id for connection in self.connections}
        for connection, _, time_ns, *_ in self._stored(wanted, 0, AFTER_ALL):
            if is_valid_time(time_ns):
                found.setdefault(connection.id, []).append(time_ns)
        return found

    def stored_fields(
        self,
        connections: Iterable[Connection] | None = None,
        start_ns: int | None = None,
        end_ns: int | None = None,
        *,
        as_views: bool = False,  # noqa: ARG002 # messages are always new
        where: Callable[[Connection, int], bool] | None = None,
    ) -> Iterator[tuple[Connection, int, Any, int, int]]:
        wanted = {each.id for each in (self.connections if connections is None else connections)}
        last = AFTER_ALL if end_ns is None else end_ns
        for connection, plan, time_ns, cdr, sequence, published_ns in self._stored(
            wanted, start_ns or 0, last
        ):
            if not self._has_valid_time(connection, time_ns):
                continue
            if where is not None and not where(connection, time_ns):
                continue
            try:
                data = plan.to_ros1(cdr)
            except ConversionError as error:
                damaged = BagFormatError(f"{self.name}: a message on {connection.topic} is damaged: {error}")
                self._report(connection.topic, f"{received_at(time_ns)}: {error}", damaged)
                continue
            self._note_origin(time_ns, sequence, published_ns)
            yield connection, time_ns, data, sequence, published_ns

    def _stored(
        self, wanted: set[int], first_ns: int, last_ns: int
    ) -> Iterator[tuple[Connection, ConversionPlan, int, Any, int, int]]:
        def of_file(
            storage: StorageReader, known: dict[int, tuple[Connection, ConversionPlan]]
        ) -> Iterator[Any]:
            topics = {topic for topic, (connection, _) in known.items() if connection.id in wanted}

            def chunk_left_out(damaged: Iterable[int], error: BagFormatError) -> None:
                self._chunk_left_out((known[topic][0].topic for topic in damaged), error)

            for topic, *message in storage.messages(topics, first_ns, last_ns, chunk_left_out):
                yield (*known[topic], *message)

        files = [of_file(*each) for each in zip(self._storages, self._connections, strict=True)]
        return heapq.merge(*files, key=_time_of)

    def _add_definitions(self) -> None:
        """Add the definitions in the files. One that is invalid affects only the topics of its type."""
        for storage in self._storages:
            for type_name, text in storage.definitions.items():
                # recorders store an empty text if they do not find the definition
                if is_full_name(type_name) and (text.strip() or not self._is_known(type_name)):
                    try:
                        self._catalog.add(messages_from_text(type_name, text))
                    except PiprosError as error:
                        self._invalid[type_name] = f"its definition in the bag is invalid: {error}"

    def _is_known(self, type_name: str) -> bool:
        try:
            return bool(owner_of(type_name)) or self._catalog.has_message(type_name)
        except PiprosError:
            return True

    def _connect(self, storage: StorageReader) -> dict[int, tuple[Connection, ConversionPlan]]:
        found: dict[int, tuple[Connection, ConversionPlan]] = {}
        for topic in storage.topics:
            self.topic_types.setdefault(topic.name, topic.type)
            try:
                found[topic.id] = self._connection(topic)
            except PiprosError as error:
                self.skipped.setdefault(topic.name, str(error))
        nameless = sorted(storage.count_by_topic.keys() - {topic.id for topic in storage.topics})
        for number in nameless[:_NAMED]:
            self.skipped.setdefault(f"topic {number}", "the file has messages on it, but no name and type")
        if nameless[_NAMED:]:
            self.skipped.setdefault(
                f"each of {len(nameless) - _NAMED} more topics", "likewise, in the same file"
            )
        return found

    def _connection(self, topic: StoredTopic) -> tuple[Connection, ConversionPlan]:
        if topic.encoding != "cdr" or not is_full_name(topic.type):
            raise BagError(
                "the messages must be CDR of a type such as package/msg/Name, "
                f"got the encoding [{topic.encoding}] and the type [{topic.type}]"
            )
        plan = self._plan(topic.type)
        plan.prepare(to_cdr=False)
        header = {"topic": topic.name.encode(), **self._fields_of_type(plan.ros1_type)}
        if topic.is_latched:
            header["latching"] = b"1"
        if topic.qos.strip() not in ("", "[]"):
            header[QOS_FIELD] = topic.qos.encode()
        key = topic.name, plan.ros1_type, topic.is_latched, header.get(QOS_FIELD)
        connection = self._known.get(key)
        if connection is None:
            connection = self._known[key] = Connection(len(self._known), topic.name, header)
            self.layout.connections[connection.id] = connection
        return connection, plan

    def _fields_of_type(self, ros1_type: str) -> dict[str, bytes]:
        """Return the fields that the connections of a type share, so that each definition is kept once."""
        if ros1_type not in self._fields:
            definition = complete(self._ros1.message(ros1_type), self._ros1.message)
            values = {
                "type": ros1_type,
                "md5sum": definition.md5(),
                "message_definition": definition.full_text(),
            }
            self._fields[ros1_type] = {name: value.encode() for name, value in values.items()}
        return self._fields[ros1_type]

    def _plan(self, ros2_type: str) -> ConversionPlan:
        """Return the plan for a type. For a type that only ROS 2 has, derive an equivalent ROS 1 type."""
        try:
            return self._plans.for_ros2(ros2_type)
        except NotConvertible:
            try:
                whole = self._catalog.complete(self._catalog.message(ros2_type))
            except NotFound as error:
                raise BagError(self._invalid.get(ros2_type) or f"{error}; {_OPTIONS}") from None
            self._ros1.add([whole.message, *whole.embedded.values()])
            return self._plans.between(ros1_name(ros2_type), ros2_type)


class _Ros1Types:
    """ROS 1 definitions: from installed packages, or derived from types that only ROS 2 has."""

    def __init__(self) -> None:
        self._installed = installed_definitions()
        self._known: dict[str, MessageSpec | str] = {}
        self._missing_packages: dict[str, str] = {}
        self.definitions = Ros1Definitions(self.message, self._installed.service)

    def message(self, name: str) -> MessageSpec:
        package = name.partition("/")[0]
        known = self._known.get(name) or self._missing_packages.get(package)
        if known is None:
            try:
                known = self._installed.message(name)
            except NotFound as error:
                known = str(error)
                if installed_package(package) is None:
                    self._missing_packages[package] = known
            self._known[name] = known
        if isinstance(known, str):
            raise NotFound(known)
        return known

    def add(self, messages: Iterable[Any]) -> None:
        for each in messages:
            name = ros1_name(each.type)
            try:
                self.message(name)
            except NotFound:
                self._known[name] = ros1_definition(each)


def open_any_bag(
    path: str | os.PathLike[str], *, folders: Sequence[str | os.PathLike[str]] = ()
) -> BagReader:
    """Open a ROS 1 or ROS 2 bag: a file, or a ROS 2 bag folder.

    Raises:
        BagError: the path is not a bag, or the bag is damaged or needs a library that is not installed.
        OSError: a file cannot be read.
    """
    if is_ros2_bag(path):
        return Ros2BagReader(Path(path), folders=folders)
    return open_bag(path)


def _distribution(metadata: BagMetadata | None) -> Distribution:
    """Return the distribution that wrote a bag, or a likely one if it is unknown.

    Definitions in the bag take precedence over those of the distribution.
    """
    if metadata is not None and metadata.distribution is not None:
        return metadata.distribution
    if metadata is not None and metadata.version <= _LAST_WITHOUT_DISTRIBUTION:
        return Distribution.HUMBLE
    return Distribution.JAZZY


def _time_of(stored: tuple[Connection, ConversionPlan, int, Any, int, int]) -> int:
    return stored[2]
