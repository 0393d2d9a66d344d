"""rosbag: a bag whose file header has another size than rosbag's was destroyed by reindex and appending.

The format leaves the padding of the file header to the writer. rosbags (PyPI) pads header and data to
4,096 bytes, rosbag the two without their lengths.
"""

from __future__ import annotations

import io
import struct
from pathlib import Path

import pytest
from std_msgs.msg import Int32

import rosbag
import rospy
from pipros_tools.bag import BagReader
from pipros_tools.cli.rosbag import main
from tests.support.bags import bag_bytes, rows_of, some_rows, values

ROWS = some_rows(12)
OTHER_PADDING = [4011, 0, 9000]


def bag_with_padding(padding: int, *, is_indexed: bool = True) -> bytes:
    """Return a bag whose file header has `padding` bytes of data."""
    usual = bag_bytes(ROWS, chunk_bytes=150)
    start = 17 + int.from_bytes(usual[13:17], "little")
    size = int.from_bytes(usual[start : start + 4], "little")
    layout = BagReader(io.BytesIO(usual)).layout
    moved = padding - size
    bag = bytearray(usual[:start] + struct.pack("<I", padding) + b" " * padding + usual[start + 4 + size :])
    index = layout.index_position + moved
    at = bag.index(b"index_pos=") + 10
    bag[at : at + 8] = struct.pack("<Q", index if is_indexed else 0)
    at = index
    while (at := bag.find(b"chunk_pos=", at) + 10) > 9:
        (position,) = struct.unpack_from("<Q", bag, at)
        struct.pack_into("<Q", bag, at, position + moved)
    return bytes(bag if is_indexed else bag[:index])


@pytest.mark.parametrize("padding", OTHER_PADDING)
@pytest.mark.parametrize("is_indexed", [True, False])
def test_reindex_keeps_all_messages(tmp_path: Path, padding: int, is_indexed: bool) -> None:
    path = tmp_path / "run.bag"
    path.write_bytes(bag_with_padding(padding, is_indexed=is_indexed))
    assert main(["reindex", "-q", str(path)]) == 0
    with BagReader(path) as bag:
        assert rows_of(bag) == values(ROWS)


@pytest.mark.parametrize("padding", OTHER_PADDING)
def test_appending_keeps_all_messages(tmp_path: Path, padding: int) -> None:
    path = tmp_path / "run.bag"
    path.write_bytes(bag_with_padding(padding))
    with rosbag.Bag(str(path), "a") as bag:
        bag.write("/new", Int32(7), rospy.Time(99))
    with BagReader(path) as bag:
        assert rows_of(bag) == [*values(ROWS), ("/new", 7, 99, 0)]


def test_a_file_header_with_a_damaged_length_does_not_hide_the_chunks(tmp_path: Path) -> None:
    path = tmp_path / "run.bag"
    damaged = bytearray(bag_bytes(ROWS))
    start = 17 + int.from_bytes(damaged[13:17], "little")
    damaged[start : start + 4] = b"\xff\xff\xff\x7f"
    path.write_bytes(damaged)
    assert main(["reindex", "-q", str(path)]) == 0
    with BagReader(path) as bag:
        assert rows_of(bag) == values(ROWS)
