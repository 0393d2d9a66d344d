"""A compressed byte costs bounded work: every reader refuses a chunk of more records than files have."""

# needs the plugins: data, ros2

import bz2
import io
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from mcap.data_stream import RecordBuilder
from mcap.records import Channel, Schema
from mcap.writer import CompressionType, Writer
from std_msgs.msg import Empty

from pipros_data import open_bags
from pipros_rosbag2.bags.reader import open_any_bag
from pipros_tools.bag import BagError, BagFormatError, BagReader
from pipros_tools.bag.compression import compress, decompress
from pipros_tools.bag.index import chunk_header_bytes
from pipros_tools.bag.records import MAGIC, TIME, U32, Op, file_header, record_bytes
from pipros_tools.cli.rosbag import main
from tests.support.bags import bag_bytes
from tests.support.constants import Constants
from tests.support.mcap import chunk_record, index_of, messages_record, with_summary

COUNT = 8_000
KINDS = ("messages", "channels", "schemas", "unknown")
PROFILES = {"ros1": ("std_msgs/Int32", "ros1msg", "ros1"), "ros2": ("std_msgs/msg/Int32", "ros2msg", "cdr")}
TOO_MANY = "chunks have too many records; the limit is 1000, and one more for each byte of the file"


def read_with(bag: Any, read: Callable[[Any], Any]) -> Any:
    with bag:
        return read(bag)


READERS: dict[str, Callable[[Path], Any]] = {
    "fields": lambda path: read_with(open_any_bag(path), lambda bag: list(bag.stored_fields())),
    "messages": lambda path: read_with(open_any_bag(path), lambda bag: list(bag.messages())),
    "times": lambda path: read_with(open_any_bag(path), lambda bag: bag.times_ns()),
    "batches": lambda path: read_with(open_bags(path), lambda bags: list(bags.batches("/a"))),
    "tables": lambda path: read_with(open_bags(path), lambda bags: bags.tables()),
    "filter": lambda path: main(["filter", str(path), "out.mcap", "True"]),
    "convert": lambda path: main(["convert", "-f", str(path), "out.bag"]),
    "merge": lambda path: main(["merge", "-f", "-o", "out.bag", str(path)]),
    "table": lambda path: main(["table", str(path), "/a", "-o", "out.csv"]),
    "reindex": lambda path: main(["reindex", "--output-dir", "new", str(path)]),
}


def written(profile: str, kind: str) -> Path:
    """Write a file whose second chunk has COUNT records of this kind, of which zstd makes a few bytes."""
    file = io.BytesIO()
    writer: Any = Writer(file, compression=CompressionType.NONE)
    name, encoding, messages = PROFILES[profile]
    writer.start(profile=profile, library="x")
    writer.register_channel("/a", messages, writer.register_schema(name, encoding, b"int32 data"))
    writer.add_message(1, 1, bytes(4 if profile == "ros1" else 8), 1)
    writer.finish()
    builder: Any = RecordBuilder()
    Schema(id=1, name=name, encoding=encoding, data=b"int32 data").write(builder)
    schema = bytes(builder.end())
    Channel(id=1, topic="/a", message_encoding=messages, metadata={}, schema_id=1).write(builder)
    records = messages_record([1]), bytes(builder.end()), schema, b"\x80" + bytes(8)
    chunk = chunk_record(dict(zip(KINDS, records, strict=True))[kind] * COUNT)
    data = bytearray(file.getvalue())
    place = int.from_bytes(data[-28:-20], "little")
    data[place - 13] = 0x80  # the end of data, which the chunk follows
    path = Path(f"{profile}.mcap")
    path.write_bytes(
        with_summary(bytes(data), lambda each: each.chunk_indexes.append(index_of(place)), chunk)
    )
    return path


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, constants: Constants) -> None:
    monkeypatch.chdir(tmp_path)
    constants(BAG_RECORDS=1000)


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("profile", PROFILES)
def test_every_reader_refuses_more_records_than_files_have(profile: str, reader: str, capsys) -> None:
    for kind in KINDS:
        path = written(profile, kind)
        try:
            READERS[reader](path)
            text = capsys.readouterr().err
        except BagError as error:
            text = str(error)
        advice = "" if reader == "reindex" else ". Try rosbag reindex, which leaves out the chunk"
        assert re.search(rf"{path}, byte \d+: the file's {TOO_MANY}{advice}", text), (kind, text)


@pytest.mark.parametrize("compression", ["bz2", "lz4"])
def test_the_scan_of_a_bag_leaves_out_a_chunk_of_more_records_than_files_have(compression: str) -> None:
    fields = {"op": bytes([Op.MESSAGE]), "conn": U32.pack(0), "time": TIME.pack(10, 0)}
    content = record_bytes(fields, b"") * COUNT
    data = bytes(compress(compression, content))
    bag = MAGIC + file_header(0, 0, 0) + chunk_header_bytes(compression, len(content), len(data)) + data
    found = BagReader(io.BytesIO(bag), rebuild_index=True)
    assert found.message_count == 0
    assert TOO_MANY in found.damage[0]


@pytest.mark.parametrize("compression", ["bz2", "lz4"])
def test_the_densest_real_messages_stay_below_the_limit(compression: str, constants: Constants) -> None:
    constants(BAG_RECORDS=0)
    rows = [("/a", Empty(), 100 + number // 1000, number % 1000 * 10**6) for number in range(COUNT)]
    Path("run.bag").write_bytes(bag_bytes(rows, compression=compression))
    with BagReader("run.bag", rebuild_index=True) as bag:
        assert (bag.message_count, bag.damage) == (COUNT, [])
    assert main(["convert", "--compression", compression, "run.bag", "run.mcap"]) == 0
    assert read_with(open_any_bag("run.mcap"), lambda bag: len(list(bag.stored_fields()))) == COUNT


def test_bz2_streams_cost_no_more_than_their_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    fed, real = [], bz2.BZ2Decompressor

    class Counting:
        def __init__(self) -> None:
            self.real = real()
            self.eof, self.unused_data = False, b""

        def decompress(self, data: bytes, limit: int) -> bytes:
            fed.append(len(data))
            part = self.real.decompress(data, limit)
            self.eof, self.unused_data = self.real.eof, self.real.unused_data
            return part

    monkeypatch.setattr(bz2, "BZ2Decompressor", Counting)
    assert decompress("bz2", bz2.compress(b"x") * 5000, 5000, "x") == b"x" * 5000
    assert (len(fed), max(fed)) == (5000, 8192)
    with pytest.raises(
        BagFormatError, match="x: the bz2 data are damaged: a stream before the last is empty"
    ):
        decompress("bz2", bz2.compress(b"") * 3000, 1000, "x")


def test_a_sparse_metadata_yaml_is_named_and_not_copied(capsys: pytest.CaptureFixture[str]) -> None:
    Path("run.bag").write_bytes(bag_bytes([("/a", Empty(), 1, 0)]))
    assert main(["convert", "--ros2", "humble", "run.bag", "run"]) == 0
    with Path("run/metadata.yaml").open("ab") as file:
        file.truncate(3 << 30)
    assert main(["reindex", "--output-dir", "new", "run"]) == 0
    assert "WARNING: run/metadata.yaml is left out: it is larger than" in capsys.readouterr().err
    assert [each.name for each in Path("new/run").iterdir()] == ["run_0.db3"]
    assert read_with(open_any_bag("new/run"), lambda bag: bag.message_count) == 1
