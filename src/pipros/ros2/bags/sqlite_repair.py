"""Recover damaged `.db3` files: records are copied to a new database, whatever their encoding."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path
from typing import BinaryIO

from pipros.bag.errors import BagFormatError
from pipros.ros2.bags.sqlite_files import TABLES, check_tables, opened_database


def recover(path: Path, file: BinaryIO) -> list[str]:
    """Copy the readable rows of the tables of a ROS 2 bag, and add the index.

    A table whose rows cannot be read any further loses its remaining rows. Return descriptions of the damage;
    the list is empty if there is none.

    Raises:
        BagFormatError: the topics and messages cannot be read at all.
    """
    damage: list[str] = []
    target = Path(file.name)
    with closing(opened_database(path)) as old, closing(sqlite3.connect(target, isolation_level=None)) as new:
        try:
            old.execute("PRAGMA writable_schema = ON")  # otherwise, SQLite refuses files that are too short
            check_tables(old, str(path))
        except sqlite3.Error as error:
            raise BagFormatError(f"{path} cannot be recovered: {error}") from error
        new.execute("PRAGMA journal_mode = OFF")
        new.execute("PRAGMA synchronous = OFF")
        new.execute("BEGIN")
        for table in TABLES:
            columns = [_column(*row) for row in old.execute(f"PRAGMA table_info({table})")]
            if not columns and table in ("topics", "messages"):
                raise BagFormatError(f"{path} cannot be recovered: the table {table} has no columns")
            if not columns:
                continue
            new.execute(f"CREATE TABLE {table}({', '.join(columns)})")
            if lost := _copied(old, new, table):
                damage.append(f"{path}: {lost}")
        new.execute("CREATE INDEX IF NOT EXISTS timestamp_idx ON messages (timestamp ASC)")
        new.execute("COMMIT")
    return damage


def _column(_number: int, name: str, kind: str, not_null: int, _default: object, key: int) -> str:
    """Return a column's declaration. The file's own text is not executed, because it may be hostile."""
    quoted = '"' + name.replace('"', '""') + '"'
    known = kind.upper() if kind.upper() in ("INTEGER", "TEXT", "BLOB") else ""
    return f"{quoted} {known}{' PRIMARY KEY' if key else ''}{' NOT NULL' if not_null else ''}"


def _copied(old: sqlite3.Connection, new: sqlite3.Connection, table: str) -> str:
    """Copy rows in the order of their numbers. Return a description of the damage."""
    count = 0
    try:
        for row in old.execute(f"SELECT * FROM {table}"):  # noqa: S608 # a name in TABLES
            places = ", ".join("?" * len(row))
            new.execute(f"INSERT OR REPLACE INTO {table} VALUES ({places})", row)  # noqa: S608
            count += 1
    except sqlite3.Error as error:
        return f"after {count} rows of the table {table}: {error}"
    return ""
