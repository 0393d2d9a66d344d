"""ROS 2 SQLite files (`.db3`), the default of Humble.

The schema has version 3 in Humble, and 4 in later distributions, which store definitions and type hashes.
"""

from __future__ import annotations

import os
import shutil
import sqlite3
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from pipros.basics.input_file import open_file
from pipros_rosbag2.bags.metadata import is_latched, qos_text
from pipros_rosbag2.bags.storage import NewTopic, StoredTopic
from pipros_rosbag2.distribution import Distribution
from pipros_tools.bag.errors import BagError, BagFormatError, ClosedBag
from pipros_tools.bag.layout import REPAIR
from pipros_tools.bag.mcap_messages import OnDamage
from pipros_tools.bag.records import TIMES_NS

MAGIC = b"SQLite format 3\0"
_JOURNAL = b"\xd9\xd5\x05\xf9\x20\xa1\x63\xd7"
TABLES = ("schema", "metadata", "topics", "message_definitions", "messages")
"""The tables of a bag. Only `topics` and `messages` are required."""

_STEPS_PER_SIGNAL_CHECK = 100_000
_TOPICS = "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
_TOPICS += "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL"
_TABLES = (
    "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL)",
    "CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, "
    "metadata TEXT NOT NULL)",
    "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, "
    "data BLOB NOT NULL)",
)
_DEFINITIONS = (
    "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, "
    "encoding TEXT NOT NULL, encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL)"
)
_SCHEMA_WITH_DEFINITIONS = 4
_SCHEMA_OF_HUMBLE = 3


@contextmanager
def _translated(name: str, seen: tuple[int, int] | None = None) -> Iterator[None]:
    """Translate SQLite's errors into bag errors. `seen` is what `_state` returned, to name changes."""
    try:
        yield
    except OSError as error:
        raise BagError(f"{name}: cannot copy it to undo an unfinished transaction: {error}") from error
    except sqlite3.ProgrammingError:
        raise ClosedBag(f"{name} is closed") from None
    except (sqlite3.Error, OverflowError, UnicodeDecodeError) as error:
        if str(error) == "interrupted":
            raise KeyboardInterrupt from None
        if seen is not None and _state(name) != seen:  # reindexing it would damage it
            reason = "another program changed it while it was read; read it when that program has ended"
            raise BagError(f"{name}: {reason} ({error})") from error
        raise BagFormatError(f"{name} is not a ROS 2 bag, or is damaged: {error}. {REPAIR}") from error


def _state(name: str) -> tuple[int, int]:
    try:
        status = os.stat(name)
    except OSError:  # it was removed
        return -1, -1
    return status.st_size, status.st_mtime_ns


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Translate SQLite's errors about a new database into `BagError`."""
    try:
        yield
    except sqlite3.Error as error:
        raise BagError(f"cannot write {path}: {error}") from error


def has_magic(path: Path) -> bool:
    """Return whether a file begins like an SQLite database."""
    with open_file(path) as file:
        return file.read(len(MAGIC)) == MAGIC


def opened_database(path: Path) -> sqlite3.Connection:
    """Open a database read-only, as an untrusted one. Raise `BagFormatError` if that is not possible.

    No file beside it is changed or created. A killed recorder may leave a write-ahead log, whose rows are
    included, or a rollback journal, whose unfinished transaction is undone in a copy.
    """
    how = "immutable=1"
    if has_log := write_ahead_log(path).exists():
        how = (
            f"vfs={'win32' if os.name == 'nt' else 'unix'}-none"  # without locks, which need a writable file
        )
    uri = f"{path.absolute().as_uri()}?mode=ro&{how}"
    with _translated(os.fspath(path)):
        # An iterator that is not exhausted may be closed in another thread.
        database = _rolled_back(path) or sqlite3.connect(uri, uri=True, check_same_thread=False)
        if has_log:
            database.execute("PRAGMA locking_mode = EXCLUSIVE")  # the log's index stays in memory
        # Python handles signals while SQLite calls this function. SQLite replaces an exception raised by a
        # signal handler with its own error, "interrupted".
        database.set_progress_handler(lambda: 0, _STEPS_PER_SIGNAL_CHECK)
        database.execute("PRAGMA trusted_schema = OFF")
        database.text_factory = partial(str, encoding="utf-8", errors="replace")  # affects only one value
    return database


