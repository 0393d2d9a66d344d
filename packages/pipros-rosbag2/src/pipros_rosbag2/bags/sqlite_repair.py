"""Recover damaged `.db3` files: records are copied to a new database, whatever their encoding."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any, BinaryIO

from pipros_rosbag2.bags.sqlite_files import TABLES, check_tables, opened_database, writing
from pipros_tools.bag.errors import BagFormatError

_NEEDED = {"topics": {"id", "name", "type"}, "messages": {"topic_id", "timestamp", "data"}}
"""The columns without which no message can be read, by table."""


def recover(path: Path, file: BinaryIO) -> list[str]:
    """Copy the readable rows of the tables of a ROS 2 bag, and add the index.

    A table whose rows cannot be read any further loses its remaining rows, and a row with a value that its
    column does not allow is left out. Return descriptions of the damage; the list is empty if there is none.

    Raises:
        BagFormatError: the topics and messages cannot be read at all.
        BagError: the new file cannot be written.
    """
    damage: list[str] = []
    target = Path(file.name)
    with closing(opened_database(path)) as old, writing(target), closing(sqlite3.connect(target)) as new:
        columns_of = _columns(old, path)
        new.isolation_level = None
        new.execute("PRAGMA journal_mode = OFF")
        new.execute("PRAGMA synchronous = OFF")
        new.execute("BEGIN")
        for table, columns in columns_of.items():
            new.execute(f"CREATE TABLE {table}({', '.join(columns)})")
            damage += [f"{path}: {lost}" for lost in _copied(old, new, table)]
        new.execute("CREATE INDEX IF NOT EXISTS timestamp_idx ON messages (timestamp ASC)")
        new.execute("COMMIT")
    return damage


def _columns(old: sqlite3.Connection, path: Path) -> dict[str, list[str]]:
    """Return the declarations of the columns of each table that the bag has."""
    try:
        old.execute("PRAGMA writable_schema = ON")  # otherwise, SQLite refuses files that are too short
        check_tables(old, str(path))
        rows = {table: old.execute(f"PRAGMA table_info({table})").fetchall() for table in TABLES}
        found = {table: [_column(*row) for row in columns] for table, columns in rows.items()}
    except sqlite3.Error as error:
        raise BagFormatError(f"{path} cannot be recovered: {error}") from error
    for table, needed in _NEEDED.items():
        if lacking := needed - {row[1] for row in rows[table]}:
            raise BagFormatError(
                f"{path} cannot be recovered: the table {table} has no column {min(lacking)}"
            )
    return {table: columns for table, columns in found.items() if columns}


def _column(_number: int, name: str, kind: str, not_null: int, _default: object, key: int) -> str:
    """Return a column's declaration. The file's own text is not executed, because it may be hostile."""
    quoted = '"' + name.replace('"', '""') + '"'
    known = kind.upper() if kind.upper() in ("INTEGER", "TEXT", "BLOB") else ""
    return (
        f"{quoted} {known}{' PRIMARY KEY' if key and name == 'id' else ''}{' NOT NULL' if not_null else ''}"
    )


def _copied(old: sqlite3.Connection, new: sqlite3.Connection, table: str) -> Iterator[str]:
    """Copy rows in the order of their numbers. Yield descriptions of the damage of the old database."""
    count = bad = 0
    reason: sqlite3.Error | None = None
    for row in _rows(old, table):
        if isinstance(row, sqlite3.Error):
            yield f"after {count} rows of the table {table}: {row}"
            break
        places = ", ".join("?" * len(row))
        try:
            new.execute(f"INSERT OR REPLACE INTO {table} VALUES ({places})", row)  # noqa: S608
            count += 1
        except sqlite3.IntegrityError as error:  # any other error is one of the new database
            bad += 1
            reason = reason or error
    if reason is not None:
        yield f"{bad} rows of the table {table} are left out: {reason}"


def _rows(old: sqlite3.Connection, table: str) -> Iterator[tuple[Any, ...] | sqlite3.Error]:
    """Yield the rows and, if no more can be read, the error."""
    try:
        yield from old.execute(f"SELECT * FROM {table}")  # noqa: S608 # a name in TABLES
    except sqlite3.Error as error:
        if str(error) == "interrupted":  # see `opened_database`
            raise KeyboardInterrupt from None
        yield error
