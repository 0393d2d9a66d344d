from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros_tools.bag.errors import BagFormatError
from pipros_tools.bag.index import ChunkInfo, chunk_info_record, index_record, parse_chunk_info, parse_index
from pipros_tools.bag.records import (
    field_bytes,
    file_header,
    number,
    parse_fields,
    parse_version,
    record_bytes,
)

NAMES = st.text(st.characters(codec="utf-8", exclude_characters="="), max_size=8)


@given(st.dictionaries(NAMES, st.binary(max_size=20)))
def test_header_fields_survive_a_round_trip(fields: dict[str, bytes]) -> None:
    assert parse_fields(field_bytes(fields), "x") == fields


@given(st.binary(max_size=60))
def test_arbitrary_bytes_are_fields_or_an_error_with_its_position(data: bytes) -> None:
    error: Exception | None = None
    try:
        parse_fields(data, "run.bag, byte 7")
    except BagFormatError as raised:
        error = raised
    assert error is None or str(error).startswith("run.bag, byte 7: ")


def test_a_record_is_header_and_data() -> None:
    assert record_bytes({"op": b"\x02"}, b"ab") == b"\x08\0\0\0\x04\0\0\0op=\x02\x02\0\0\0ab"


def test_the_file_header_has_a_fixed_size() -> None:
    assert len(file_header(0, 0, 0)) == len(file_header(1 << 40, 1000, 1000)) == 4104


@pytest.mark.parametrize("line", [b"#ROSBAG V2", b"#ROSBAG 2.0", b"#ROSBAG V-1.0", b"#ROSBAG Vx.y", b""])
def test_other_first_lines_have_no_version(line: bytes) -> None:
    assert parse_version(line) is None


def test_numbers_must_have_their_size() -> None:
    with pytest.raises(BagFormatError, match=r"x: the field \[conn\] must be 4 bytes long, got 2"):
        number({"conn": b"ab"}, "conn", 4, "x")
    with pytest.raises(BagFormatError, match=r"x: the field \[conn\] is missing"):
        number({}, "conn", 4, "x")


def test_chunk_infos_and_indexes_survive_a_round_trip() -> None:
    info = ChunkInfo(1 << 33, 1_000_000_002, 3_000_000_004, {0: 5, 7: 1})
    record = chunk_info_record(info)
    size = int.from_bytes(record[:4], "little")
    fields, data = parse_fields(record[4 : 4 + size], "x"), record[8 + size :]
    assert parse_chunk_info(fields, data, "x") == info
    with pytest.raises(BagFormatError, match="2 connections need 16 bytes, got 15"):
        parse_chunk_info(fields, data[:-1], "x")

    record = index_record(3, bytes(24))
    size = int.from_bytes(record[:4], "little")
    fields = parse_fields(record[4 : 4 + size], "x")
    assert parse_index(fields, bytes(24), "x") == (3, bytes(24))
    with pytest.raises(BagFormatError, match="2 entries need 24 bytes, got 12"):
        parse_index(fields, bytes(12), "x")