def _rolled_back(path: Path) -> sqlite3.Connection | None:
    """Return a copy of a database without its unfinished transaction; None if it has none."""
    if not _is_unfinished(path):
        return None
    with (
        open_file(_journal(path)) as undo,
        open_file(path) as content,
        # Windows keeps the copy, because it is open.
        TemporaryDirectory(prefix="pipros-db3-", ignore_cleanup_errors=True) as folder,
    ):
        copy = Path(folder, "copy.db3")
        with copy.open("wb") as target, _journal(copy).open("wb") as target_undo:
            shutil.copyfileobj(content, target)
            shutil.copyfileobj(undo, target_undo)
            target_undo.write(bytes(16))  # at its end, the journal could name a file that SQLite deletes
        database = sqlite3.connect(copy, check_same_thread=False)
        database.execute("SELECT COUNT(*) FROM sqlite_master")  # SQLite undoes the transaction
        return database


def _is_unfinished(path: Path) -> bool:
    """Return whether a database has a transaction that was not finished."""
    try:
        with open_file(_journal(path)) as journal:
            return journal.read(len(_JOURNAL)) == _JOURNAL
    except FileNotFoundError:
        return False


def _journal(path: Path) -> Path:
    return path.with_name(f"{path.name}-journal")


def write_ahead_log(path: Path) -> Path:
    """Return the name of a database's write-ahead log."""
    return path.with_name(f"{path.name}-wal")


def check_tables(database: sqlite3.Connection, name: str) -> None:
    """Check that the tables exist. Reject views and computed columns: evaluating them may never end."""
    query = "SELECT lower(name), type, sql FROM sqlite_master"
    found = [row for row in database.execute(query) if row[0] in TABLES]
    is_plain = all(kind == "table" and str(sql).startswith("CREATE TABLE") for _, kind, sql in found)
    computed = [row for each in TABLES for row in database.execute(f"PRAGMA table_xinfo({each})") if row[6]]
    if not is_plain or computed or not {"topics", "messages"} <= {name for name, *_ in found}:
        raise BagFormatError(
            f"{name} is not a ROS 2 bag: a table is missing, is a view, or has computed columns"
        )


class SqliteReader:
    """A `.db3` file, opened read-only. Threads may share a reader.

    Each iterator has its own connection, except to a copy without an unfinished transaction, which may be
    large.

    Raises:
        BagFormatError: the file is not a bag, or is damaged.
    """

    def __init__(self, path: Path) -> None:
        self._name, self._path = os.fspath(path), path
        self._seen = _state(self._name)
        self._database = opened_database(path)
        self._is_copied = _is_unfinished(path)
        self._in_use: set[sqlite3.Connection] = {self._database}
        try:
            with _translated(self._name):
                check_tables(self._database, self._name)
                self.topics = [self._topic(row) for row in self._topics()]
                self.definitions = self._definitions()
                counts = self._database.execute("SELECT topic_id, COUNT(*) FROM messages GROUP BY topic_id")
                self.count_by_topic: Mapping[int, int] = {int(topic): int(count) for topic, count in counts}
                query = "SELECT topic_id, timestamp FROM messages WHERE timestamp NOT BETWEEN 0 AND ? "
                query += "GROUP BY topic_id"
                self._invalid_times = self._database.execute(query, (TIMES_NS - 1,)).fetchall()
                query = "SELECT MIN(timestamp), MAX(timestamp) FROM messages WHERE timestamp BETWEEN 0 AND ?"
                first, last = self._database.execute(query, (TIMES_NS - 1,)).fetchone()
                self.range_ns = None if first is None else (int(first), int(last))
        except (BagError, TypeError, ValueError) as error:
            self.close()
            if isinstance(error, BagError):
                raise
            raise BagFormatError(f"{self._name}: a table has a value of the wrong type: {error}") from error

    def messages(
        self,
        topics: Collection[int],
        first_ns: int,
        last_ns: int,
        on_damage: OnDamage,  # noqa: ARG002 # the rows of a database are not in chunks
    ) -> Iterator[tuple[int, int, Any, int, int]]:
        query = "SELECT topic_id, timestamp, data FROM messages WHERE timestamp BETWEEN ? AND ? "
        query += "ORDER BY timestamp, id"
        largest = TIMES_NS - 1
        if not self._in_use:
            raise ClosedBag(f"{self._name} is closed")
        database = self._database if self._is_copied else opened_database(self._path)
        self._in_use.add(database)
        try:
            with _translated(self._name, self._seen):
                rows = database.execute(query, (min(first_ns, largest), min(last_ns, largest)))
                for topic, time_ns, data in rows:
                    if topic in topics:
                        # an empty message is damaged, so only this row is left out
                        yield topic, int(time_ns), data if isinstance(data, bytes) else b"", 0, 0
        finally:
            if database is not self._database:
                self._in_use.discard(database)
                database.close()
        for topic, time_ns in self._invalid_times:
            if topic in topics:
                yield topic, time_ns if isinstance(time_ns, int) else -1, b"", 0, 0

    def close(self) -> None:
        while self._in_use:
            self._in_use.pop().close()

    def _topics(self) -> list[tuple[Any, ...]]:
        known = {row[1] for row in self._database.execute("PRAGMA table_info(topics)")}
        profiles = "offered_qos_profiles" if "offered_qos_profiles" in known else "''"
        query = f"SELECT id, name, type, serialization_format, {profiles} FROM topics ORDER BY id"  # noqa: S608
        return self._database.execute(query).fetchall()

    def _topic(self, row: tuple[Any, ...]) -> StoredTopic:
        identity, name, kind, encoding, profiles = row
        latched = is_latched(profiles)
        return StoredTopic(int(identity), str(name), str(kind), str(encoding), latched, str(profiles))

    def _definitions(self) -> dict[str, str]:
        if not self._database.execute("PRAGMA table_info(message_definitions)").fetchall():
            return {}
        query = "SELECT topic_type, encoded_message_definition FROM message_definitions "
        query += "WHERE encoding = 'ros2msg'"
        return {str(kind): str(text) for kind, text in self._database.execute(query)}


