from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from std_msgs.msg import String

from pipros.bag import BagError
from pipros.bag.opening import open_bag
from pipros.bag.record_files import FileOptions, RecordFiles
from pipros.bag.record_queue import Received
from pipros.cli.rosbag import main
from tests.support.bags import bag_bytes, rows_of, some_rows, values

ROWS = some_rows()


@pytest.fixture
def bag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "run.bag"
    path.write_bytes(bag_bytes(ROWS, chunk_bytes=300))
    return path


def contents(path: str, **options: Any) -> list[Any]:
    with open_bag(path) as reader:
        return rows_of(reader, **options)


@pytest.mark.parametrize("compression", ["", "none", "lz4", "zstd"])
def test_a_bag_becomes_mcap_and_a_bag_again(compression: str, bag: Path) -> None:
    assert main(["convert", "--compression", compression, "run.bag", "run.mcap"]) == 0
    assert main(["convert", "run.mcap", "again.bag"]) == 0

    assert contents("run.mcap") == contents("again.bag") == values(ROWS)
    with open_bag("run.bag") as before, open_bag("again.bag") as after:
        assert [each.header for each in after.connections] == [each.header for each in before.connections]
    assert contents("run.mcap", topics="/a", start=11.0, end=11.000002) == [
        row for row in values(ROWS) if row[0] == "/a" and (11, 0) <= row[2:] <= (11, 2000)
    ]


def test_the_file_is_what_the_mcap_library_expects(bag: Path) -> None:
    main(["convert", "run.bag", "run.mcap"])

    with open("run.mcap", "rb") as file:
        reader = make_reader(file)
        assert reader.get_header().profile == "ros1"
        found = [(schema, channel, message) for schema, channel, message in reader.iter_messages()]
    schema, channel, message = found[1]
    assert len(found) == len(ROWS)
    assert schema is not None
    assert (schema.name, schema.encoding, schema.data.decode()) == (
        "std_msgs/String",
        "ros1msg",
        String._full_text,
    )
    assert (channel.topic, channel.message_encoding, channel.metadata["md5sum"]) == (
        "/b",
        "ros1",
        String._md5sum,
    )
    assert (message.log_time, message.data) == (10_000_001_000, b"\x06\0\0\0text 1")


def test_many_are_converted_at_once_and_none_is_overwritten(
    bag: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("out").mkdir()
    Path("two.bag").write_bytes(bag.read_bytes())

    assert main(["convert", "--output-dir=out", "run.bag", "two.bag"]) == 0
    assert sorted(os.listdir("out")) == ["run.mcap", "two.mcap"]
    assert main(["convert", "--output-dir=out", "run.bag", "two.bag"]) == 1
    assert "exists already; --force overwrites it" in capsys.readouterr().err
    assert main(["convert", "-f", "run.bag", "out/two.mcap"]) == 0


def test_info_and_filter_take_mcap(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main(["convert", "run.bag", "run.mcap"])

    assert main(["info", "--freq", "run.mcap"]) == 0
    told = capsys.readouterr().out
    assert "version:      mcap\n" in told
    assert "messages:     30\n" in told
    assert "zstd [1/1 chunks; " in told
    assert "15 msgs @ 500.0 kHz : std_msgs/Int32" in told
    assert main(["filter", "run.mcap", "some.mcap", "topic == '/a'"]) == 0
    assert main(["filter", "run.mcap", "some.bag", "topic == '/a'"]) == 0
    assert contents("some.mcap") == contents("some.bag") == [row for row in values(ROWS) if row[0] == "/a"]


def test_a_recording_can_be_mcap(bag: Path) -> None:
    recording = RecordFiles(FileOptions(name="new.mcap"), lambda _: None)
    recording.open((5, 0))
    header = {"type": "std_msgs/String", "md5sum": String._md5sum, "message_definition": String._full_text}
    recording.write(Received("/a", header, b"\x02\0\0\0hi", 5, 6))
    recording.close()

    assert contents("new.mcap") == [("/a", "hi", 5, 6)]


def test_a_damaged_file_is_an_error(bag: Path) -> None:
    main(["convert", "run.bag", "run.mcap"])
    whole = Path("run.mcap").read_bytes()
    for size in range(8, len(whole), 13):
        Path("cut.mcap").write_bytes(whole[:size])
        with pytest.raises(BagError):
            contents("cut.mcap")


def test_without_the_library_it_says_what_to_install(
    bag: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "mcap.reader", None)

    assert main(["convert", "run.bag", "run.mcap"]) == 1
    assert "pip install 'pipros[mcap]'" in capsys.readouterr().err
    assert os.listdir() == ["run.bag"]
