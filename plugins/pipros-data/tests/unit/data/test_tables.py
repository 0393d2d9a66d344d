"""Topics of bags as tables: choice of rows, several bags, formats, limits and damaged bags."""

import struct
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import PointStamped, TransformStamped
from sensor_msgs.msg import Imu, PointCloud2
from std_msgs.msg import Int32, String
from tf2_msgs.msg import TFMessage

from pipros.basics.errors import MissingExtra
from pipros.basics.limits import Limits
from pipros.msg.time import Time
from pipros_data import Bags, Table, open_bags
from pipros_data.bags import NoSuchTopic
from pipros_data.frames import with_transform
from pipros_data.limits import DataLimits
from pipros_data.nearest import matches
from pipros_libraries.transforms.buffer import TransformBuffer
from pipros_tools.bag import contents
from pipros_tools.bag.errors import BagError, BagFormatError
from pipros_tools.bag.writer import BagWriter
from pipros_tools.cli.rosbag import main as rosbag
from tests.support.bags import Row, bag_bytes, header_of, old_bag_bytes, some_rows
from tests.support.constants import Constants
from tests.support.environments import file_of_tests
from tests.support.random_messages import fill_at_random
from tests.unit.data.cells import cell, nested, plain, read_by_rosbags, same, seeded


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def numbers(first: int, count: int, topic: str = "/n") -> list[Row]:
    return [(topic, Int32(first + n), first + n, 5) for n in range(count)]


def written(name: str, rows: list[Row], **options: Any) -> str:
    Path(name).write_bytes(bag_bytes(rows, **options))
    return name


def with_limits(bags: Bags, **values: int) -> Bags:
    return Bags(bags.readers, Limits().with_table(DataLimits(**values)))


def test_tables_have_the_time_of_receipt_and_all_fields(folder: Path) -> None:
    with open_bags(written("run.bag", numbers(10, 3))) as bags:
        table = bags.table("/n")

    assert list(table) == ["_time", "data"]
    assert table["_time"].tolist() == [10_000_000_005, 11_000_000_005, 12_000_000_005]
    assert table["data"].tolist() == [10, 11, 12]
    assert repr(table) == "<Table of /n (std_msgs/Int32): 3 rows, 2 columns>"


def random_rows(count: int = 20) -> list[Row]:
    rng = seeded(1)
    kinds = {"/imu": Imu, "/point": PointStamped, "/text": String, "/cloud": PointCloud2}
    return [
        (topic, fill_at_random(kind(), rng), 10 + n, 5) for n in range(count) for topic, kind in kinds.items()
    ]


def checked(bags: Bags) -> int:
    """Compare every cell with what rosbags reads from the same messages. Return the number of rows."""
    rows = 0
    for topic in bags.topics():
        table = bags.table(topic)
        stored = [each for bag in bags.readers for each in bag.stored_messages(bag.connections_of(topic))]
        assert table["_time"].tolist() == [each.time_ns for each in stored]
        for row, each in enumerate(stored):
            got = nested({name: cell(table[name], row) for name in table if name != "_time"})
            theirs = plain(read_by_rosbags(each.connection.type, bytes(each.data)))
            assert same(theirs, got, each.connection.type) == []
            rows += 1
    return rows


@pytest.mark.parametrize("name", ["run.bag", "run.mcap", "old.bag", "small_chunks.bag", "lz4.bag"])
def test_tables_equal_rosbags_in_every_format(name: str, folder: Path) -> None:
    rows = random_rows()
    written("run.bag", rows)
    Path("old.bag").write_bytes(old_bag_bytes(rows))
    written("small_chunks.bag", rows, chunk_bytes=300)
    written("lz4.bag", rows, compression="lz4")
    assert rosbag(["convert", "-q", "run.bag", "run.mcap"]) == 0

    with open_bags(name) as bags:
        assert checked(bags) == 80


@pytest.mark.parametrize("name", ["messages/two_types.bag", "cli/files/run.bag"])
def test_bags_of_genuine_rosbag_are_read(name: str) -> None:
    with open_bags(file_of_tests(f"golden/{name}")) as bags:
        assert sum(bags.table(topic).rows for topic in bags.topics()) == bags.readers[0].message_count > 0