class SqliteWriter:
    """A new `.db3` file.

    All methods raise BagError if the file cannot be written.
    """

    def __init__(self, path: Path, distribution: Distribution) -> None:
        self._has_definitions = distribution is not Distribution.HUMBLE
        self._version = distribution.bag_version
        self._types: set[str] = set()
        self._count = 0
        self._path = path
        with writing(path):
            self._database = sqlite3.connect(path, isolation_level=None)
        run = self._run
        # The file becomes visible only when it is complete, so a journal is not needed.
        run("PRAGMA journal_mode = OFF")
        run("PRAGMA synchronous = OFF")
        run("BEGIN")
        for table in _TABLES:
            run(table)
        schema = _SCHEMA_WITH_DEFINITIONS if self._has_definitions else _SCHEMA_OF_HUMBLE
        run("INSERT INTO schema VALUES (?, ?)", (schema, distribution.value))
        hashes = ", type_description_hash TEXT NOT NULL)" if self._has_definitions else ")"
        run(_TOPICS + hashes)
        if self._has_definitions:
            run(_DEFINITIONS)

    def add_topic(self, topic: NewTopic) -> int:
        self._count += 1
        values = [self._count, topic.name, topic.type, "cdr", qos_text(topic.qos, self._version)]
        if self._has_definitions:
            values.append(topic.type_hash)
        places = ", ".join("?" * len(values))
        self._run(f"INSERT INTO topics VALUES ({places})", values)  # noqa: S608 # only question marks
        if self._has_definitions and topic.type not in self._types:
            self._types.add(topic.type)
            self._run(
                "INSERT INTO message_definitions VALUES (NULL, ?, 'ros2msg', ?, ?)",
                (topic.type, topic.definition, topic.type_hash),
            )
        return self._count

    def write(
        self,
        topic: int,
        time_ns: int,
        cdr: bytes,
        sequence: int = 0,  # noqa: ARG002 # only MCAP files store it
        published_ns: int = 0,  # noqa: ARG002 # likewise
    ) -> None:
        self._run("INSERT INTO messages VALUES (NULL, ?, ?, ?)", (topic, time_ns, cdr))

    def finish(self, metadata: str) -> None:
        self._run("INSERT INTO metadata VALUES (NULL, ?, ?)", (self._version, metadata))
        self._run("CREATE INDEX timestamp_idx ON messages (timestamp ASC)")
        self._run("COMMIT")
        self.close()

    def close(self) -> None:
        self._database.close()

    def _run(self, statement: str, values: Sequence[Any] = ()) -> None:
        with writing(self._path):
            self._database.execute(statement, values)
