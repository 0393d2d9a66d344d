"""The tools for bags: nothing outside the folder is read."""

import base64
import io
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from pipros_assistants.tools import bags as bag_tools
from tests.support.assistants import LocalAssistant
from tests.support.constants import Constants
from tests.unit.assistants.conftest import NOBODY, SECRET


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


def test_messages_are_chosen_by_their_texts_and_values(assistant: LocalAssistant) -> None:
    def read(**more: Any) -> Any:
        return assistant.call("read_bag", bag="run.bag", part="data", **more)

    rows = read(topic="/a", where="data >= 10 and data != 12").data
    assert [row["message"] for row in rows] == [10, 14, 16, 18, 20, 22, 24, 26, 28]
    assert read(topic="/a", where="data >= 10", cursor=8).data == rows[7:]
    texts = [row["message"] for row in read(topic="/b").data]
    assert [row["message"] for row in read(topic="/b", contains=texts[3].upper()).data] == [texts[3]]
    assert [row["message"] for row in read(topic="/b", where=f"data == '{texts[3]}'").data] == [texts[3]]


@pytest.mark.parametrize(("where", "rule"), [
    ("data", "where must be PART OPERATOR VALUE"), ("__import__('os')", "where must be PART OPERATOR VALUE"),
    ("data > 1 or data < 0", "where must be PART OPERATOR VALUE"),
    ("data == 'a'", "where compares numbers with numbers"),
    ("date > 1", "the messages do not have this part"),
])  # fmt: skip
def test_a_malformed_condition_is_a_short_error(assistant: LocalAssistant, where: str, rule: str) -> None:
    reply = assistant.call("read_bag", bag="run.bag", topic="/a", where=where)

    assert reply.is_error
    assert reply.fields["error"].startswith(rule)


def test_numbers_are_plotted(assistant: LocalAssistant) -> None:
    reply = assistant.call("plot_bag", bag="run.bag", topic="/a", parts=["data"])
    [row] = reply.data
    assert (row["points"], row["min"], row["max"]) == (15, 0.0, 28.0)
    [picture] = reply.pictures
    image = Image.open(io.BytesIO(base64.b64decode(picture.data))).convert("RGB")
    assert row["colour"] in {"#%02x%02x%02x" % color for _, color in image.getcolors(10**6) or ()}  # noqa: UP031
    assert assistant.call("plot_bag", bag="run.bag", topic="/b", parts=["data"]).is_error, "texts"


@pytest.mark.parametrize("bag", [
    "../secret.bag", "link.bag", "/etc/passwd", "package://rospy/../../secret.bag",
    "$(find rospy)/../secret.bag", "file:///etc/passwd.bag", "*.bag", "run.bag/../../secret.bag",
])  # fmt: skip
@pytest.mark.parametrize(("tool", "more"), [
    ("describe_bag", {}), ("read_bag", {"topic": "/a"}), ("show_bag", {"topic": "/a"}),
    ("plot_bag", {"topic": "/a", "parts": ["data"]}), ("query_bag", {"sql": "SELECT 1"}),
])  # fmt: skip
def test_no_other_file_is_opened(assistant: LocalAssistant, tool: str, more: Any, bag: str) -> None:
    reply = assistant.call(tool, bag=bag, **more)
    assert reply.is_error
    assert SECRET not in reply.text


def test_without_a_folder_there_are_no_bags() -> None:
    assert "--bags FOLDER" in LocalAssistant(NOBODY).call("list_bags").fields["error"]


def test_an_installation_without_queries_says_so(assistant: LocalAssistant, monkeypatch) -> None:
    monkeypatch.setattr(bag_tools, "offered", lambda name: None)
    assert "lacks" in assistant.call("query_bag", bag="run.bag", sql="SELECT 1").fields["error"]


# SQL of assistants, which `pipros_data` runs: it neither reads nor writes files, and has limits.


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
