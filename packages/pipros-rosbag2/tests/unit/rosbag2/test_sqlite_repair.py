"""Damaged `.db3` files: what is readable is copied, and no text of the file is executed."""

import sqlite3
from contextlib import closing
from itertools import count
from pathlib import Path
from typing import Any

import pytest

from pipros_rosbag2.bags import sqlite_repair
from pipros_rosbag2.bags.sqlite_files import SqliteReader
from pipros_rosbag2.bags.sqlite_repair import recover
from pipros_tools.bag.errors import BagError, BagFormatError

MESSAGES = "id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL"


@pytest.fixture
def damaged(tmp_path: Path) -> Path:
    path = tmp_path / "run.db3"
    with closing(sqlite3.connect(path)) as database:
        database.execute(
            'CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, "odd ""name" whatever, type TEXT)'
        )
        database.execute("INSERT INTO topics VALUES (1, '/a', 5, '')")
        database.execute(f"CREATE TABLE messages({MESSAGES})")
        rows = [(1, number, bytes(500)) for number in range(500)]
        database.executemany("INSERT INTO messages VALUES (NULL, ?, ?, ?)", rows)
        database.commit()
    return path


def change(path: Path, *statements: str) -> None:
    with closing(sqlite3.connect(path)) as database:
        for statement in statements:
            database.execute(statement)
        database.commit()


def recovered(path: Path) -> tuple[list[str], sqlite3.Connection]:
    target = path.with_name("copy.db3")
    with target.open("wb") as file:
        damage = recover(path, file)
    return damage, sqlite3.connect(target)


def test_all_rows_and_columns_are_copied(damaged: Path) -> None:
    damage, copy = recovered(damaged)
    with closing(copy):
        assert damage == []
        assert copy.execute('SELECT id, name, "odd ""name" FROM topics').fetchall() == [(1, "/a", 5)]
        assert copy.execute("SELECT timestamp FROM messages").fetchall() == [(n,) for n in range(500)]
        assert [row[5] for row in copy.execute("PRAGMA table_info(messages)")] == [1, 0, 0, 0]
        assert copy.execute("SELECT name FROM sqlite_master WHERE type = 'index'").fetchall() == [
            ("timestamp_idx",)
        ]


def test_rows_before_the_damage_are_copied_and_the_damage_is_described(damaged: Path) -> None:
    content = damaged.read_bytes()
    damaged.write_bytes(content[: len(content) // 2])
    damage, copy = recovered(damaged)
    with closing(copy):
        (count,) = copy.execute("SELECT count(*) FROM messages").fetchone()
        assert 100 < count < 400
        assert [line for line in damage if "NOT NULL constraint failed" not in line] == damage[:1]
        assert f"after {count} rows of the table messages: " in damage[0]


def test_a_row_that_its_table_does_not_allow_is_left_out(damaged: Path) -> None:
    schema, write = "UPDATE sqlite_master SET sql = replace(sql, '{}', '{}')", "PRAGMA writable_schema = ON"
    change(damaged, write, schema.format("data BLOB NOT NULL", "data BLOB"))
    nothing = "UPDATE messages SET data = NULL WHERE id IN (1, 250, 500)"
    change(damaged, nothing, write, schema.format("data BLOB", "data BLOB NOT NULL"))
    damage, copy = recovered(damaged)
    with closing(copy):
        assert copy.execute("SELECT count(*) FROM messages").fetchone() == (497,)
    assert damage == [
        f"{damaged}: 3 rows of the table messages are left out: NOT NULL constraint failed: messages.data"
    ]


def test_a_full_disk_does_not_count_as_damage(damaged: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    connect = sqlite3.connect

    def small(path: str | Path, **options: Any) -> sqlite3.Connection:
        database = connect(path, **options)
        if "copy" in str(path):
            database.execute("PRAGMA max_page_count = 20")
        return database

    monkeypatch.setattr(sqlite3, "connect", small)
    with pytest.raises(BagError, match=r"cannot write .*copy\.db3: database or disk is full"):
        recovered(damaged)


def test_ctrl_c_while_rows_are_read_does_not_count_as_damage(
    damaged: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened = sqlite_repair.opened_database

    def interrupted(path: Path) -> sqlite3.Connection:
        database = opened(path)
        steps = count()
        database.set_progress_handler(lambda: next(steps) > 100, 20)
        return database

    monkeypatch.setattr(sqlite_repair, "opened_database", interrupted)
    with pytest.raises(KeyboardInterrupt):
        recovered(damaged)


def test_a_file_without_readable_tables_is_refused(damaged: Path) -> None:
    damaged.write_bytes(damaged.read_bytes()[:100] + bytes(5000))
    with pytest.raises(BagFormatError, match=r"run\.db3 cannot be recovered"):
        recovered(damaged)


def test_a_table_whose_text_was_changed_executes_nothing(damaged: Path) -> None:
    endless = "WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x FROM n) SELECT x FROM n"
    text = f"UPDATE sqlite_master SET sql = 'CREATE TABLE topics AS {endless}' WHERE name = 'topics'"  # noqa: S608
    change(damaged, "PRAGMA writable_schema = ON", text)
    with pytest.raises(
        BagFormatError, match=r"run\.db3 cannot be recovered: the table topics has no column id"
    ):
        recovered(damaged)


def test_columns_of_other_writers_are_copied_or_named(damaged: Path) -> None:
    with closing(sqlite3.connect(damaged)) as database:
        database.executescript(
            "DROP TABLE messages; CREATE TABLE messages(id INTEGER, topic_id, timestamp, data, "
            "PRIMARY KEY (id, topic_id)) WITHOUT ROWID; INSERT INTO messages VALUES (1, 1, 5, x'00');"
        )
        database.execute("ALTER TABLE topics RENAME COLUMN type TO kind")
        with pytest.raises(BagFormatError, match="the table topics has no column type"):
            recovered(damaged)
        database.execute("ALTER TABLE topics RENAME COLUMN kind TO type")
        database.execute("UPDATE topics SET name = CAST(x'2fff' AS TEXT) WHERE id = 1")
        database.commit()
    damage, copy = recovered(damaged)
    with closing(copy):
        assert damage == []
        assert copy.execute("SELECT name FROM topics").fetchall() == [("/\ufffd",)]
        assert copy.execute("SELECT timestamp FROM messages").fetchall() == [(5,)]


def test_a_file_that_a_recorder_still_writes_is_not_called_damaged(damaged: Path) -> None:
    change(damaged, "ALTER TABLE topics ADD serialization_format", "CREATE INDEX i ON messages(timestamp)")
    change(damaged, "UPDATE messages SET data = zeroblob(9000)")
    with closing(SqliteReader(damaged)) as reader:
        rows = reader.messages({1}, 0, 500, print)
        next(rows)
        with damaged.open("r+b") as file:
            file.truncate(9000)
        with pytest.raises(BagError, match="another program changed it while it was read"):
            list(rows)
