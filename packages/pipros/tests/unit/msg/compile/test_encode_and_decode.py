"""The bodies of `serialize` and `deserialize`: fields that share a call of `struct`, and errors."""

import array
import io
import struct
from collections.abc import Sequence
from typing import Any

import numpy
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros.msg.compile.arrays import CHUNK, numbers, numpy_numbers, octets
from pipros.msg.compile.string_arrays import KEPT_LIMIT, KEPT_LIMIT_BYTES, RepeatedStrings, read_strings
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.errors import SerializationError

SEPARATOR = "=" * 80


def made(text: str) -> Any:
    return message_classes_from_text("a/T", text)["a/T"]


def test_lengths_that_make_up_for_each_other_are_refused() -> None:
    buffer = io.BytesIO()
    with pytest.raises(SerializationError):
        made("int8[2] a\nint8[2] b")(a=[1], b=[1, 2, 3]).serialize(buffer)
    assert buffer.getvalue() == b""


# Arrays of numbers: used without a copy if their memory has the wire format, else converted.


PACKED = struct.pack("<3i", 1, -2, 3)


@pytest.mark.parametrize("kind", [list, tuple, numpy.array])
def test_long_arrays_are_written_as_a_whole(kind: Any) -> None:
    value = [number % 100 for number in range(2 * CHUNK + 1)]
    assert bytes(numbers("h", kind(value))) == struct.pack(f"<{len(value)}h", *value)
    assert bytes(octets(kind(value) if kind is not numpy.array else kind(value, "u1"))) == bytes(value)


@pytest.mark.parametrize("write", [lambda value: numbers("B", value), octets])
def test_a_value_that_does_not_fit_into_a_long_array_is_refused(write: Any) -> None:
    with pytest.raises((struct.error, ValueError)):
        write([0] * (2 * CHUNK) + [256])


@pytest.mark.parametrize(
    ("code", "value"),
    [("i", numpy.array([1.5])), ("b", numpy.array([300], "i2")), ("I", numpy.array([-1], "i4"))],
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


# Arrays of strings: short, long, repeated and truncated ones.


JOINTS = [f"joint_{number}" for number in range(50)]


def written(strings: Sequence[str | bytes]) -> bytes:
    parts = [string.encode() if isinstance(string, str) else string for string in strings]
    return b"".join(struct.pack("<I", len(part)) + part for part in parts)


@given(st.lists(st.text(max_size=100)), st.integers(0, 5), st.booleans())
def test_written_strings_are_read_back_with_the_offset_of_their_end(
    strings: list[str], before: int, is_view: bool
) -> None:
    octets = written(strings)
    data = bytes(before) + octets + b"more"

    found = read_strings(memoryview(data) if is_view else data, before, len(strings), "strict")

    assert found == (strings, before + len(octets))


@given(st.lists(st.text(max_size=80), min_size=1), st.data())
def test_cut_data_is_a_struct_error_whatever_length_it_claims(
    strings: list[str], data: st.DataObject
) -> None:
    octets = written(strings)
    cut = octets[: data.draw(st.integers(0, len(octets) - 1))]

    with pytest.raises(struct.error):
        read_strings(cut, 0, len(strings), "replace")
    with pytest.raises(struct.error):
        read_strings(octets, 0, 0xFFFFFFFF, "replace")


def test_invalid_utf_8_is_refused_or_replaced() -> None:
    octets = written(["a", b"\xff", "b"])

    with pytest.raises(UnicodeDecodeError):
        read_strings(octets, 0, 3, "strict")
    assert read_strings(octets, 0, 3, "replace") == (["a", "�", "b"], len(octets))


def test_a_repeated_array_is_equal_but_not_shared_between_messages() -> None:
    reader = RepeatedStrings("strict")
    octets = written(JOINTS)
    first, _ = reader.read(octets, 0, 50)
    first[0] = "mine"

    second, end = reader.read(memoryview(b"\0" + octets), 1, 50)

    assert (second, end) == (JOINTS, 1 + len(octets))
    assert second[1] is first[1]  # it was not decoded again


def test_arrays_with_the_same_beginning_are_distinguished() -> None:
    reader = RepeatedStrings("strict")
    others = [*JOINTS[:-1], "wrist_49"]

    for strings in (JOINTS, others, JOINTS, JOINTS[:-1], JOINTS):
        octets = written(strings)
        assert reader.read(octets + written(["tail"]), 0, len(strings)) == (strings, len(octets))


def test_a_known_array_that_is_cut_short_is_a_struct_error() -> None:
    reader = RepeatedStrings("strict")
    octets = written(JOINTS)
    reader.read(octets, 0, 50)

    with pytest.raises(struct.error):
        reader.read(octets[:-1], 0, 50)


def test_only_a_few_arrays_of_moderate_size_are_kept() -> None:
    reader = RepeatedStrings("strict")
    for number in range(10 * KEPT_LIMIT):
        reader.read(written([f"{number:06}", *JOINTS]), 0, 51)
    reader.read(written(["x" * KEPT_LIMIT_BYTES] * 2), 0, 2)

    assert 0 < len(reader._kept) <= KEPT_LIMIT
    assert all(len(octets) <= KEPT_LIMIT_BYTES for _, octets, _ in reader._kept.values())
