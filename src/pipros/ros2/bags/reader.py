"""Read ROS 2 bags like ROS 1 bags: messages are converted when they are read."""

from __future__ import annotations

import heapq
import os
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from pipros.bag.connection import Connection
from pipros.bag.errors import BagError, BagFormatError, NoMessages
from pipros.bag.index import ChunkHeader, ChunkInfo
from pipros.bag.layout import BagLayout
from pipros.bag.mcap_files import AFTER_ALL
from pipros.bag.opening import is_mcap, open_bag
from pipros.bag.reader import BagReader
from pipros.bag.records import Version
from pipros.basics.errors import NotFound, PiprosError
from pipros.basics.input_file import read_text
from pipros.basics.limits import process_limits
from pipros.msg.language.digest import complete
from pipros.msg.language.spec import MessageSpec
from pipros.ros2.bags.mcap_storage import McapStorage, has_cdr
from pipros.ros2.bags.metadata import BagMetadata, parse_metadata
from pipros.ros2.bags.sqlite_files import MAGIC, SqliteReader
from pipros.ros2.bags.storage import StorageReader, StoredTopic
from pipros.ros2.conversion.errors import ConversionError, NotConvertible
from pipros.ros2.conversion.mapping import BUILTIN_RULES, MappingRules
from pipros.ros2.conversion.plans import ConversionPlan, Plans
from pipros.ros2.distribution import Distribution
from pipros.ros2.interfaces.catalog import Catalog, Ros1Definitions, installed_definitions
from pipros.ros2.interfaces.parse import is_full_name, messages_from_text
from pipros.ros2.interfaces.ros1_text import ros1_definition, ros1_name

_METADATA = "metadata.yaml"
_LAST_WITHOUT_DISTRIBUTION = 5
_OPTIONS = "use --msgs to give the folders with ROS 2 definitions"


class Ros2BagReader(BagReader):
    """A ROS 2 bag, with the methods of `BagReader`.

    A topic is left out if its type cannot be converted, or its messages are not encoded as CDR.

    Args:
        path: a bag folder, or one of its files.
        folders: folders with ROS 2 definitions; see `Catalog`.

    Raises:
        BagError: the bag is damaged, or needs a library that is not installed.
        OSError: a file cannot be read.

    Attributes:
        skipped: maps each topic that is left out to the reason.
        topic_types: maps each topic to its ROS 2 type.
    """

    def __init__(
        self,
        path: Path,
        *,
        folders: Sequence[str | os.PathLike[str]] = (),
        rules: MappingRules = BUILTIN_RULES,
    ) -> None:
        metadata, paths = _files(path)
        self._path = path
        self._paths = paths
        self.skipped: dict[str, str] = {}
        self.topic_types: dict[str, str] = {}
        self._storages: list[StorageReader] = []
        super().__init__(paths[0], layout=BagLayout(Version(0, 0)), name=os.fspath(path))
        try:
            self._storages += [_storage(each) for each in paths]
            self._ros1 = _Ros1Types()
            self._catalog = Catalog(_distribution(metadata), self._ros1.definitions, folders)
            self._plans = Plans(self._catalog, self._ros1.definitions, rules)
            self._add_definitions()
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
        for connection, _, time_ns, _ in self._stored(wanted, 0, AFTER_ALL):
            found.setdefault(connection.id, []).append(time_ns)
        return found

    def stored_fields(
        self,
        connections: Iterable[Connection] | None = None,
        start_ns: int | None = None,
        end_ns: int | None = None,
        *,
        as_views: bool = False,  # noqa: ARG002 # messages are always new
    ) -> Iterator[tuple[Connection, int, Any, int, int]]:
        wanted = {each.id for each in (self.connections if connections is None else connections)}
        last = AFTER_ALL if end_ns is None else end_ns
        for connection, plan, time_ns, cdr in self._stored(wanted, start_ns or 0, last):
            try:
                data = plan.to_ros1(cdr)
            except ConversionError as error:
                raise BagFormatError(
                    f"{self.name}: a message on {connection.topic} is damaged: {error}"
                ) from None
            yield connection, time_ns, data, 0, 0

    def _stored(
        self, wanted: set[int], first_ns: int, last_ns: int
    ) -> Iterator[tuple[Connection, ConversionPlan, int, Any]]:
        def of_file(
            storage: StorageReader, known: dict[int, tuple[Connection, ConversionPlan]]
        ) -> Iterator[Any]:
            topics = {topic for topic, (connection, _) in known.items() if connection.id in wanted}
            for topic, time_ns, cdr in storage.messages(topics, first_ns, last_ns):
                yield (*known[topic], time_ns, cdr)

        files = [of_file(*each) for each in zip(self._storages, self._connections, strict=True)]
        return heapq.merge(*files, key=_time_of)

    def _add_definitions(self) -> None:
        for storage in self._storages:
            for type_name, text in storage.definitions.items():
                if is_full_name(type_name):
                    try:
                        self._catalog.add(messages_from_text(type_name, text))
                    except PiprosError as error:
                        raise BagFormatError(
                            f"{self.name}: invalid definition of {type_name}: {error}"
                        ) from None

    def _connect(self, storage: StorageReader) -> dict[int, tuple[Connection, ConversionPlan]]:
        found: dict[int, tuple[Connection, ConversionPlan]] = {}
        for topic in storage.topics:
            self.topic_types.setdefault(topic.name, topic.type)
            try:
                found[topic.id] = self._connection(topic)
            except PiprosError as error:
                self.skipped.setdefault(topic.name, str(error))
        return found

    def _connection(self, topic: StoredTopic) -> tuple[Connection, ConversionPlan]:
        if topic.encoding != "cdr" or not is_full_name(topic.type):
            raise BagError(
                "the messages must be CDR of a type such as package/msg/Name, "
                f"got the encoding [{topic.encoding}] and the type [{topic.type}]"
            )
        plan = self._plan(topic.type)
        plan.prepare()
        definition = complete(self._ros1.message(plan.ros1_type), self._ros1.message)
        header = {
            "topic": topic.name,
            "type": plan.ros1_type,
            "md5sum": definition.md5(),
            "message_definition": definition.full_text(),
        }
        if topic.is_latched:
            header["latching"] = "1"
        fields = {name: value.encode() for name, value in header.items()}
        for known in self.layout.connections.values():
            if known.topic == topic.name and known.header == fields:
                return known, plan
        connection = Connection(len(self.layout.connections), topic.name, fields)
        self.layout.connections[connection.id] = connection
        return connection, plan

    def _plan(self, ros2_type: str) -> ConversionPlan:
        """Return the plan for a type. For a type that only ROS 2 has, derive an equivalent ROS 1 type."""
        try:
            return self._plans.for_ros2(ros2_type)
        except NotConvertible:
            try:
                whole = self._catalog.complete(self._catalog.message(ros2_type))
            except NotFound as error:
                raise BagError(f"{error}; {_OPTIONS}") from None
            self._ros1.add([whole.message, *whole.embedded.values()])
            return self._plans.between(ros1_name(ros2_type), ros2_type)


