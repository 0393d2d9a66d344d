"""Arrays of numbers: used without a copy if their memory has the wire format, else converted."""

from __future__ import annotations

import array
import struct
from typing import Any

import numpy
import pytest

from pipros.msg.compile.arrays import CHUNK, numbers, numpy_numbers, octets

PACKED = struct.pack("<3i", 1, -2, 3)


@pytest.mark.parametrize(
    "value",
    [
        [1, -2, 3],
        (1, -2, 3),
        array.array("i", [1, -2, 3]),
        numpy.array([1, -2, 3], "<i4"),
        numpy.array([1, -2, 3], ">i4"),
        numpy.array([1, -2, 3], "i2"),
        numpy.array([1, 0, -2, 0, 3, 0], "<i4")[::2],
        memoryview(array.array("i", [1, -2, 3])),
    ],
)
def test_numbers_are_little_endian_for_every_container(value: Any) -> None:
    assert bytes(numbers("i", value)) == PACKED


@pytest.mark.parametrize("kind", [list, tuple, numpy.array])
def test_long_arrays_are_written_as_a_whole(kind: Any) -> None:
    value = [number % 100 for number in range(2 * CHUNK + 1)]
    assert bytes(numbers("h", kind(value))) == struct.pack(f"<{len(value)}h", *value)
    assert bytes(octets(kind(value) if kind is not numpy.array else kind(value, "u1"))) == bytes(value)


@pytest.mark.parametrize("write", [lambda value: numbers("B", value), octets])
def test_a_value_that_does_not_fit_into_a_long_array_is_refused(write: Any) -> None:
    with pytest.raises((struct.error, ValueError)):
        write([0] * (2 * CHUNK) + [256])


def test_memory_in_the_wire_format_is_not_copied() -> None:
    value = numpy.array([1, -2, 3], "<i4")
    packed = numbers("i", value)
    value[0] = 7

    assert struct.unpack("<3i", packed) == (7, -2, 3)


@pytest.mark.parametrize(
    ("code", "value"),
    [
        ("i", numpy.array([1.5])),
        ("b", numpy.array([300], "i2")),
        ("I", numpy.array([-1], "i4")),
    ],
)
def test_an_array_whose_values_could_be_lost_is_converted_one_by_one_or_refused(
    code: str, value: Any
) -> None:
    with pytest.raises((struct.error, TypeError, ValueError, OverflowError)):
        numbers(code, value)


def test_a_wider_integer_array_with_small_values_is_written() -> None:
    assert bytes(numbers("b", numpy.array([1, -2], "i8"))) == b"\x01\xfe"


def test_floats_may_lose_precision_as_in_genpy() -> None:
    assert bytes(numbers("f", numpy.array([0.1, 1.0]))) == struct.pack("<2f", 0.1, 1.0)


@pytest.mark.parametrize("empty", [[], (), array.array("i"), numpy.zeros(0, "i4")])
def test_empty_arrays_have_no_bytes(empty: Any) -> None:
    assert bytes(numbers("i", empty)) == b""


@pytest.mark.parametrize(
    "value", [b"\x00\xff", bytearray(b"\x00\xff"), [0, 255], (0, 255), numpy.array([0, 255], "u1")]
)
def test_octets_come_from_bytes_numbers_and_memory(value: Any) -> None:
    assert bytes(octets(value)) == b"\x00\xff"


@pytest.mark.parametrize("value", ["ab", 5, [256], [-1], [1.0], None])
def test_invalid_octets_are_refused(value: Any) -> None:
    with pytest.raises((TypeError, ValueError)):
        octets(value)


def test_a_numpy_array_shares_the_memory_of_the_message() -> None:
    data = bytearray(b"\x00" + PACKED)
    found = numpy_numbers(numpy, "i", data, 1, 3)
    data[1] = 9

    assert found.tolist() == [9, -2, 3]
    with pytest.raises(struct.error, match="array elements, but is too short"):
        numpy_numbers(numpy, "i", data, 1, 4)
