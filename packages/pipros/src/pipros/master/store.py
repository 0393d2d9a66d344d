"""Store a master's state in a file, so that it can be restored after a crash.

The file is an SQLite database in WAL mode. A process that is killed loses at most the changes made during the
last `PAUSE_S`, and leaves no partial change. Parameters are stored as the calls that set them, in order.
Storing a call deletes the calls that it supersedes, so the file does not grow over time.

A thread writes the file: immediately under low load, otherwise every `PAUSE_S`. Callers never wait for the
thread, and the thread does not wait for the disk. Written changes survive a crash of the process. After a
power failure, the file is intact, but the last changes may be missing.
"""

from __future__ import annotations

import contextlib
import logging
import os
import queue
import sqlite3
import threading
from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from stat import S_ISLNK
from typing import Any, Final, NamedTuple

from pipros.basics.cache_files import Untrusted, check_owner
from pipros.basics.errors import PiprosError
from pipros.basics.posix import HAS_OWNERS, NO_LINK, user_id
from pipros.basics.warn_once import warn_once
from pipros.basics.windows import replace_file
from pipros.master.params import ParamsFull, ParamTree
from pipros.master.registry import Registry, Role
from pipros.wire.xmlrpc import decode_response, encode_response

_log = logging.getLogger("rosmaster.master")

PAUSE_S: Final = 0.02
APPLICATION_ID: Final = 0x70697072
"""SQLite application ID of a store. Its bytes spell `pipr`."""
FORMAT: Final = 1

_SCHEMA: Final = """
CREATE TABLE parameters (number INTEGER PRIMARY KEY, key TEXT NOT NULL, value BLOB);
CREATE INDEX parameters_by_key ON parameters (key);
CREATE TABLE registrations (
  number INTEGER PRIMARY KEY, role TEXT NOT NULL, node TEXT NOT NULL, key TEXT NOT NULL,
  api TEXT NOT NULL, service_api TEXT, UNIQUE (role, node, key)
);
CREATE TABLE topic_types (topic TEXT PRIMARY KEY, type TEXT NOT NULL);
"""


class Registration(NamedTuple):
    """A registration in the store."""

    role: Role
    node: str
    key: str
    api: str
    service_api: str | None


class StoredState(NamedTuple):
    """The contents of a store when it was opened.

    Attributes:
        parameters: keys and values in the order in which to set them; an `Absence` marks a missing value.
        registrations: the registrations, in their original order.
        topic_types: the type of each topic.
    """

    parameters: tuple[tuple[str, Any], ...]
    registrations: tuple[Registration, ...]
    topic_types: dict[str, str]


class Absence(Enum):
    """Marker for a key without a value."""

    DELETED = "deleted from a namespace that was set as a whole"
    NAMESPACE = "a namespace, which may be empty"


class StoreUntrusted(PiprosError):
    """Another user could have written to the store's file."""


