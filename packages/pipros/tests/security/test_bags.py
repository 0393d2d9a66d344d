"""Untrusted bags and MCAP files: their size, their strings, and the names of their topics."""

import io
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml
from sensor_msgs.msg import CompressedImage
from std_msgs.msg import Int32, String

from pipros.basics.limits import Limits
from pipros_tools.bag import BagFormatError, BagReader, BagWriter, NotIndexed
from pipros_tools.bag.chunk_data import check_chunk
from pipros_tools.bag.compression import compress
from pipros_tools.bag.index import ChunkHeader, ChunkInfo, chunk_header_bytes, index_record
from pipros_tools.bag.info import bag_info
from pipros_tools.bag.info_text import info_text, info_yaml
from pipros_tools.bag.layout import BagLayout
from pipros_tools.bag.mcap_files import McapReader
from pipros_tools.bag.mcap_records import McapSummary
from pipros_tools.bag.mcap_repair import recover
from pipros_tools.bag.records import ENTRY, TIME, U32, Op, record_bytes
from pipros_tools.bag.source import Source
from pipros_tools.cli import rostopic
from pipros_tools.cli.rosbag import main
from tests.support.bags import bag_bytes, header_of, some_rows
from tests.support.constants import Constants
from tests.support.mcap import chunk_record, index_of, mcap_bytes, messages_record, with_summary
from tests.support.memory import memory_of

# Untrusted bags that would take far more memory or time than their size suggests are refused.


MIB = 1 << 20


def changed(data: bytes, change: Callable[[BagLayout], None], more: bytes = b"") -> bytes:
    """Return a bag with `more` after its chunks, and the index of the changed layout."""
    file = io.BytesIO(data)
    layout = BagReader(file).layout
    file.seek(layout.end)
    layout.end += file.write(more)
    change(layout)
    BagWriter(file, layout=layout).finish()
    return file.getvalue()


def appended(*parts: bytes, chunks: Sequence[int], counts: Mapping[int, int]) -> bytes:
    """A bag of a message and these parts, with chunks at these offsets in the parts."""

    def change(layout: BagLayout) -> None:
        first = layout.end - sum(map(len, parts))
        layout.chunks += [ChunkInfo(first + at, 10 * 10**9, 20 * 10**9, counts) for at in chunks]

    return changed(bag_bytes([("/a", Int32(1), 10, 0)]), change, b"".join(parts))


def chunk_of(content: bytes, compression: str = "none") -> bytes:
    data = bytes(compress(compression, content))
    return chunk_header_bytes(compression, len(content), len(data)) + data


def message_record(connection: int, data: bytes = b"\x01\0\0\0") -> bytes:
    fields = {"op": bytes([Op.MESSAGE]), "conn": U32.pack(connection), "time": TIME.pack(10, 0)}
    return record_bytes(fields, data)


def test_a_chunk_that_the_index_names_twice_is_refused() -> None:
    def repeat(layout: BagLayout) -> None:
        layout.chunks *= 2000

    data = changed(bag_bytes(some_rows(3000)), repeat)

    with memory_of(10 * MIB), pytest.raises(NotIndexed, match=r"lists the chunk at byte 4117 twice"):
        list(BagReader(io.BytesIO(data)).raw_messages())
    rebuilt = BagReader(io.BytesIO(data), rebuild_index=True)
    assert rebuilt.message_count == 3000


def test_chunks_that_share_an_index_are_refused() -> None:
    """Each chunk's data contain the next chunk; the entries follow the innermost one."""
    start = len(chunk_of(b""))
    starts = [chunk_header_bytes("none", start * left, start * left) for left in reversed(range(500))]
    entries = index_record(0, ENTRY.pack(10, 0, 0) * 1000)
    data = appended(*starts, entries, chunks=[0, start * 499], counts={0: 1000})

    with pytest.raises(BagFormatError, match=r"the chunk must end before the next one, at byte \d+"):
        list(BagReader(io.BytesIO(data)).raw_messages())


