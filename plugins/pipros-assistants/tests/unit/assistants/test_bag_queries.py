"""SQL of assistants, which `pipros_data` runs: it neither reads nor writes files, and has limits."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.assistants import LocalAssistant
from tests.support.constants import Constants
from tests.unit.assistants.conftest import NOBODY, SECRET


def test_rows_are_selected_with_sql(assistant: LocalAssistant) -> None:
    reply = assistant.call("query_bag", bag="run.bag", sql='SELECT max(data) AS m, count(*) FROM "/a"')
    assert reply.data == [["m", "count_star()"], ["28", "15"]]


# Of the statements in the tests of `rosbag query`, one that reads and one that writes; then its options.
@pytest.mark.parametrize("sql", [
    "SELECT * FROM '{secret}'", "COPY a TO '{folder}/written.csv'", "-o {folder}/written.csv",
    "--output={folder}/written.csv",
])  # fmt: skip
def test_sql_reads_and_writes_no_files(assistant: LocalAssistant, folder: Path, sql: str) -> None:
    before = sorted(folder.iterdir())
    reply = assistant.call(
        "query_bag", bag="run.bag", sql=sql.format(secret=folder.parent / "secret.csv", folder=folder)
    )
    assert reply.is_error
    assert SECRET not in reply.text
    assert sorted(folder.iterdir()) == before


def test_a_query_has_a_time_limit(folder: Path, constants: Constants) -> None:
    constants(ASSISTANT_QUERY_S=1.0)
    assistant = LocalAssistant(NOBODY, folder)
    endless = "SELECT count(*) FROM range(1000000000) x, range(1000000000) y"
    assert "longer than 1 s" in assistant.call("query_bag", bag="run.bag", sql=endless).data


@pytest.mark.needs("resource limits")
def test_a_query_has_a_memory_limit(folder: Path, constants: Constants) -> None:
    constants(ASSISTANT_QUERY_BYTES=50_000_000)
    assistant = LocalAssistant(NOBODY, folder)
    assert assistant.call("query_bag", bag="run.bag", sql="SELECT count(*) FROM a").is_error