class _Ros1Types:
    """ROS 1 definitions: from installed packages, or derived from types that only ROS 2 has."""

    def __init__(self) -> None:
        self._installed = installed_definitions()
        self._made: dict[str, MessageSpec] = {}
        self.definitions = Ros1Definitions(self.message, self._installed.service)

    def message(self, name: str) -> MessageSpec:
        try:
            return self._installed.message(name)
        except NotFound:
            if name in self._made:
                return self._made[name]
            raise

    def add(self, messages: Iterable[Any]) -> None:
        for each in messages:
            name = ros1_name(each.type)
            if name not in self._made:
                self._made[name] = ros1_definition(each)


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


def is_ros2_bag(path: str | os.PathLike[str]) -> bool:
    """Return whether a path is a ROS 2 bag. Raises the same errors as `open_any_bag`."""
    path = Path(path)
    if path.is_dir():
        return (path / _METADATA).exists()
    if is_mcap(path):
        return has_cdr(path)
    with path.open("rb") as file:
        return file.read(len(MAGIC)) == MAGIC


def _files(path: Path) -> tuple[BagMetadata | None, list[Path]]:
    """Return a bag's metadata (None if `path` is a single file) and its files."""
    if not path.is_dir():
        return None, [path]
    where = path / _METADATA
    try:
        text = read_text(os.fspath(where), process_limits().file_bytes)
    except UnicodeDecodeError as error:
        raise BagFormatError(f"{where}: {error}") from None
    metadata = parse_metadata(text, os.fspath(where))
    if metadata.compression:
        raise BagError(
            f"{path}: its files or messages are compressed with {metadata.compression}; decompress them first"
        )
    # Old versions of rosbag2 include the folder name in the paths.
    paths = [path / Path(name).name for name in metadata.files]
    if not paths:
        raise BagFormatError(f"{where} lists no files")
    return metadata, paths


def _storage(path: Path) -> StorageReader:
    return McapStorage(path) if is_mcap(path) else SqliteReader(path)


def _distribution(metadata: BagMetadata | None) -> Distribution:
    """Return the distribution that wrote a bag, or a likely one if it is unknown.

    Definitions in the bag take precedence over those of the distribution.
    """
    if metadata is not None and metadata.distribution is not None:
        return metadata.distribution
    if metadata is not None and metadata.version <= _LAST_WITHOUT_DISTRIBUTION:
        return Distribution.HUMBLE
    return Distribution.JAZZY


def _time_of(stored: tuple[Connection, ConversionPlan, int, Any]) -> int:
    return stored[2]