def test_an_index_of_more_messages_than_the_file_has_room_for_is_refused() -> None:
    def multiply(layout: BagLayout) -> None:
        layout.chunks[0] = replace(layout.chunks[0], counts={0: 10**9, 1: 15})

    data = changed(bag_bytes(some_rows()), multiply)

    with pytest.raises(NotIndexed, match="1000000015 messages"):
        BagReader(io.BytesIO(data))


def test_repeated_entries_of_one_message_are_refused() -> None:
    content = message_record(0, bytes(10_000))
    entries = index_record(0, ENTRY.pack(10, 0, 0) * 1000)
    data = appended(chunk_of(content), entries, chunks=[0], counts={0: 1000})

    read: list[object] = []
    with pytest.raises(BagFormatError, match="the messages are larger than their chunk"):
        read.extend(BagReader(io.BytesIO(data)).raw_messages())
    assert len(read) == 2


def test_index_records_of_one_connection_are_joined_in_one_pass() -> None:
    count = 20_000
    records = index_record(0, ENTRY.pack(10, 0, 0)) * count
    counts = dict.fromkeys(range(count), 1)
    bag = BagReader(io.BytesIO(appended(chunk_of(message_record(0)), records, chunks=[0], counts=counts)))

    assert bag.chunk_index(1) == {0: ENTRY.pack(10, 0, 0) * count}


def test_a_chunk_beyond_the_decompression_limit_is_refused(constants: Constants) -> None:
    content = message_record(0, bytes(8 * MIB))
    entries = index_record(0, ENTRY.pack(10, 0, 0))
    data = appended(chunk_of(content, "bz2"), entries, chunks=[0], counts={0: 1})
    # blank images are just as small
    assert sum(1 for _ in BagReader(io.BytesIO(data)).raw_messages()) == 2

    constants(BAG_EXPANDED_BYTES=MIB)
    with memory_of(MIB), pytest.raises(BagFormatError, match=r"times as many; the limit is 1048576"):
        list(BagReader(io.BytesIO(data)).raw_messages())
    rebuilt = BagReader(io.BytesIO(data), rebuild_index=True)
    assert rebuilt.message_count == 1
    assert "times as many; the limit is 1048576" in rebuilt.damage[0]


def test_a_bag_that_expands_to_too_many_messages_is_not_indexed(constants: Constants) -> None:
    content = message_record(0) * 20_000
    data = appended(*[chunk_of(content, "bz2")] * 20, chunks=[], counts={})

    constants(BAG_RECORDS=50_000)
    rebuilt = BagReader(io.BytesIO(data), rebuild_index=True)

    assert "too many records; the limit is 50000" in rebuilt.damage[0]
    assert rebuilt.message_count == 60_001


# Untrusted MCAP files that would take far more memory or time than their size suggests are refused.


def read(data: bytes, limits: Limits | None = None) -> list[int]:
    """Return the times of all messages in ns."""
    reader = McapReader(io.BytesIO(data), limits=limits or Limits())
    return [seconds * 10**9 + nanoseconds for _, seconds, nanoseconds, *_ in reader.raw_messages()]


def mcap_appended(*parts: bytes) -> bytes:
    """A file of a message at 0 ns and these chunks, all in the summary."""

    def add(summary: McapSummary) -> None:
        position = summary.chunk_indexes[0].chunk_start_offset + len(chunk)
        for part in parts:
            summary.chunk_indexes.append(index_of(position))
            position += len(part)

    data = mcap_bytes([])
    chunk = chunk_record(messages_record([0]))
    start = int.from_bytes(data[-28:-20], "little")

    def only(summary: McapSummary) -> None:
        summary.chunk_indexes = [index_of(start, start=0, end=0)]
        add(summary)

    return with_summary(data, only, chunk + b"".join(parts))


def test_a_chunk_that_the_summary_names_twice_is_refused() -> None:
    def repeat(summary: McapSummary) -> None:
        summary.chunk_indexes *= 1000

    data = with_summary(mcap_bytes(range(1000)), repeat)

    with memory_of(10 * MIB), pytest.raises(NotIndexed, match=r"lists the chunk at byte \d+ twice"):
        read(data)


