"""Arrays of strings: short, long, repeated and truncated ones."""

from __future__ import annotations

import struct
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros.msg.compile.string_arrays import KEPT_LIMIT, KEPT_LIMIT_BYTES, RepeatedStrings, read_strings

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
