"""`rosbag merge`, `rosbag split`, and `rosbag filter` by topic and time."""

from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import Int32, String

from pipros_tools.bag import BagWriter, open_bag
from pipros_tools.cli.rosbag import main
from tests.support.bags import bag_bytes, header_of, rows_of, some_rows, values


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def contents(path: str | Path) -> list[tuple[str, Any, int, int]]:
    with open_bag(path) as bag:
        return rows_of(bag)


def parts(suffix: str = ".bag") -> list[list[tuple[str, Any, int, int]]]:
    count = len(list(Path().glob(f"run_*{suffix}")))
    return [contents(f"run_{number}{suffix}") for number in range(count)]


@pytest.mark.parametrize("target", ["all.bag", "all.mcap"])
def test_bags_are_merged_in_time_order(target: str) -> None:
    rows = some_rows(30)
    Path("a.bag").write_bytes(bag_bytes(rows[::3]))
    Path("b.bag").write_bytes(bag_bytes([*rows[1::3], *rows[2::3]]))
    assert main(["convert", "b.bag", "b.mcap"]) == 0

    assert main(["merge", "a.bag", "b.mcap", "-o", target]) == 0

    assert contents(target) == values(rows)
    with open_bag(target) as bag:
        assert len(bag.connections) == 2


def test_connections_stay_apart_unless_their_headers_are_equal() -> None:
    for name, caller in (("a", "/one"), ("b", "/two"), ("c", "/one")):
        with open(f"{name}.bag", "w+b") as file:
            writer = BagWriter(file)
            connection = writer.add_connection("/x", header_of(Int32(), "/x", callerid=caller, latching="1"))
            writer.write_message(connection, 5, 0, Int32(ord(name)))
            writer.finish()

    assert main(["merge", "-q", "a.bag", "b.bag", "c.bag", "-o", "all.bag"]) == 0

    with open_bag("all.bag") as bag:
        assert [(each.callerid, each.is_latching) for each in bag.connections] == [
            ("/one", True),
            ("/two", True),
        ]
        assert [(each.message.data, each.connection.callerid) for each in bag] == [
            (97, "/one"), (99, "/one"), (98, "/two")
        ]  # fmt: skip


def test_outputs_that_exist_are_kept(capsys: pytest.CaptureFixture[str]) -> None:
    Path("run.bag").write_bytes(bag_bytes(some_rows(30)))
    for name in ("old.bag", "run_7.bag"):
        Path(name).write_bytes(b"old")

    assert main(["merge", "run.bag", "-o", "old.bag"]) == 1
    assert main(["merge", "-f", "run.bag", "-o", "run.bag"]) == 1
    assert main(["split", "run.bag", "--every", "1s"]) == 1

    told = capsys.readouterr().err.splitlines()
    assert told[0].endswith("old.bag already exists; --force overwrites it")
    assert told[1].endswith("run.bag is an input")
    assert told[2].endswith("run_7.bag already exists; --force overwrites it")
    assert Path("old.bag").read_bytes() == Path("run_7.bag").read_bytes() == b"old"
    assert main(["merge", "-f", "run.bag", "-o", "old.bag"]) == 0
    assert contents("old.bag") == values(some_rows(30))


@pytest.mark.parametrize("suffix", [".bag", ".mcap"])
def test_a_bag_is_split_after_each_duration(suffix: str, capsys: pytest.CaptureFixture[str]) -> None:
    rows = [*some_rows(30), ("/late", String("x"), 100, 0)]  # from 10 s to 12 s, and at 100 s
    Path("run.bag").write_bytes(bag_bytes(rows))
    if suffix == ".mcap":
        assert main(["convert", "run.bag", "run.mcap"]) == 0

    assert main(["split", f"run{suffix}", "--every", "1s"]) == 0

    assert parts(suffix) == [values(rows[:10]), values(rows[10:20]), values(rows[20:30]), values(rows[30:])]
    assert capsys.readouterr().out == f"4 bags: run_0{suffix} to _3{suffix}\n"


def test_a_bag_is_split_at_times() -> None:
    rows = some_rows(30)
    Path("run.bag").write_bytes(bag_bytes(rows))

    assert main(["split", "-q", "run.bag", "--at", "12", "--at", "+1s", "--output-dir", "new"]) == 0

    assert [contents(f"new/run_{n}.bag") for n in range(3)] == [
        values(rows[:10]), values(rows[10:20]), values(rows[20:])
    ]  # fmt: skip
    assert main(["merge", *(f"new/run_{n}.bag" for n in range(3)), "-o", "again.bag"]) == 0
    assert contents("again.bag") == values(rows)
    assert main(["split", "-q", "run.bag", "--at", "10.000001", "--output-dir", "exact"]) == 0
    assert contents("exact/run_0.bag") == values(rows[:1])


