"""What the master knows, kept in a file, so that it can go on after a crash.

An SQLite database in WAL mode: a process that is killed at any moment loses at most what it did in
the last `PAUSE_S`, and leaves no half of anything. Parameters are kept as the calls that set
them, in order; a call removes those that it makes superfluous, so the file does not grow with time.

The file is written by a thread of its own: at once when little happens, else every `PAUSE_S` what
came meanwhile. Callers never wait for it. Nothing waits for the disk itself either: what was written is
safe from the end of the process; when the computer loses its power the file stays whole, and its last
moments may be missing.
"""

from __future__ import annotations

import contextlib
import logging
import queue
import sqlite3
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any, Final

from pipros.errors import PiprosError
from pipros.master.params import ParamTree
from pipros.master.registry import Registry, Role
from pipros.wire.xmlrpc import decode_response, encode_response

_log = logging.getLogger("rosmaster.master")

PAUSE_S: Final = 0.02
APPLICATION_ID: Final = 0x70697072
"""`pipr`; by it a store is told from any other SQLite file."""
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


@dataclass(frozen=True, slots=True)
class Registration:
    """One registration as it was kept."""

    role: Role
    node: str
    key: str
    api: str
    service_api: str | None


@dataclass(frozen=True, slots=True)
class Kept:
    """What a store had when it was opened.

    Attributes:
        parameters: key and value in the order to set them; or what became of the key without a value.
        registrations: in the order they were made.
        topic_types: topic to type.
    """

    parameters: tuple[tuple[str, Any], ...]
    registrations: tuple[Registration, ...]
    topic_types: dict[str, str]


class Fate(Enum):
    """Stands for a value where there is none."""

    DELETED = "deleted, below a namespace that was set as a whole"
    NAMESPACE = "a namespace, in which there may be nothing"


class Store:
    """The journal of a registry and a parameter tree (`RegistryJournal`, `ParamJournal`) in a file.

    Attributes:
        kept: what was in the file when it was opened.
        set_aside: where a file was moved that could not be used; None when there was none.
    """

    def __init__(self, file: Path) -> None:
        """Opens or makes the file. One that is torn or of other making is set aside, not changed.

        Raises:
            OSError: the folder cannot be made or the unusable file cannot be moved.
        """
        self.file = file
        self.set_aside: Path | None = None
        file.parent.mkdir(parents=True, exist_ok=True)
        try:
            self._database, self.kept = _open(file)
        except (sqlite3.Error, PiprosError, ValueError, KeyError) as error:
            self.set_aside = _move_aside(file)
            _log.error("%s is no store of a master (%s); moved to %s", file, error, self.set_aside)
            self._database, self.kept = _open(file)
        self._changes: queue.SimpleQueue[tuple[str, tuple[Any, ...]] | None] = queue.SimpleQueue()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._write, name="master store", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Writes what is left to write and closes the file."""
        self._closing.set()
        self._changes.put(None)
        self._thread.join()

    # ---- the journal

    def param_set(self, key: str, value: Any) -> None:
        self._supersede(key)
        # Encoded by the writer: the tree never changes a value that it holds.
        self._changes.put(("INSERT INTO parameters (key, value) VALUES (?, ?)", (key, _Value(value))))

    def param_deleted(self, key: str) -> None:
        self._supersede(key)
        parts = key.split("/")[1:-1]
        above = ["/", *("/" + "/".join(parts[: count + 1]) for count in range(len(parts)))]
        # The deletion itself is kept only below a namespace that was set as a whole.
        one_of = ", ".join("?" * len(above))
        statement = (
            "INSERT INTO parameters (key, value) SELECT ?, NULL "  # noqa: S608  # only question marks
            f"WHERE EXISTS (SELECT 1 FROM parameters WHERE value != x'' AND key IN ({one_of}))"
        )
        self._changes.put((statement, (key, *above)))
        if parts:  # the namespace stays, though nothing may be left in it
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
        """Strikes all registrations out; those that are still good are entered again."""
        self._changes.put(("DELETE FROM registrations", ()))

    def typed(self, topic: str, type_name: str) -> None:
        self._changes.put(("INSERT OR REPLACE INTO topic_types VALUES (?, ?)", (topic, type_name)))

    def _supersede(self, key: str) -> None:
        if key == "/":
            self._changes.put(("DELETE FROM parameters", ()))
        else:  # "0" is the character after "/": the keys between are those below
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
            self._closing.wait(PAUSE_S)
        self._database.close()


_ON_CONFLICT: Final = (
    " ON CONFLICT (role, node, key) DO UPDATE SET api = excluded.api, service_api = excluded.service_api"
)


class _Value:
    __slots__ = ("value",)

    def __init__(self, value: Any) -> None:
        self.value = value


def _plain(item: Any) -> Any:
    return encode_response(item.value) if isinstance(item, _Value) else item


def _open(file: Path) -> tuple[sqlite3.Connection, Kept]:
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


def _check(database: sqlite3.Connection) -> None:
    [application] = database.execute("PRAGMA application_id").fetchone()
    if application != APPLICATION_ID:
        raise PiprosError("an SQLite database of another program")
    [version] = database.execute("PRAGMA user_version").fetchone()
    if version != FORMAT:
        raise PiprosError(f"of format {version}; this pipros knows format {FORMAT}")
    [verdict] = database.execute("PRAGMA quick_check(1)").fetchone()
    if verdict != "ok":
        raise PiprosError(f"damaged: {verdict}")


def _read(database: sqlite3.Connection) -> Kept:
    def parameters() -> Iterator[tuple[str, Any]]:
        for key, value in database.execute("SELECT key, value FROM parameters ORDER BY number"):
            if value:
                yield key, decode_response(value)
            else:
                yield key, Fate.DELETED if value is None else Fate.NAMESPACE

    rows = database.execute("SELECT role, node, key, api, service_api FROM registrations ORDER BY number")
    return Kept(
        parameters=tuple(parameters()),
        registrations=tuple(Registration(Role[role], *rest) for role, *rest in rows),
        topic_types=dict(database.execute("SELECT topic, type FROM topic_types")),
    )


def _move_aside(file: Path) -> Path:
    number = 1
    while (aside := file.with_name(f"{file.name}.unusable-{number}")).exists():
        number += 1
    file.rename(aside)
    for suffix in ("-wal", "-shm"):
        with contextlib.suppress(FileNotFoundError):
            file.with_name(file.name + suffix).rename(aside.with_name(aside.name + suffix))
    return aside


def restore_params(params: ParamTree, kept: Kept) -> None:
    """Sets the kept parameters in the order they were set."""
    for key, value in kept.parameters:
        if value is Fate.NAMESPACE:
            if not (params.has(key) and isinstance(params.get(key), dict)):
                params.set(key, {})
        elif value is not Fate.DELETED:
            params.set(key, value)
        elif params.has(key):
            params.delete(key)


def restore_registrations(registry: Registry, kept: Kept, nodes: set[str]) -> None:
    """Enters the kept registrations of `nodes` and all topic types. Nobody is notified: they know."""
    for topic, type_name in kept.topic_types.items():
        registry.restore_type(topic, type_name)
    for found in kept.registrations:
        if found.node in nodes:
            registry.restore(found.role, found.node, found.key, found.api, found.service_api)
