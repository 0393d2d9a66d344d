"""Write ROS 2 bags from the messages of ROS 1 bags."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.basics.planted import refuse_planted
from pipros.basics.printable import listed
from pipros.basics.replaced_file import naming, write_whole
from pipros.basics.windows import replace_file
from pipros.msg.language.digest import SEPARATOR
from pipros.msg.language.full_text import specs_from_text
from pipros.msg.language.spec import MessageSpec
from pipros.msg.time import NS_PER_S
from pipros_rosbag2.bags.mcap_storage import McapStorageWriter
from pipros_rosbag2.bags.metadata import (
    QOS_FIELD,
    BagMetadata,
    Profiles,
    TopicMetadata,
    latched_profiles,
    metadata_record,
    metadata_text,
    parsed_profiles,
)
from pipros_rosbag2.bags.sqlite_files import SqliteWriter
from pipros_rosbag2.bags.storage import NewTopic, StorageWriter
from pipros_rosbag2.conversion.errors import ConversionError
from pipros_rosbag2.conversion.mapping import BUILTIN_RULES, MappingRules
from pipros_rosbag2.conversion.plans import ConversionPlan, Plans
from pipros_rosbag2.distribution import Distribution
from pipros_rosbag2.interfaces.catalog import Catalog, Ros1Definitions
from pipros_rosbag2.interfaces.derive import derived_message
from pipros_rosbag2.interfaces.installed import installed_definitions
from pipros_rosbag2.interfaces.spec import Ros2Message
from pipros_rosbag2.names import checked_name
from pipros_tools.bag.connection import Connection
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.records import text_of

_STORED = {"topic", "type", "md5sum", "message_definition", "latching", QOS_FIELD}
"""The fields of connection headers that ROS 2 bags store in another form, or do not need."""

SUFFIXES = {"mcap": ".mcap", "sqlite3": ".db3"}
"""The storage formats, with the suffixes of their files."""


@dataclass(slots=True)
class _BagTopic:
    """A topic in the new bag. `source` is its name in the old bag."""

    new: NewTopic
    id: int
    source: str
    count: int = 0


class Ros2BagWriter:
    """Writes one file of a ROS 2 bag. Like `BagWriter`, it takes ROS 1 messages.

    Attributes:
        skipped: maps each topic that was left out to the reason.
        incomplete: maps each topic that lacks some messages to the reason for the first omission.
    """

    def __init__(
        self,
        storage: StorageWriter,
        distribution: Distribution,
        *,
        folders: Sequence[str | os.PathLike[str]] = (),
        rules: MappingRules = BUILTIN_RULES,
    ) -> None:
        self._storage = storage
        self._distribution = distribution
        self._rules = rules
        self._catalog = Catalog(distribution, installed_definitions(), folders)
        self._plans: dict[tuple[str, str], Plans] = {}
        self._derived: dict[str, Ros2Message] = {}
        self._topics: dict[str, _BagTopic] = {}
        self._of_connection: list[tuple[_BagTopic, ConversionPlan] | None] = []
        self._first_ns: int | None = None
        self._last_ns = 0
        self.skipped: dict[str, str] = {}
        self.incomplete: dict[str, str] = {}
        self.custom_data: dict[str, str] = {}
        self._lost: set[str] = set()
        self.is_mcap = isinstance(storage, McapStorageWriter)

    @property
    def lost(self) -> list[str]:
        """What ROS 2 cannot store of the connection headers."""
        return [f"{name} of connection headers" for name in sorted(self._lost)]

    def add_beside(self, record: Any) -> None:
        """Add an attachment, a schema or a metadata record, if the storage is MCAP."""
        if isinstance(self._storage, McapStorageWriter):
            self._storage.add_beside(record)

    def add_connection(self, topic: str, header: Mapping[str, bytes]) -> Connection:
        """Add a connection. If its type cannot be converted, its messages are left out."""
        connection = Connection(len(self._of_connection), topic, dict(header))
        self._lost.update(connection.header.keys() - _STORED)
        found: tuple[_BagTopic, ConversionPlan] | None = None
        try:
            found = self._topic(connection)
        except PiprosError as error:
            is_known = any(each.source == topic for each in self._topics.values())
            reasons = self.incomplete if is_known else self.skipped
            reasons.setdefault(topic, str(error))
        self._of_connection.append(found)
        return connection

    def _topic(self, connection: Connection) -> tuple[_BagTopic, ConversionPlan]:
        name = checked_name(connection.topic if connection.topic[:1] == "/" else f"/{connection.topic}")
        plans = self._plans_of(connection)
        plan = plans.for_ros1(connection.type)
        plan.prepare(to_ros1=False)
        known = self._topics.get(name)
        if known is None:
            profiles = parsed_profiles(text_of(connection.header.get(QOS_FIELD, b"")))
            profiles = profiles or latched_profiles(is_latched=connection.is_latching)
            new = self._new_topic(name, plans, plan, profiles)
            known = self._topics[name] = _BagTopic(new, self._storage.add_topic(new), connection.topic)
        elif known.source != connection.topic:
            raise BagError(f"in ROS 2, it would have the same name, {name}, as [{listed(known.source)}]")
        elif known.new.type != plan.ros2_type:
            raise BagError(f"a topic can have only one type in ROS 2: {known.new.type}, not {plan.ros2_type}")
        return known, plan

    def _new_topic(self, name: str, plans: Plans, plan: ConversionPlan, qos: Profiles) -> NewTopic:
        whole = self._catalog.complete(self._catalog.message(plan.ros2_type))
        parts = [whole.message.text()]
        for type_name, inner in whole.embedded.items():
            parts.append(f"{SEPARATOR}\nMSG: {type_name.replace('/msg/', '/')}\n{inner.text()}")
        has_hash = self._distribution.has_type_hashes
        type_hash = plans.message_hash(plan.ros2_type) if has_hash else ""
        return NewTopic(name, plan.ros2_type, "\n".join(parts), type_hash, qos)

    def _plans_of(self, connection: Connection) -> Plans:
        """Return plans that prefer the definitions in the connection's header to the installed ones."""
        key = connection.type, connection.md5sum
        if key not in self._plans:
            installed = installed_definitions()
            specs: Mapping[str, MessageSpec] = {}
            if connection.definition.strip():
                specs = specs_from_text(connection.type, connection.definition)
            self._check_derived(specs)
            self._catalog.add_derived(specs)

            def lookup(name: str) -> MessageSpec:
                return specs[name] if name in specs else installed.message(name)

            ros1 = Ros1Definitions(lookup, installed.service)
            self._plans[key] = Plans(self._catalog, ros1, self._rules)
        return self._plans[key]

    def _check_derived(self, specs: Mapping[str, MessageSpec]) -> None:
        """Raise BagError if a type that is derived from the bag would lose or get fields."""
        for made in map(derived_message, specs.values()):
            first = self._derived.setdefault(made.type, made)
            if first.fields != made.fields and self._catalog.is_derived(made.type):
                raise BagError(
                    f"this definition of {made.type} differs from the first one; ROS 2 can have only one"
                )

    def write(self, connection: Connection, seconds: int, nanoseconds: int, data: bytes) -> None:
        """Add a message, or leave it out if its values do not fit the ROS 2 type."""
        self.write_copy(connection, seconds * NS_PER_S + nanoseconds, data, 0, 0)

    def write_copy(
        self, connection: Connection, time_ns: int, data: bytes, sequence: int, published_ns: int
    ) -> None:
        """Add a message of another file; see `write`."""
        found = self._of_connection[connection.id]
        if found is None:
            return
        topic, plan = found
        try:
            cdr = plan.to_cdr(data)
        except ConversionError as error:
            self.incomplete.setdefault(connection.topic, str(error))
            return
        self._storage.write(topic.id, time_ns, cdr, sequence, published_ns)
        topic.count += 1
        self._first_ns = time_ns if self._first_ns is None else min(self._first_ns, time_ns)
        self._last_ns = max(self._last_ns, time_ns)

    def finish(self) -> None:
        """Do nothing. Call `close_storage` instead, which needs the file name."""

    def close_storage(self, storage: str, file: str) -> BagMetadata:
        """Write the end of the file, and return the content of `metadata.yaml`."""
        first = self._first_ns or 0
        topics = [
            TopicMetadata(name, each.new.type, each.new.qos, each.new.type_hash, each.count)
            for name, each in self._topics.items()
        ]
        metadata = BagMetadata(
            self._distribution.bag_version,
            storage,
            (file,),
            topics,
            first,
            max(0, self._last_ns - first),
            sum(each.count for each in topics),
            self._distribution,
            custom_data=self.custom_data,
        )
        self._storage.finish(metadata_record(metadata))
        return metadata