def test_a_bag_is_split_by_size() -> None:
    rows: list[Any] = [("/a", String(str(n) * 5000), n, 0) for n in range(10)]
    Path("run.bag").write_bytes(bag_bytes(rows))

    assert main(["split", "run.bag", "--size", "20k"]) == 0

    found = parts()
    assert [row for part in found for row in part] == values(rows)
    assert [len(part) for part in found] == [4, 4, 2]
    assert main(["split", "-f", "run.bag", "--size", "1", "--output-dir", "one"]) == 0  # MB, as rosbag record
    assert len(contents("one/run_0.bag")) == 10
    assert main(["split", "run.bag", "--size", "0", "--output-dir", "none"]) == 1


def test_each_part_begins_with_the_latched_messages_of_each_publisher() -> None:
    with open("run.bag", "w+b") as file:
        writer = BagWriter(file)
        for number, caller in enumerate(("/one", "/two", "/two", "/new")):
            latching = "1" if number < 3 else "0"
            header = header_of(Int32(), "/x", callerid=caller, latching=latching)
            writer.write_message(writer.add_connection("/x", header), 10, number, Int32(number))
        writer.write_message(writer.add_connection("/y", header_of(Int32(), "/y")), 11, 0, Int32(9))
        writer.finish()

    assert main(["split", "run.bag", "--every", "1s", "--repeat-latched"]) == 0

    assert [[row[:2] for row in part] for part in parts()] == [
        [("/x", 0), ("/x", 1), ("/x", 2), ("/x", 3)],
        [("/x", 0), ("/x", 2), ("/y", 9)],
    ]


@pytest.mark.parametrize(("options", "reason"), [
    (["--every", "0"], "Duration specification invalid: 0"),
    (["--size", "big"], "--size must be like 500M, got big"),
    (["--at", "noon"], "--at must be like 1700000000.5 or +90s, got noon"),
    ([], "You must specify one of --every, --size and --at."),
    (["--every", "1s", "--size", "1M"], "You must specify one of --every, --size and --at."),
])  # fmt: skip
def test_invalid_options_are_explained(options: list[str], reason: str, capsys) -> None:
    Path("run.bag").write_bytes(bag_bytes(some_rows(4)))
    try:
        code: Any = main(["split", "run.bag", *options])
    except SystemExit as ended:
        code = ended.code
    assert code in (1, 2)
    assert reason in capsys.readouterr().err
    assert [each.name for each in Path().iterdir()] == ["run.bag"]


def damaged_chunks(count: int) -> int:
    """Write a bag whose first chunks cannot be read. Return the number of messages in the others."""
    data = bytearray(
        bag_bytes([("/n", Int32(n), n, 0) for n in range(90)], compression="bz2", chunk_bytes=300)
    )
    Path("run.bag").write_bytes(data)
    with open_bag("run.bag") as bag:
        for number in range(count):
            at = bag.chunk_header(number).data_position
            data[at : at + 20] = bytes(20)
        left = sum(sum(chunk.counts.values()) for chunk in bag.chunks[count:])
    Path("run.bag").write_bytes(data)
    return left


@pytest.mark.parametrize("how", ["t.secs >= {}", "topic == '/n' and not t.to_sec() < {}"])
def test_a_filter_by_time_reads_only_chunks_with_matching_messages(how: str) -> None:
    left = damaged_chunks(5)
    assert 0 < left < 90

    assert main(["filter", "run.bag", "out.bag", how.format(90 - left)]) == 0

    assert [row[1] for row in contents("out.bag")] == list(range(90 - left, 90))


@pytest.mark.parametrize("source", ["run.bag", "run.mcap"])
def test_a_filter_by_topic_and_time_gives_the_same_in_each_format(source: str) -> None:
    rows = some_rows(30)
    Path("run.bag").write_bytes(bag_bytes(rows, chunk_bytes=200))
    assert main(["convert", "run.bag", "run.mcap"]) == 0

    assert main(["filter", source, "topic.bag", "topic == '/a'"]) == 0
    assert main(["filter", source, "time.bag", "topic == '/a' and t.secs == 11"]) == 0

    assert contents("topic.bag") == [row for row in values(rows) if row[0] == "/a"]
    assert contents("time.bag") == [row for row in values(rows) if row[0] == "/a" and row[2] == 11]
