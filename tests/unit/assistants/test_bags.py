"""The tools for bags: nothing outside the folder is read, and SQL neither reads nor writes files."""

from __future__ import annotations

import base64
import io
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from pipros.assistants.tools import bags as bag_tools
from tests.support.assistants import LocalAssistant
from tests.support.bags import bag_bytes, some_rows

NOBODY = "http://127.0.0.1:1"
SECRET = "the content of another file"  # noqa: S105


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "secret.bag").write_text(SECRET)
    (tmp_path / "secret.csv").write_text(SECRET)
    bags = tmp_path / "bags"
    bags.mkdir()
    (bags / "run.bag").write_bytes(bag_bytes(some_rows()))
    (bags / "link.bag").symlink_to(tmp_path / "secret.bag")
    return bags


@pytest.fixture
def assistant(folder: Path) -> LocalAssistant:
    return LocalAssistant(NOBODY, folder)


def test_bags_are_described_and_read(assistant: LocalAssistant) -> None:
    assert assistant.call("list_bags").data == ["run.bag"]
    described = assistant.call("describe_bag", bag="run.bag").data
    assert described[0]["messages"] == 30
    assert described[1] == {"topic": "/a", "type": "std_msgs/Int32", "messages": 15}
    rows = assistant.call("read_bag", bag="run.bag", topic="/a", part="data", every=5).data
    assert [row["message"] for row in rows] == [0, 10, 20]
    again = assistant.call("read_bag", bag="run.bag", topic="/a", part="data", every=5, cursor=1).data
    assert again == rows[1:]
    later = assistant.call("read_bag", bag="run.bag", topic="/a", part="data", start_s=2.0).data
    assert [row["message"] for row in later] == [20, 22, 24, 26, 28]
    [row] = assistant.call("summarize_bag", bag="run.bag", topic="/a").data
    assert (row["values"], row["min"], row["max"]) == (15, 0.0, 28.0)


def test_numbers_are_plotted(assistant: LocalAssistant) -> None:
    reply = assistant.call("plot_bag", bag="run.bag", topic="/a", parts=["data"])
    [row] = reply.data
    assert (row["points"], row["min"], row["max"]) == (15, 0.0, 28.0)
    [picture] = reply.pictures
    image = Image.open(io.BytesIO(base64.b64decode(picture.data))).convert("RGB")
    assert row["colour"] in {"#%02x%02x%02x" % color for _, color in image.getcolors(10**6) or ()}  # noqa: UP031
    assert assistant.call("plot_bag", bag="run.bag", topic="/b", parts=["data"]).is_error, "texts"


@pytest.mark.parametrize(
    "bag",
    [
        "../secret.bag",
        "link.bag",
        "/etc/passwd",
        "package://rospy/../../secret.bag",
        "$(find rospy)/../secret.bag",
        "file:///etc/passwd.bag",
        "*.bag",
        "run.bag/../../secret.bag",
    ],
)
@pytest.mark.parametrize(
    ("tool", "more"),
    [
        ("describe_bag", {}),
        ("read_bag", {"topic": "/a"}),
        ("show_bag", {"topic": "/a"}),
        ("plot_bag", {"topic": "/a", "parts": ["data"]}),
        ("query_bag", {"sql": "SELECT 1"}),
    ],
)
def test_no_other_file_is_opened(assistant: LocalAssistant, tool: str, more: Any, bag: str) -> None:
    reply = assistant.call(tool, bag=bag, **more)
    assert reply.is_error
    assert SECRET not in reply.text


def test_without_a_folder_there_are_no_bags() -> None:
    assert "--bags FOLDER" in LocalAssistant(NOBODY).call("list_bags").fields["error"]


def test_rows_are_selected_with_sql(assistant: LocalAssistant) -> None:
    reply = assistant.call("query_bag", bag="run.bag", sql='SELECT max(data) AS m, count(*) FROM "/a"')
    assert reply.data == [["m", "count_star()"], ["28", "15"]]


@pytest.mark.parametrize(
    "sql",
    [
        "SELECT * FROM '{secret}'",
        "SELECT * FROM read_csv('{secret}')",
        "SELECT * FROM read_text('{secret}')",
        "SELECT * FROM read_blob('/etc/passwd')",
        "SELECT * FROM glob('/etc/*')",
        "COPY a TO '{folder}/written.csv'",
        "COPY (SELECT 1) TO '{folder}/written.csv'",
        "EXPORT DATABASE '{folder}/written'",
        "ATTACH '{folder}/written.db'",
        "INSTALL httpfs",
        "LOAD httpfs",
        "SET enable_external_access = true",
        "SELECT 1; COPY a TO '{folder}/written.csv'",
        "SELECT getenv('HOME')",
        "CREATE TABLE t AS SELECT * FROM a",
        "-o {folder}/written.csv",
        "--output={folder}/written.csv",
    ],
)
def test_sql_reads_and_writes_no_files(assistant: LocalAssistant, folder: Path, sql: str) -> None:
    before = sorted(folder.iterdir())
    reply = assistant.call(
        "query_bag", bag="run.bag", sql=sql.format(secret=folder.parent / "secret.csv", folder=folder)
    )
    assert reply.is_error
    assert SECRET not in reply.text
    assert sorted(folder.iterdir()) == before


def test_a_query_has_a_time_limit(folder: Path) -> None:
    assistant = LocalAssistant(NOBODY, folder, assistant_query_s=1.0)
    endless = "SELECT count(*) FROM range(1000000000) x, range(1000000000) y"
    assert "longer than 1 s" in assistant.call("query_bag", bag="run.bag", sql=endless).data


def test_a_query_has_a_memory_limit(folder: Path) -> None:
    assistant = LocalAssistant(NOBODY, folder, assistant_query_bytes=50_000_000)
    assert assistant.call("query_bag", bag="run.bag", sql="SELECT count(*) FROM a").is_error


def test_an_installation_without_queries_says_so(
    assistant: LocalAssistant, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bag_tools, "offered", lambda name: None)
    assert "lacks" in assistant.call("query_bag", bag="run.bag", sql="SELECT 1").fields["error"]