class Store:
    """The journal of a registry and a parameter tree (`RegistryJournal`, `ParamJournal`) in a file.

    Attributes:
        restored: the contents of the file when it was opened, as far as it could be read.
        set_aside: the new path of an unusable file; None if the file was usable or new.
    """

    def __init__(self, file: Path, pause_s: float = PAUSE_S) -> None:
        """Open or create the file. A damaged or foreign file is moved aside unchanged.

        If the file cannot be written, for example because the disk is full, a warning is printed, and what
        the file contains is restored, but nothing is stored: a robot needs its master.

        Raises:
            StoreUntrusted: another user could have written to the file.
        """
        self.file = file
        self._pause_s = pause_s
        self.set_aside: Path | None = None
        try:
            _make_private(file)
            self._database, self.restored = self._open_or_move()
        except (OSError, sqlite3.Error) as error:
            warn_once(
                f"WARNING: cannot store parameters and registrations in [{file}]: {error}. This master "
                "continues without it: free some space, or fix the permissions, for the next one"
            )
            self._database, self.restored = _in_memory(), _read_unwritable(file)
        self._changes: queue.SimpleQueue[tuple[str, tuple[Any, ...]] | None] = queue.SimpleQueue()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._write, name="master store", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Write all pending changes and close the file."""
        self._closing.set()
        self._changes.put(None)
        self._thread.join()

    def _open_or_move(self) -> tuple[sqlite3.Connection, StoredState]:
        try:
            return _open(self.file)
        except (sqlite3.Error, PiprosError, ValueError, KeyError) as error:
            if _is_of_the_disk(error):
                raise
            self.set_aside = _move_aside(self.file)
            _log.error("%s is not a usable master store (%s); moved to %s", self.file, error, self.set_aside)
            return _open(self.file)

    # ---- the journal

    def param_set(self, key: str, value: object) -> None:
        self._supersede(key)
        # The writing thread encodes the value later. This is safe, because the tree never changes a value
        # that it holds.
        self._changes.put(("INSERT INTO parameters (key, value) VALUES (?, ?)", (key, _Value(value))))

    def param_deleted(self, key: str) -> None:
        self._supersede(key)
        parts = key.split("/")[1:-1]
        above = ["/", *("/" + "/".join(parts[: count + 1]) for count in range(len(parts)))]
        # Store the deletion itself only if the key is below a namespace that was set as a whole.
        one_of = ", ".join("?" * len(above))
        statement = (
            "INSERT INTO parameters (key, value) SELECT ?, NULL "  # noqa: S608  # only question marks
            f"WHERE EXISTS (SELECT 1 FROM parameters WHERE value != x'' AND key IN ({one_of}))"
        )
        self._changes.put((statement, (key, *above)))
        if parts:  # the enclosing namespace stays, even if it is now empty
            statement = (
                "INSERT INTO parameters (key, value) SELECT ?, x'' "
                "WHERE NOT EXISTS (SELECT 1 FROM parameters WHERE key = ? AND value = x'')"
            )
            self._changes.put((statement, (above[-1], above[-1])))

    def registered(self, role: Role, node: str, key: str, api: str, service_api: str | None) -> None:
        row = (role.name, node, key, api, service_api)
        statement = "INSERT INTO registrations (role, node, key, api, service_api) VALUES (?, ?, ?, ?, ?)"
        self._changes.put((statement + _ON_CONFLICT, row))

    def unregistered(self, role: Role, node: str, key: str) -> None:
        statement = "DELETE FROM registrations WHERE role = ? AND node = ? AND key = ?"
        self._changes.put((statement, (role.name, node, key)))

    def forget_registrations(self) -> None:
        """Delete all registrations. The caller then restores those that are still valid."""
        self._changes.put(("DELETE FROM registrations", ()))

    def type_set(self, topic: str, type_name: str) -> None:
        self._changes.put(("INSERT OR REPLACE INTO topic_types VALUES (?, ?)", (topic, type_name)))

    def type_forgotten(self, topic: str) -> None:
        self._changes.put(("DELETE FROM topic_types WHERE topic = ?", (topic,)))

    def _supersede(self, key: str) -> None:
        if key == "/":
            self._changes.put(("DELETE FROM parameters", ()))
        else:  # "0" is the character after "/", so the range contains the keys below `key`
            statement = "DELETE FROM parameters WHERE key = ? OR (key >= ? AND key < ?)"
            self._changes.put((statement, (key, key + "/", key + "0")))

    # ---- the writing thread

    def _write(self) -> None:
        is_open = True
        while is_open:
            batch = [self._changes.get()]
            with contextlib.suppress(queue.Empty):
                while True:
                    batch.append(self._changes.get_nowait())
            is_open = None not in batch
            try:
                with self._database:
                    for change in batch:
                        if change is not None:
                            statement, row = change
                            self._database.execute(statement, tuple(_plain(item) for item in row))
            except (sqlite3.Error, TypeError, ValueError) as error:
                _log.error("cannot write to the store %s: %s", self.file, error)
            self._closing.wait(self._pause_s)
        self._database.close()


_ON_CONFLICT: Final = (
    " ON CONFLICT (role, node, key) DO UPDATE SET api = excluded.api, service_api = excluded.service_api"
)


class _Value:
    __slots__ = ("value",)

    def __init__(self, value: object) -> None:
        self.value = value


def _plain(item: object) -> Any:
    return encode_response(item.value) if isinstance(item, _Value) else item


def _make_private(file: Path) -> None:
    """Create or check the file, so that no other user can read or set the parameters.

    Parameters may contain secrets. SQLite gives its auxiliary files the same permissions.
    """
    file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    if not HAS_OWNERS:
        return
    try:
        _check_not_planted(file.parent)
        try:
            os.close(os.open(file, os.O_RDWR | os.O_CREAT | os.O_EXCL | NO_LINK, 0o600))
        except FileExistsError:
            _check_not_planted(file)
            file.chmod(0o600)
    except Untrusted as error:
        raise StoreUntrusted(
            f"cannot store parameters in [{file}]: {error}. Correct this, or set ROS_HOME to your own folder"
        ) from None


def _check_not_planted(path: Path) -> None:
    link = os.lstat(path)
    if S_ISLNK(link.st_mode) and link.st_uid != user_id():
        raise Untrusted(f"{path} is a link that belongs to another user")
    check_owner(os.stat(path), str(path))


def _open(file: Path) -> tuple[sqlite3.Connection, StoredState]:
    is_new = not file.exists() or not file.stat().st_size
    database = sqlite3.connect(file, check_same_thread=False)
    try:
        if is_new:
            with database:
                database.executescript(
                    f"PRAGMA application_id = {APPLICATION_ID}; PRAGMA user_version = {FORMAT}; {_SCHEMA}"
                )
        else:
            _check(database)
        database.execute("PRAGMA journal_mode = WAL")
        database.execute("PRAGMA synchronous = NORMAL")
        return database, _read(database)
    except BaseException:
        database.close()
        raise


def _is_of_the_disk(error: Exception) -> bool:
    """Whether the disk or another process prevents the access: the file itself may be good."""
    return isinstance(error, sqlite3.OperationalError) and not str(error).startswith("no such")


def _in_memory() -> sqlite3.Connection:
    database = sqlite3.connect(":memory:", check_same_thread=False)
    database.executescript(_SCHEMA)
    return database


def _read_unwritable(file: Path) -> StoredState:
    """Return the content of a file on a disk to which SQLite cannot write even its auxiliary files."""
    try:
        with contextlib.closing(sqlite3.connect(f"{file.as_uri()}?immutable=1", uri=True)) as database:
            _check(database)
            return _read(database)
    except (OSError, sqlite3.Error, PiprosError, ValueError, KeyError):
        return StoredState((), (), {})


def _check(database: sqlite3.Connection) -> None:
    [application] = database.execute("PRAGMA application_id").fetchone()
    if application != APPLICATION_ID:
        raise PiprosError("the file is another program's SQLite database")
    [version] = database.execute("PRAGMA user_version").fetchone()
    if version != FORMAT:
        raise PiprosError(f"the file's format must be {FORMAT}, got {version}")
    [verdict] = database.execute("PRAGMA quick_check(1)").fetchone()
    if verdict != "ok":
        raise PiprosError(f"the file is damaged: {verdict}")


def _read(database: sqlite3.Connection) -> StoredState:
    def parameters() -> Iterator[tuple[str, Any]]:
        for key, value in database.execute("SELECT key, value FROM parameters ORDER BY number"):
            if value:
                yield key, decode_response(value)
            else:
                yield key, Absence.DELETED if value is None else Absence.NAMESPACE

    rows = database.execute("SELECT role, node, key, api, service_api FROM registrations ORDER BY number")
    return StoredState(
        parameters=tuple(parameters()),
        registrations=tuple(Registration(Role[role], *rest) for role, *rest in rows),
        topic_types=dict(database.execute("SELECT topic, type FROM topic_types")),
    )


def _move_aside(file: Path) -> Path:
    number = 1
    while (aside := file.with_name(f"{file.name}.unusable-{number}")).exists():
        number += 1
    replace_file(file, aside)
    for suffix in ("-wal", "-shm"):
        with contextlib.suppress(FileNotFoundError):
            replace_file(f"{file}{suffix}", f"{aside}{suffix}")
    return aside


def restore_params(params: ParamTree, state: StoredState) -> None:
    """Set the stored parameters in their original order. Log each parameter that would exceed the limit."""
    for key, value in state.parameters:
        try:
            _restore(params, key, value)
        except ParamsFull as error:
            _log.error("%s was not restored: %s", key, error)


def _restore(params: ParamTree, key: str, value: object) -> None:
    if value is Absence.NAMESPACE:
        if not (params.has(key) and isinstance(params.get(key), dict)):
            params.set(key, {})
    elif value is not Absence.DELETED:
        params.set(key, value)
    elif params.has(key):
        params.delete(key)


def restore_registrations(registry: Registry, state: StoredState, nodes: set[str]) -> None:
    """Restore the registrations of `nodes` and all topic types. The nodes are not notified."""
    for topic, type_name in state.topic_types.items():
        registry.restore_type(topic, type_name)
    for found in state.registrations:
        if found.node in nodes:
            registry.restore(found.role, found.node, found.key, found.api, found.service_api)