def test_several_bags_are_one_in_the_order_of_receipt(folder: Path) -> None:
    written("run2.bag", numbers(20, 3))
    written("run1.bag", numbers(10, 3))
    written("other.bag", numbers(11, 10))  # overlaps

    with open_bags("run*.bag") as bags:
        assert bags.table("/n")["data"].tolist() == [10, 11, 12, 20, 21, 22]
    with open_bags("run*.bag", folder / "other.bag") as bags:
        assert bags.table("/n")["data"].tolist() == sorted([10, 11, 12, *range(11, 21), 20, 21, 22])


def test_rows_are_chosen_by_time_and_number(folder: Path) -> None:
    with open_bags(written("run.bag", numbers(10, 9))) as bags:
        assert bags.table("/n", start=12, end=Time(14, 5))["data"].tolist() == [12, 13, 14]
        assert bags.table("/n", every=4)["data"].tolist() == [10, 14, 18]
        assert bags.table("/n", start=100).to_arrow().to_pylist() == []
        assert bags.table("/n", datetimes=True)["_time"].dtype == np.dtype("M8[ns]")
        with pytest.raises(ValueError, match="every must be an integer >= 1, got 0"):
            bags.table("/n", every=0)


def test_topics_are_found_by_pattern(folder: Path) -> None:
    rows = [*numbers(1, 1, "/arm/left"), *numbers(1, 1, "/arm/right"), *numbers(1, 1, "/base")]
    with open_bags(written("run.bag", rows)) as bags:
        assert bags.topics("/arm/*") == ["/arm/left", "/arm/right"]
        assert {topic: each.rows for topic, each in bags.tables("/arm/*").items()} == dict.fromkeys(
            bags.topics("/arm/*"), 1
        )
        with pytest.raises(NoSuchTopic, match=r"\[/leg\]; the topics are /arm/left, /arm/right, /base"):
            bags.table("/leg")


def test_names_that_match_nothing_are_errors(folder: Path) -> None:
    for name in ("run*.bag", "run.bag"):
        with pytest.raises(FileNotFoundError) as error:
            open_bags(name)
        assert error.value.filename == name


def test_topics_with_two_types_are_refused(folder: Path) -> None:
    written("a.bag", numbers(1, 1))
    written("b.bag", [("/n", String("x"), 2, 0)])
    with (
        open_bags("a.bag", "b.bag") as bags,
        pytest.raises(BagError, match=r"the same type, got std_msgs/Int32 .* in a.bag, std_msgs/String"),
    ):
        bags.table("/n")


def test_batches_are_bounded_and_together_the_table(folder: Path, constants: Constants) -> None:
    name = written("run.bag", [("/s", String("x" * 996), n, 0) for n in range(1, 101)])
    with open_bags(name) as bags:
        constants(TABLE_BATCH_BYTES=10_000)
        batches = list(bags.batches("/s"))
        assert [each.rows for each in batches] == [9] * 11 + [1]
        constants(TABLE_BATCH_BYTES=10_000)
        table = bags.table("/s")
        assert table.to_arrow().equals(bags.table("/s").to_arrow())


def test_a_message_larger_than_a_batch_is_a_batch(folder: Path, constants: Constants) -> None:
    texts = ["x" * size for size in (10, 500, 20, 30, 10, 10, 10, 700, 1)]
    with open_bags(written("run.bag", [("/s", String(text), n, 0) for n, text in enumerate(texts)])) as bags:
        constants(TABLE_BATCH_BYTES=100)
        batches = list(bags.batches("/s"))
    assert [each.rows for each in batches] == [1, 1, 2, 3, 1, 1]
    assert [text for each in batches for text in each["data"]] == texts


@pytest.mark.parametrize("every", [1, 3])
@pytest.mark.parametrize("chunk_bytes", [1, 200, 10_000])
def test_rows_equal_those_of_the_reader_in_any_order(
    folder: Path, every: int, chunk_bytes: int, constants: Constants
) -> None:
    rng = seeded(3)
    for _ in range(30):
        rows: list[Row] = [("/n", Int32(n), rng.randrange(5), rng.randrange(2)) for n in range(40)]
        rows += [("/other", String("x" * rng.randrange(90)), rng.randrange(5), 0) for _ in range(10)]
        rng.shuffle(rows)
        if rng.random() < 0.5:
            rows.sort(key=lambda row: row[2:])
        with open_bags(written("run.bag", rows, chunk_bytes=chunk_bytes)) as bags:
            expected = [m.data for _, m, _, _ in bags.readers[0].messages("/n", 1.0, 3.0)]
            constants(TABLE_BATCH_BYTES=200)
            table = bags.table("/n", start=1.0, end=3.0, every=every)
            assert table["data"].tolist() == expected[::every]


