from __future__ import annotations

import pytest

from pipros_libraries.pictures.errors import PictureError
from pipros_libraries.pictures.pgm import read_pgm, write_pgm


def test_a_written_pgm_is_read() -> None:
    assert read_pgm(write_pgm(2, 3, b"abcdef", "a comment é"), "f") == (2, 3, b"abcdef")


@pytest.mark.parametrize(
    ("content", "pixels"),
    [
        (b"P5\n# by 1 2\n2 # two\n1\n#\n255\n\x00\xff", b"\x00\xff"),
        (b"P5 2 1 15 \x00\x0f", b"\x00\xff"),
        (b"P5 2 1 15 \x05\xff", b"\x55\xff"),
        (b"P5 2 1 65535 \x00\x00\xff\xff", b"\x00\xff"),
        (b"P5 2 1 256\n\x00\x80\x01\x00", b"\x7f\xff"),
        (b"P2 2 1 10 # ten\n0 # none 7\n 10", b"\x00\xff"),
        (b"P2\n2 1\n255\n7 300 9\n", b"\x07\xff"),
    ],
)
def test_each_kind_of_file_is_read(content: bytes, pixels: bytes) -> None:
    assert read_pgm(content, "f") == (2, 1, pixels)


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (b"P6 1 1 255 abc", "must start with P5 or P2, got b'P6'"),
        (b"P5 2", "height must be an integer"),
        (b"P5 2 -1 255 ab", "height must be an integer"),
        (b"P5 0 1 255 ", "pixels, got 0 x 1"),
        (b"P5 99999999 99999999 255 a", "pixels, got 99999999 x 99999999"),
        (b"P5 1 1 0 a", "maximum grey value must be 1 to 65535, got 0"),
        (b"P5 1 1 70000 a", "maximum grey value must be 1 to 65535, got 70000"),
        (b"P5 2 2 255 abc", "must have 4 bytes of pixel data, got 3"),
        (b"P5 2 2 999 abc", "must have 8 bytes of pixel data, got 3"),
        (b"P2 2 1 255 1", "must contain 2 integers"),
        (b"P2 2 1 255 1 a", "must contain 2 integers"),
        (b"P2 2 1 255 1 -1", "must contain 2 integers"),
    ],
)
def test_a_broken_file_is_refused(content: bytes, complaint: str) -> None:
    with pytest.raises(PictureError, match=complaint):
        read_pgm(content, "f")