@contextmanager
def new_ros2_bag(
    folder: Path,
    distribution: Distribution,
    *,
    storage: str,
    compression: str = "zstd",
    folders: Sequence[str | os.PathLike[str]] = (),
    rules: MappingRules = BUILTIN_RULES,
    replaces: bool = False,
) -> Iterator[Ros2BagWriter]:
    """Context manager for a new bag: a folder with one file and `metadata.yaml`.

    Until the bag is complete, the folder has the suffix `.active`. After an error, it is removed.

    Args:
        storage: `mcap` or `sqlite3`.
        compression: compression of the chunks in MCAP files: `none`, `lz4` or `zstd`.
        folders: folders with ROS 2 definitions; see `Catalog`.
        replaces: whether to replace an existing bag, and what an interrupted conversion left.

    Raises:
        BagError: a format is unknown, a library is missing, or a folder exists and is not replaced.
        OSError: the folder cannot be written.
    """
    if storage not in SUFFIXES:
        raise BagError(f"the storage must be one of {', '.join(SUFFIXES)}, got [{storage}]")
    if folder.name in ("", ".."):
        raise BagError(f"a bag must have a name of its own, got [{folder}]")
    unfinished = folder.with_name(folder.name + ".active")
    refuse_planted(unfinished)
    _check_free(folder, "it", replaces=replaces)
    _check_free(unfinished, "what an earlier conversion left unfinished", replaces=replaces)
    if unfinished.exists():
        shutil.rmtree(unfinished)
    unfinished.mkdir(parents=True)
    try:
        name = f"{folder.name}_0{SUFFIXES[storage]}"
        file: Any = None
        with naming(folder):
            try:
                if storage == "mcap":
                    file = McapStorageWriter(unfinished / name, distribution, compression)
                else:
                    file = SqliteWriter(unfinished / name, distribution)
                writer = Ros2BagWriter(file, distribution, folders=folders, rules=rules)
                yield writer
                metadata = writer.close_storage(storage, name)
            finally:
                if file is not None:
                    file.close()
        write_whole(unfinished / "metadata.yaml", metadata_text(metadata).encode())
        if folder.exists():
            old = folder.with_name(folder.name + ".old")
            shutil.rmtree(old, ignore_errors=True)
            replace_file(folder, old)
            replace_file(unfinished, folder)
            shutil.rmtree(old)
        else:
            replace_file(unfinished, folder)
    except BaseException:
        shutil.rmtree(unfinished, ignore_errors=True)
        raise


def _check_free(folder: Path, what: str, *, replaces: bool) -> None:
    """Raise `BagError` if a folder exists and is not a bag that may be replaced."""
    if not folder.exists():
        return
    if not replaces:
        raise BagError(f"{folder} already exists; --force replaces {what}")
    if not folder.is_dir() or any(
        each.name != "metadata.yaml" and each.suffix not in SUFFIXES.values() for each in folder.iterdir()
    ):
        raise BagError(f"{folder} already exists, and is not replaced, because it is not only a ROS 2 bag")