@pytest.mark.parametrize("chunk_bytes", [100, 10_000])
def test_two_publishers_are_read_in_the_order_of_the_reader(chunk_bytes: int, folder: Path) -> None:
    with Path("two.bag").open("w+b") as file:
        writer = BagWriter(file, chunk_bytes=chunk_bytes)
        publishers = [writer.add_connection("/n", header_of(Int32(), "/n", callerid=f"/{n}")) for n in (1, 2)]
        for n in range(60):
            writer.write_message(publishers[n % 3 % 2], n // 7, 0, Int32(n))
        writer.finish()
    with open_bags("two.bag") as bags:
        expected = [m.data for _, m, _, _ in bags.readers[0].messages("/n")]
        assert bags.table("/n")["data"].tolist() == expected
        assert expected != list(range(60))


def test_an_index_that_names_a_message_many_times_is_refused(folder: Path) -> None:
    rows: list[Row] = [("/s", String("x" * (3000 if n == 1 else 10)), n, 0) for n in range(1, 51)]
    content = bag_bytes(rows)
    entries = [content.rindex(struct.pack("<II", n, 0)) for n in range(2, 50)]  # the index is last
    first = content[entries[0] - 12 : entries[0]]
    for at in entries:
        content = content[: at + 8] + first[8:] + content[at + 12 :]
    Path("bomb.bag").write_bytes(content)
    with (
        open_bags("bomb.bag") as bags,
        pytest.raises(BagFormatError, match="the messages are larger than their chunk"),
    ):
        bags.table("/s")


def test_memory_is_that_of_a_batch(folder: Path, constants: Constants) -> None:
    name = written(
        "run.bag", [("/s", String("x" * 10_000), n, 0) for n in range(1, 3001)], chunk_bytes=50_000
    )
    with open_bags(name) as bags:
        constants(TABLE_BATCH_BYTES=200_000)
        limited = bags
        tracemalloc.start()
        try:
            limited.to_parquet("/s", "out.parquet")
            peak = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
    assert peak < 10_000_000 < 30_000_000


def test_tables_are_limited(folder: Path, constants: Constants) -> None:
    name = written("run.bag", [("/s", String("x" * 996), n, 0) for n in range(1, 101)])
    constants(TABLE_BATCH_BYTES=10_000)
    with open_bags(name) as bags, pytest.raises(BagError, match=r"table of /s is too large: .*table_bytes"):
        with_limits(bags, table_bytes=50_000).table("/s")


def test_a_malformed_message_is_named(folder: Path) -> None:
    with Path("bad.bag").open("w+b") as file:
        writer = BagWriter(file)
        connection = writer.add_connection("/n", header_of(Int32(), "/n"))
        writer.write(connection, 7, 1, b"\1\0\0\0")
        writer.write(connection, 7, 2, b"\1\0\0")
        writer.finish()
    expected = (
        r"the message on /n received at 7\.000000002: its 3 bytes do not match the definition of "
        r"std_msgs/Int32: 4 bytes must follow at byte 0, got 3"
    )
    with open_bags("bad.bag") as bags, pytest.raises(BagFormatError, match=expected):
        bags.table("/n")


def test_truncated_bags_are_refused(folder: Path) -> None:
    content = bag_bytes(some_rows())
    for size in range(0, len(content), 97):
        Path("cut.bag").write_bytes(content[:size])
        with pytest.raises(BagError):
            open_bags("cut.bag")


def test_tables_become_parquet_arrow_and_pandas(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import pyarrow.parquet

    with open_bags(written("run.bag", random_rows())) as bags:
        table = bags.table("/cloud")
    table.to_parquet("cloud.parquet")
    read = pyarrow.parquet.read_table("cloud.parquet")

    assert read.equals(table.to_arrow())
    assert read["fields"].to_pylist()[3] == [
        {name: cell(each, at) for name, each in table["fields"][3].columns.items()}
        for at in range(len(table["fields"][3]))
    ]
    monkeypatch.setitem(__import__("sys").modules, "pandas", None)
    with pytest.raises(MissingExtra, match="to_pandas needs pandas, which is not installed"):
        table.to_pandas()


def test_many_topics_are_read_in_one_pass(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    topics = [f"/t{number:02d}" for number in range(20)]
    rows = [(topics[n % 20], Int32(n), n // 10, n % 10) for n in range(600)]
    names = [written(name, part, chunk_bytes=500) for name, part in (("a", rows[::2]), ("b", rows[1::2]))]
    parsed: list[int] = []
    read = contents.read_chunk_index

    def counting(*arguments: Any) -> Any:
        parsed.append(arguments[2].position)
        return read(*arguments)

    monkeypatch.setattr(contents, "read_chunk_index", counting)
    with open_bags(*names) as bags:
        for options in ({}, {"start": 7, "end": Time(40, 5), "every": 3, "datetimes": True}):
            parsed.clear()
            tables = bags.tables("/t*", **options)
            assert len(parsed) <= sum(len(bag.chunks) for bag in bags.readers)
            assert list(tables) == topics
            for topic, table in tables.items():
                one = bags.table(topic, **options)
                assert table["data"].tolist() == one["data"].tolist() != []
                assert table["_time"].tolist() == one["_time"].tolist()
                assert table["_time"].dtype == one["_time"].dtype
        with pytest.raises(BagError, match="is too large"):
            with_limits(bags, table_bytes=50).tables()


# As-of joins and transforms as columns.


def opened(folder: Path, rows: list[Row]) -> Bags:
    (folder / "run.bag").write_bytes(bag_bytes(sorted(rows, key=lambda row: row[2:])))
    return open_bags(folder / "run.bag")


def point(topic: str, seconds: int, stamp: int, x: float = 0) -> Row:
    message = PointStamped()
    message.header.stamp = Time(stamp, 0)
    message.point.x = x
    return topic, message, seconds, 0


def brute_force(time: int, others: list[int], tolerance: int | None, direction: str) -> int | None:
    """Return the time that belongs to another one, or None."""
    found = [each for each in others if (direction != "backward" or each <= time)]
    found = [each for each in found if direction != "forward" or each >= time]
    best = min(found, key=lambda each: (abs(each - time), each), default=None)
    return None if best is None or (tolerance is not None and abs(best - time) > tolerance) else best


@pytest.mark.parametrize("direction", ["backward", "forward", "nearest"])
@pytest.mark.parametrize("tolerance", [None, 0, 3])
def test_matches_equal_those_of_a_plain_search(direction: str, tolerance: int | None) -> None:
    rng = seeded(1)
    for _ in range(100):
        times = [rng.randrange(40) for _ in range(20)]
        others = [rng.randrange(40) for _ in range(rng.randrange(12))]
        limit = None if tolerance is None else tolerance / 1e9

        index, is_gap = matches(np.array(times), np.array(others, np.int64), limit, direction)

        got = [None if gap else others[at] for at, gap in zip(index, is_gap, strict=True)]
        assert got == [brute_force(time, others, tolerance, direction) for time in times]


def test_rows_get_the_columns_of_other_topics(tmp_path: Path) -> None:
    rows: list[Row] = [("/a", Int32(n), n, 0) for n in (10, 20, 30)]
    rows += [("/b/c", Int32(-n), n, 500_000_000) for n in (9, 19, 25)]
    with opened(tmp_path, rows) as bags:
        table = bags.asof("/a", "/b/c", tolerance=1)

    assert (table["b/c.data"].tolist(), table["data"].tolist()) == ([-9, -19, None], [10, 20, 30])
    assert table.to_arrow()["b/c._time"].to_pylist() == [9_500_000_000, 19_500_000_000, None]


def test_header_times_are_joined_in_any_order_of_receipt(tmp_path: Path) -> None:
    rows = [point("/a", 10, 3), point("/a", 11, 1), point("/b", 12, 2, x=2.0), point("/b", 13, 1, x=1.0)]
    with opened(tmp_path, [*rows, ("/n", Int32(), 14, 0)]) as bags:
        table = bags.asof("/a", "/b", on="header")
        assert (table["b.point.x"].tolist(), list(table["b.header.frame_id"])) == ([2.0, 1.0], ["", ""])
        with pytest.raises(ValueError, match="/n: std_msgs/Int32 has no header; use on='receipt'"):
            bags.asof("/a", "/n", on="header")
        with pytest.raises(ValueError, match="direction must be one of backward, forward, nearest, got 'x'"):
            bags.asof("/a", "/b", direction="x")
        with pytest.raises(ValueError, match="tolerance must be >= 0, got -1"):
            bags.asof("/a", "/b", tolerance=-1)
        with pytest.raises(ValueError, match="on must be receipt or header, got 'x'"):
            bags.asof("/a", "/b", on="x")
        with pytest.raises(ValueError, match=r"the column b\._time must be new"):
            bags.asof("/a", "/b", "/b")


def test_a_join_with_nothing_in_range_has_only_gaps(tmp_path: Path) -> None:
    rows: list[Row] = [("/a", Int32(1), 10, 0), ("/t", TFMessage([TransformStamped()]), 11, 0)]
    with opened(tmp_path, rows) as bags:
        table = bags.table("/a").asof(bags.table("/t", start=100))
        late = bags.table("/a").asof(bags.table("/t"))
    assert table.to_arrow()["t.transforms"].to_pylist() == [None]
    assert late.to_arrow()["t.transforms"].to_pylist() == [None]


def transform(seconds: float, x: float, child: str = "arm", parent: str = "base") -> TransformStamped:
    found = TransformStamped(child_frame_id=child)
    found.header.frame_id, found.header.stamp = parent, Time.from_sec(seconds)
    found.transform.translation.x = x
    angle = x / 10
    found.transform.rotation.z, found.transform.rotation.w = np.sin(angle / 2), np.cos(angle / 2)
    return found


def tf_rows(stamps: list[float]) -> list[Row]:
    rows: list[Row] = [("/tf_static", TFMessage([transform(0, 0.5, "hand", "arm")]), 90, 0)]
    for stamp in stamps:
        received = Time.from_sec(stamp + 0.25)
        rows.append(("/tf", TFMessage([transform(stamp, stamp - 10)]), received.secs, received.nsecs))
    return rows


def test_poses_are_those_of_a_tf_buffer_and_gaps_are_null(tmp_path: Path) -> None:
    stamps = [10.0, 11.0, 12.5, 14.0, 60.0, 61.0]
    times = [5, 10, 11, 12, 13, 14, 30, 60, 61, 62]
    rows = [*tf_rows(stamps), *(point("/p", 100 + n, time) for n, time in enumerate(times))]
    with opened(tmp_path, rows) as bags:
        table = bags.with_transform(bags.table("/p"), "base", "hand", gap=5)
        with pytest.warns(UserWarning, match="unknown frame 'leg'; known: .*hand"):
            unknown = bags.with_transform(bags.table("/p"), "base", "leg", prefix="leg_")
        received = with_transform(bags.table("/p"), bags.readers, "base", "hand", on="receipt")

    buffer = TransformBuffer(10**12)
    for stamp in stamps:
        each = transform(stamp, stamp - 10).transform
        pose = (each.translation.x, 0.0, 0.0, 0.0, 0.0, each.rotation.z, each.rotation.w)
        buffer.insert("base", "arm", int(stamp * 1e9), pose, "")
    static = transform(0, 0.5).transform
    buffer.insert("arm", "hand", 0, (0.5, 0, 0, 0, 0, static.rotation.z, static.rotation.w), "", True)
    names = [f"hand.{part}" for part in ("x", "y", "z", "qx", "qy", "qz", "qw")]
    got: list[Any] = list(zip(*(table[name].tolist() for name in names), strict=True))
    gaps = [5, 30, 62]
    for time, pose in zip(times, got, strict=True):
        expected = (None,) * 7 if time in gaps else buffer.lookup("base", "hand", time * 10**9)[1]
        assert pose == expected, time
    assert table.to_arrow()["hand.x"].null_count == 3
    assert unknown["leg_x"].tolist() == received["hand.x"].tolist() == [None] * len(times)


def test_a_gap_must_be_positive(tmp_path: Path) -> None:
    with (
        opened(tmp_path, [point("/p", 1, 1)]) as bags,
        pytest.raises(ValueError, match="gap must be > 0, got 0"),
    ):
        bags.with_transform(bags.table("/p"), "a", "b", gap=0)


def test_columns_of_another_length_are_refused(tmp_path: Path) -> None:
    with opened(tmp_path, [point("/p", 1, 1)]) as bags:
        table: Table = bags.table("/p")
    with pytest.raises(ValueError, match="the column y must be new and have 1 rows, got 2 rows"):
        table.with_columns({"y": np.zeros(2)})
    assert table.with_columns({"y": np.ones(1)}).take([0])["y"].tolist() == [1.0]


def test_gaps_of_fixed_arrays_are_nulls(tmp_path: Path) -> None:
    rows: list[Row] = [("/a", Int32(n), n, 0) for n in (10, 20)]
    imu = Imu(orientation_covariance=[float(n) for n in range(9)])
    with opened(tmp_path, [*rows, ("/imu", imu, 15, 0)]) as bags:
        table = bags.asof("/a", "/imu")
    cells = table.to_arrow()["imu.orientation_covariance"].to_pylist()
    assert cells == [None, [float(n) for n in range(9)]]
