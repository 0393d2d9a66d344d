"""Tables and bags behave like data, as users of notebooks expect."""

from __future__ import annotations

import math
import pickle
from datetime import date, datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
import pyarrow as pa
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from sensor_msgs.msg import Image, Imu
from std_msgs.msg import Int32, String

import pipros_data
from pipros.msg.time import Time
from pipros_data import Table, open_bags
from pipros_data.bags import NoSuchTopic
from pipros_data.moments import moment_ns
from pipros_data.sql import QueryError
from pipros_tools.bag.errors import BagError
from tests.support.bags import bag_bytes


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    rows: list[Any] = [("/n", Int32(n), 1000 + n, 0) for n in range(12)]
    rows += [("/text", String("a" * n), 1020 + n, 0) for n in range(3)]
    rows += [
        ("/image", Image(encoding="mono8", height=1, width=1, step=1, data=bytes([n])), 1030 + n, 0)
        for n in range(4)
    ]
    Path("a.bag").write_bytes(bag_bytes(rows))
    Path("b.bag").write_bytes(bag_bytes([("/n", Int32(12), 1100, 0), ("/imu", Imu(), 1101, 0)]))


def table_of(topic: str = "/n") -> Table:
    with open_bags("a.bag") as bags:
        return bags.table(topic)


def test_the_length_and_shape_of_a_table_are_those_of_its_rows() -> None:
    table = table_of()
    assert (len(table), table.shape, list(table)) == (12, (12, 2), ["_time", "data"])
    assert "data" in table
    assert "nothing" not in table
    assert table.get("nothing", 5) == 5
    assert [name for name, _ in table.items()] == list(table.keys())
    assert [column.tolist() for column in table.values()][1] == list(range(12))
    assert dict(table)["data"].tolist() == list(range(12))


def test_rows_and_columns_are_chosen_as_in_data_frames() -> None:
    table = table_of()
    assert table[:5]["data"].tolist() == table.head()["data"].tolist() == [0, 1, 2, 3, 4]
    assert (table[::-4]["data"].tolist(), table.tail(2)["data"].tolist()) == ([11, 7, 3], [10, 11])
    assert table.head(0).shape == table.tail(0).shape == (0, 2)
    assert table[table["data"] > 9]["data"].tolist() == [10, 11]
    assert table[[3, 1]]["data"].tolist() == [3, 1]
    assert (table[-1], table[np.int64(0)]["data"]) == ({"_time": 1011_000_000_000, "data": 11}, 0)
    assert table[["data"]].shape == (12, 1)
    with pytest.raises(KeyError, match=r"no column 'x' in /\w+; the columns are _time, data"):
        table["x"]
    for name, advice in (("data", r"table\['data'\] is a column"), ("iloc", r"table.to_pandas\(\).iloc may")):
        with pytest.raises(AttributeError, match=f"a Table has no attribute '{name}'; {advice}"):
            getattr(table, name)


@pytest.mark.parametrize("rows", [
    slice(1, 3), slice(None, None, -2), [2, 0, 0], np.array([1]), [True, False, True], []
])  # fmt: skip
def test_all_columns_select_rows_as_arrays_do(rows: Any) -> None:
    lists: list[Any] = [("/a", DiagnosticArray(status=[DiagnosticStatus()] * n), n + 1, 0) for n in range(3)]
    Path("c.bag").write_bytes(bag_bytes(lists))
    with open_bags("a.bag", "c.bag") as bags:
        images, lists = bags.table("/image", columns=["_image"])["_image"][:3], bags["/a"]["status"]
    texts, records = table_of("/text")["data"], lists.values
    chosen = np.arange(3)[rows].tolist()
    assert (len(records[rows]), [len(cell) for cell in lists[rows]]) == (len(chosen), chosen)
    assert [image.item() for image in images[rows]] == [len(text) for text in texts[rows]] == chosen


def test_gaps_follow_their_rows_and_columns() -> None:
    with open_bags("a.bag", "b.bag") as bags:
        joined = bags.asof("/n", "/text")
    assert joined.gaps["text.data"].tolist() == [True] * 12 + [False]
    assert joined.tail(1).gaps["text.data"].tolist() == [False]
    assert joined[["text.data"]].to_arrow()["text.data"].to_pylist() == [None] * 12 + ["aa"]


def test_arrow_programs_take_a_table_as_it_is() -> None:
    numbers = table_of()
    assert pa.table(numbers).equals(numbers.to_arrow())
    assert duckdb.sql("SELECT sum(data) FROM numbers").fetchall() == [(66,)]


@pytest.mark.parametrize("use", [np.asarray, np.array, lambda table: np.mean(table)])
def test_a_table_is_never_a_wrong_array(use: Any) -> None:
    """pandas.DataFrame(table) calls numpy.asarray, which would make one column of the names."""
    with pytest.raises(TypeError, match=r"table\.to_pandas\(\), pandas\.DataFrame\.from_arrow\(table\)"):
        use(table_of())


def test_tables_can_be_pickled() -> None:
    copy = pickle.loads(pickle.dumps(table_of("/text")))  # noqa: S301 # it was written here
    assert list(copy["data"]) == ["", "a", "aa"]


