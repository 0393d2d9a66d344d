"""Files of point clouds; tests.interop.test_clouds_as_genuine exchanges them with PCL."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from pipros.msg import load_message_class
from pipros_robot.perception.clouds.pcd import MODES, InvalidPcd, formatted, parse
from pipros_robot.perception.clouds.points import cloud_of, column, rows_of

TEXT = b"""# .PCD v0.7
VERSION 0.7
FIELDS x y _ n
SIZE 4 4 1 2
TYPE F F U I
COUNT 1 1 2 1
WIDTH 2
HEIGHT 1
VIEWPOINT 1 2 3 1 0 0 0
POINTS 2
DATA ascii
0.5 nan 0 0 -7
1 2e3 0 0 300
"""


def example(count: int = 50) -> Any:
    columns = {
        "x": np.linspace(0, 1, count, dtype=np.float32),
        "t": np.arange(count) / 3,
        "ring": np.arange(count, dtype=np.uint16),
        "label": np.arange(count, dtype=np.int8),
    }
    header: Any = load_message_class("std_msgs/Header")()
    return cloud_of(header, columns, 20)


def test_text_with_padding_is_read() -> None:
    cloud, viewpoint = parse(TEXT)
    rows = rows_of(cloud)
    assert [(each.name, each.offset, each.datatype) for each in cloud.fields] == [
        ("x", 0, 7), ("y", 4, 7), ("n", 10, 3),
    ]  # fmt: skip
    assert column(cloud, rows, "x").tolist() == [0.5, 1.0]
    assert column(cloud, rows, "n").tolist() == [-7, 300]
    assert (cloud.is_dense, viewpoint) == (False, (1, 2, 3, 0, 0, 0, 1))


@pytest.mark.parametrize("mode", MODES)
def test_what_is_written_is_read_again(mode: str) -> None:
    given = example()
    cloud, viewpoint = parse(formatted(given, mode, (1, 2, 3, 0.5, 0.5, 0.5, 0.5)))
    assert viewpoint == (1, 2, 3, 0.5, 0.5, 0.5, 0.5)
    for name in ("x", "t", "ring", "label"):
        mine, read = column(given, rows_of(given), name), column(cloud, rows_of(cloud), name)
        assert mine.dtype == read.dtype
        assert np.allclose(mine, read, rtol=1e-7 if mode == "ascii" else 0, atol=0)
    empty, _ = parse(formatted(example(0), mode))
    assert empty.width == 0


def test_compressed_data_with_repetitions_is_read() -> None:
    """Literals `abc`, then 9 bytes from 3 back, then 14 bytes with a long length."""
    header = TEXT.replace(b"ascii", b"binary_compressed").partition(b"DATA")[0]
    header = header.replace(b"WIDTH 2", b"WIDTH 1").replace(b"COUNT 1 1 2 1", b"COUNT 1 1 16 1")
    packed = bytes([2, *b"abc", 7 << 5, 0, 2, 7 << 5, 5, 2])
    data = header + b"DATA binary_compressed\n" + len(packed).to_bytes(4, "little")
    cloud, _ = parse(data + (26).to_bytes(4, "little") + packed)
    assert rows_of(cloud).tobytes()[8:24] == (b"abc" * 9)[8:24]


@pytest.mark.parametrize(("old", "new", "text"), [
    (b"DATA ascii", b"DATA jpeg", "DATA must be one of ascii, binary, binary_compressed, got jpeg"),
    (b"DATA", b"DAYA", "must end with a DATA line"), (b"SIZE 4 4 1 2", b"SIZE 4 4 1", "header is malformed"),
    (b"SIZE 4 4 1 2", b"SIZE 4 3 1 2", "header is malformed"),
    (b"SIZE 4 4 1 2", b"SIZE 2 4 1 2", "must describe numbers"),
    (b"WIDTH 2", b"WIDTH 999999999", "WIDTH x HEIGHT must be 0 to"),
    (b"WIDTH 2", b"WIDTH 3", "with 3 points must have 15 values, got 10"),
    (b"300", b"70000", "value of field n is invalid"), (b"2e3", b"much", "value of field y is invalid"),
    (b"DATA ascii", b"DATA binary", "with 2 points must have"),
    (b"DATA ascii", b"DATA binary_compressed", "compressed data must be complete"),
])  # fmt: skip
def test_mistakes_are_named(old: bytes, new: bytes, text: str) -> None:
    with pytest.raises(InvalidPcd, match=text):
        parse(TEXT.replace(old, new).replace(b"0.5 nan 0 0 -7\n1 2e3 0 0 300\n", b"") if b"binary" in new
              else TEXT.replace(old, new))  # fmt: skip


def test_damaged_files_are_read_or_refused() -> None:
    numbers = np.random.default_rng(1)
    files = [TEXT, *(formatted(example(), mode) for mode in MODES)]
    for _ in range(1500):
        data = bytearray(files[numbers.integers(len(files))])
        for _ in range(numbers.integers(1, 6)):
            data[numbers.integers(len(data))] = numbers.integers(256)
        if numbers.random() < 0.3:
            del data[numbers.integers(len(data)) :]
        try:
            cloud, _ = parse(bytes(data))
        except InvalidPcd:
            continue
        assert len(cloud.data) == cloud.width * cloud.height * cloud.point_step