def test_chunks_within_each_other_are_refused() -> None:
    inner = chunk_record(messages_record([1] * 100), compression="")
    outer = chunk_record(inner, compression="")
    data = mcap_appended(outer)
    position = data.index(inner)

    def add(summary: McapSummary) -> None:
        summary.chunk_indexes.append(index_of(position))

    with pytest.raises(BagFormatError, match=f"the chunk must end before the next one, at byte {position}"):
        read(with_summary(data, add))


def test_a_message_of_a_compressed_chunk_takes_a_few_bytes() -> None:
    data = mcap_appended(chunk_record(messages_record([1] * 150_000)))
    assert len(data) < 5000

    with memory_of(16 * MIB):
        assert sum(1 for _ in McapReader(io.BytesIO(data)).raw_messages()) == 150_001


def test_an_mcap_chunk_beyond_the_decompression_limit_is_refused(constants: Constants) -> None:
    data = mcap_appended(chunk_record(bytes([5]) + (8 * MIB).to_bytes(8, "little") + bytes(8 * MIB)))
    assert len(read(data)) == 1  # channel 0 does not exist

    constants(BAG_EXPANDED_BYTES=MIB)
    with memory_of(MIB), pytest.raises(BagFormatError, match="times as many; the limit is 1048576"):
        read(data)


def test_a_chunk_in_the_summary_is_not_decompressed() -> None:
    data = mcap_appended()
    start = int.from_bytes(data[-28:-20], "little")
    bomb = chunk_record(bytes(32 * MIB))
    footer = data[-37:]

    with memory_of(4 * MIB):
        assert read(data[:start] + bomb + data[start:-37] + footer) == [0]


def test_without_chunk_indexes_chunks_are_read_one_at_a_time() -> None:
    times = list(range(40_000))
    data = with_summary(mcap_bytes(times, chunk_bytes=100_000), lambda summary: summary.chunk_indexes.clear())

    with memory_of(2 * MIB):
        reader = McapReader(io.BytesIO(data), limits=Limits(bag_cache_bytes=200_000))
        assert [time for _, _, time, *_ in map(tuple, reader.raw_messages())] == times


def test_a_repair_reads_one_message_at_a_time(tmp_path: Path) -> None:
    data = mcap_appended(chunk_record(messages_record([1] * 100_000)))
    file = io.BytesIO()
    path = tmp_path / "x.mcap"
    path.write_bytes(data)
    with memory_of(16 * MIB):
        assert recover(path, file, lambda _: None) == []