def test_rows_beyond_the_table_and_completions_are_named() -> None:
    with open_bags("a.bag") as bags:
        table = bags["/n"]
        assert bags._ipython_key_completions_() == bags.topics()
        assert len(bags) == len(bags.topics())
        assert table._ipython_key_completions_() == list(table)
        for row in (table.rows, -table.rows - 1):
            with pytest.raises(IndexError, match=f"no row {row}; the table has {table.rows} rows"):
                table[row]


def test_bags_are_opened_from_lists() -> None:
    with open_bags(sorted(Path().glob("*.bag"))) as bags, open_bags("a.bag", ["b.bag"]) as same:
        assert bags.topics() == same.topics() == ["/image", "/imu", "/n", "/text"]
        assert bags.count("/n") == 13


def test_bags_are_asked_for_topics_times_and_rows() -> None:
    with open_bags("a.bag", "b.bag") as bags:
        assert "/imu" in bags
        assert "/nothing" not in bags
        assert list(bags) == bags.topics()
        assert bags["/n"].rows == 13
        with pytest.raises(NoSuchTopic, match="the topics are /image, /imu, /n, /text"):
            bags["/nothing"]
        assert bags.duration == 101.0
        assert [[topic.topic for topic in each.topics] for each in bags.info()] == [
            ["/image", "/n", "/text"],
            ["/imu", "/n"],
        ]
        assert bags.query("SELECT count(*) AS n, max(data) AS most FROM n", end=1005)["n"].to_pylist() == [6]
        joined = bags.query("SELECT 1 AS a, 2 AS a_1, 3 AS a, 4 AS a")
        assert joined.to_pylist() == [{"a": 1, "a_1": 2, "a_2": 3, "a_3": 4}]
        with pytest.raises(QueryError, match="must be a single SELECT"):
            bags.query("DROP TABLE n")


def test_only_the_wanted_columns_are_kept() -> None:
    with open_bags("b.bag") as bags:
        table = bags.table("/imu", columns=["orientation.w", "header.frame_id"])
        assert list(table) == ["_time", "orientation.w", "header.frame_id"]
        assert [list(each) for each in bags.batches("/imu", columns=["_time"])] == [["_time"]]
        assert list(bags.table("/n", columns="data")) == ["_time", "data"]
        with pytest.raises(
            KeyError, match=r"no column 'nothing' in /imu; the columns are _time, header\.seq"
        ):
            bags.table("/imu", columns=["nothing"])


class PandasTime(datetime):
    """Like a pandas.Timestamp, which is a datetime with nanoseconds."""

    nanosecond = 7


DAY = datetime(1970, 1, 1, tzinfo=timezone.utc)
NOON = datetime(2014, 1, 1, 12, tzinfo=timezone.utc)
NS = 1388577600_000_000_000


@pytest.mark.parametrize(("moment", "expected"), [
    (None, None), (Time(5, 6), 5_000_000_006), (5, 5_000_000_000), (np.float32(0.5), 500_000_000),
    (-1.0, 0), ("2014-01-01", NS - 43200_000_000_000), ("2014-01-01 12:00", NS),
    (" 2014-01-01T12:00:00.000000007Z", NS + 7), ("2014-01-01T14:00:00+02:00", NS), (NOON, NS),
    (NOON.replace(tzinfo=None), NS), (NOON.astimezone(timezone(timedelta(hours=-5))), NS),
    (PandasTime(2014, 1, 1, 12, tzinfo=timezone.utc), NS + 7), (np.datetime64("2014-01-01T12", "h"), NS),
    ("1960-01-01", 0), (date(2014, 1, 1), NS - 43200_000_000_000),
])  # fmt: skip
def test_times_are_written_in_many_ways(moment: Any, expected: int | None) -> None:
    assert moment_ns(moment) == expected


@pytest.mark.parametrize(
    "moment", ["noon", "10", "2014-13-01", "", b"2014-01-01", [5], math.nan, np.datetime64("NaT"), True]
)
def test_what_is_no_time_is_refused(moment: Any) -> None:
    with open_bags("a.bag") as bags, pytest.raises((TypeError, ValueError), match="a time must be"):
        bags.table("/n", start=moment)


def test_rows_are_chosen_by_dates() -> None:
    with open_bags("a.bag") as bags:
        table = bags.table("/n", start="1970-01-01T00:16:45", end=DAY.replace(minute=16, second=47))
        assert table["data"].tolist() == [5, 6, 7]


@pytest.mark.parametrize(
    ("paths", "error"), [([], ValueError), (3, TypeError), ([3], TypeError), (b"a", TypeError)]
)
def test_paths_that_name_no_bag_are_refused(paths: Any, error: type[Exception]) -> None:
    """`glob` returns an empty list if nothing matches."""
    with pytest.raises(error):
        open_bags(paths)
    with open_bags("a.bag") as bags, pytest.raises(TypeError, match="needs the name of a topic"):
        bags[0]  # type: ignore[index]


def test_public_names_are_listed() -> None:
    assert {"open_bags", "Table", "Bags"} <= set(dir(pipros_data))
    assert not {"annotations", "TYPE_CHECKING"} & set(dir(pipros_data))


def test_closed_bags_say_so() -> None:
    with open_bags("a.bag") as bags:
        pass
    for ask in (lambda: bags.table("/n"), lambda: bags.query("SELECT * FROM n"), lambda: bags.tables()):
        with pytest.raises(BagError, match=r"a\.bag is closed"):
            ask()