@pytest.mark.parametrize("compression", ["lz4", "bz2", "zstd"])
def test_a_chunk_that_expands_200_times_is_refused_before_it_is_expanded(compression: str) -> None:
    size = 300 * MIB
    header = ChunkHeader(compression, data_position=0, data_size=size // 200, size=size)
    with pytest.raises(BagFormatError, match=r"expand to 314572800, over 64 times as many"):
        check_chunk(Source(io.BytesIO(b""), "x.mcap"), header)


# Strings of a bag on terminals: one line each, without escape sequences; exports stay in their folder.


HOSTILE = "\x1b]0;OWNED\x07\nforged: line\u202e"
WRITTEN_OUT = r"\x1b]0;OWNED\x07\nforged: line\u202e"


@pytest.fixture
def bag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A bag with control characters in every string."""
    monkeypatch.chdir(tmp_path)
    file = io.BytesIO()
    writer = BagWriter(file)
    header = header_of(String(), "/a", callerid="/x" + HOSTILE)
    for n in range(3):
        names = {"topic": "/t" + HOSTILE, "type": "evil/T" + HOSTILE, "md5sum": f"{n}" + HOSTILE}
        changed = header | {key: value.encode() for key, value in names.items()}
        connection = writer.add_connection("/t" + HOSTILE if n < 2 else "/ok", changed)
        writer.write_message(connection, 1 + n, 0, String(HOSTILE))
    known = header | {"md5sum": HOSTILE.encode(), "message_definition": b"int32 data"}
    writer.write_message(writer.add_connection("/known", known), 8, 0, Int32(1))
    connection = writer.add_connection("/said", header)
    writer.write_message(connection, 9, 0, String(HOSTILE))
    writer.finish()
    path = tmp_path / "x.bag"
    path.write_bytes(file.getvalue())
    Path("packed.bag").write_bytes(file.getvalue().replace(b"compression=none", b"compression=\x1b[3m"))
    return path


@pytest.mark.parametrize("line", [
    "info x.bag", "info --freq x.bag", "info -y x.bag", "info -y --freq x.bag", "info -y -k topics x.bag",
    "info -y -k types[0].md5 x.bag", "info packed.bag", "info -y packed.bag",
    "info -y -k compression packed.bag", "check x.bag", "check -g rules.bmr x.bag", "fix x.bag fixed.bag",
    "fix --force x.bag fixed.bag", "export x.bag out", "export packed.bag out",
    "filter --print=topic x.bag some.bag True", "filter --print=m.data x.bag some.bag topic=='/said'",
    "compress -f x.bag", "compress -f packed.bag", "reindex -f packed.bag", "convert x.bag x.mcap",
])  # fmt: skip
def test_commands_escape_strings_of_a_bag(line: str, bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main(line.split())

    taken = capsys.readouterr()
    assert_plain(taken.out + taken.err)


@pytest.mark.parametrize("line", ["list -b x.bag", "echo -b x.bag -p /said", "echo -b x.bag -a"])
def test_rostopic_escapes_strings_of_a_bag(line: str, bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rostopic.main(line.split())

    taken = capsys.readouterr()
    assert_plain(taken.out + taken.err)


def assert_plain(text: str) -> None:
    assert "Traceback" not in text
    for line in text.replace("\r", "\n").split("\n"):
        assert line.replace("\t", "").isprintable(), repr(line)
        assert not line.startswith("forged"), text


def test_the_yaml_of_info_is_what_the_bag_has(bag: Path) -> None:
    with BagReader(bag) as reader:
        info = bag_info(reader, "x.bag")
    found = yaml.safe_load(info_yaml(info))

    assert [each["topic"] for each in found["topics"]] == ["/known", "/ok", "/said", "/t" + WRITTEN_OUT]
    assert found["types"][0] == {"type": "evil/T" + WRITTEN_OUT, "md5": "0" + WRITTEN_OUT}
    assert f"/t{WRITTEN_OUT}   2 msgs" in info_text(info)


@pytest.mark.parametrize(
    "topic", ["/../", "/..", "/../../x", "/a/../../b", "..", "/", "", "~/x", "/a\0b", "/a\nb", "C:\\x"]
)
def test_a_topic_that_is_a_path_is_not_exported(topic: str, tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    Path("x.bag").write_bytes(
        bag_bytes([(topic, CompressedImage(data=b"\xff\xd8"), 5, 0), ("/b", Int32(1), 5, 0)])
    )

    assert main(["export", "x.bag", "deep/out"]) == 1
    assert "is not a legal topic name" in capsys.readouterr().err
    assert (sorted(os.listdir()), os.listdir("deep")) == (["deep", "x.bag"], ["out"])
    assert os.listdir("deep/out") == ["b.csv"]


def test_topics_and_images_are_exported_to_own_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    topics = ["/a/b", "/a_b", "/a__b", "/A/b", "/a/b/", "/a__b_2", "a/b"]
    rows: list[Any] = [(topic, Int32(n), 1, 0) for n, topic in enumerate(topics)]
    rows += [("/image", CompressedImage(data=b"\xff\xd8%d\xff\xd9" % n), 5, 0) for n in range(2)]
    Path("x.bag").write_bytes(bag_bytes(rows))

    assert main(["export", "x.bag", "out"]) == 0

    tables = {path.name: path.read_text().split(",")[-1].strip() for path in Path("out").glob("*.csv")}
    assert sorted(tables.values()) == sorted(str(n) for n in range(len(topics)))
    assert (tables["A__b.csv"], len({name.lower() for name in tables})) == ("3", len(topics))
    assert sorted(path.name for path in Path("out/image").iterdir()) == [
        "5.000000000.jpg", "5.000000000_2.jpg",
    ]  # fmt: skip
