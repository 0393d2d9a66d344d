"""Definitions of peers that would exhaust memory or time are refused early."""

from __future__ import annotations

import tracemalloc
from typing import Any

import pytest

from pipros.basics.limits import Limits
from pipros.msg.compile.arrays import EMPTY_ELEMENTS
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.errors import DeserializationError
from pipros.msg.language.digest import DEPTH_LIMIT, SEPARATOR
from pipros.msg.language.spec import DefinitionError
from tests.support.constants import changed


def text_of(first: str, **others: str) -> str:
    """A full text: the definition of a/T, and those of other types by name."""
    return first + "".join(f"\n{SEPARATOR}\nMSG: a/{name}\n{text}" for name, text in others.items())


def made(text: str) -> Any:
    return message_classes_from_text("a/T", text)["a/T"]


def refusal(text: str, limits: Limits | None = None) -> str:
    with pytest.raises(DefinitionError) as raised:
        message_classes_from_text("a/T", text, limits)
    return str(raised.value)


class TestReading:
    """A few bytes create only a few objects."""

    FIXED_IN_ELEMENTS = text_of("E[] es", E="C[50000] cs", C="")
    ONE_BYTE_FOR_MANY = text_of("E[] es", E="uint8 x\nC[50000] cs", C="")
    ZERO_LENGTHS = text_of("E[] es", E="\n".join(f"int32[0] x{i}" for i in range(1000)))
    WRAPPED = text_of("E0[] es", **{f"E{i}": f"E{i + 1} e" for i in range(50)}, E50="bool b")

    @pytest.mark.parametrize(
        ("text", "data"),
        [
            (FIXED_IN_ELEMENTS, (80).to_bytes(4, "little")),
            (ONE_BYTE_FOR_MANY, (80).to_bytes(4, "little") + bytes(80)),
            (ZERO_LENGTHS, (60_000).to_bytes(4, "little")),
            (WRAPPED, (60_000).to_bytes(4, "little") + bytes(60_000)),
        ],
        ids=["fixed arrays in elements", "a byte for many", "arrays of length zero", "wrapped"],
    )
    def test_elements_are_counted_with_the_values_that_they_hold(self, text: str, data: bytes) -> None:
        cls = made(text)

        assert_refused_without_memory(cls, data)

    def test_arrays_of_empty_messages_are_counted_together(self) -> None:
        """Twenty arrays of 60,000, each of which would be allowed alone."""
        cls = made(text_of("E[] es", E="C[] cs", C=""))

        assert_refused_without_memory(cls, (20).to_bytes(4, "little") + (60_000).to_bytes(4, "little") * 20)

    def test_numpy_and_replaced_characters_change_nothing(self) -> None:
        cls = made(text_of("string s\nE[] es", E="C[50000] cs", C=""))
        data = b"\1\0\0\0\xff" + (80).to_bytes(4, "little")

        with pytest.raises(DeserializationError, match="more values than its size allows"):
            cls().deserialize_numpy(data, None)
        with pytest.raises(DeserializationError, match="more values than its size allows"):
            cls().deserialize(data)

    def test_elements_with_bytes_in_the_message_are_not_counted(self) -> None:
        cls = made(text_of("E[] es", E="bool b\nC c", C=""))

        assert len(cls().deserialize((200_000).to_bytes(4, "little") + bytes(200_000)).es) == 200_000

    def test_as_many_empty_messages_as_the_limit_says_are_read(self) -> None:
        cls = made(text_of("E[] es\nE[] more", E=""))
        half = EMPTY_ELEMENTS // 2

        read = cls().deserialize(half.to_bytes(4, "little") * 2)

        assert len(read.es) + len(read.more) == EMPTY_ELEMENTS
        with pytest.raises(DeserializationError, match="has 1 more values"):
            cls().deserialize(half.to_bytes(4, "little") + (half + 1).to_bytes(4, "little"))


def assert_refused_without_memory(cls: Any, data: bytes) -> None:
    tracemalloc.start()
    try:
        with pytest.raises(DeserializationError, match="more values than its size allows"):
            cls._from_bytes(data)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 20_000_000


class TestCompiling:
    @pytest.mark.parametrize(
        "text",
        [text_of("C[100000] cs", C=""), text_of("D[65000] d", D="E[60] e", E="")],
        ids=["many", "many of many"],
    )
    def test_a_message_that_holds_too_much_without_bytes_is_refused_before_one_is_made(
        self, text: str
    ) -> None:
        """A class of the second type would create 3.9 million objects for each empty message."""
        tracemalloc.start()
        try:
            assert "exceed the budget of eight values per byte" in refusal(text)
            peak = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
        assert peak < 20_000_000

    def test_the_fields_of_the_message_itself_are_counted(self) -> None:
        """As many as fit into a connection header; compiling all of them once took 16 seconds."""
        words = refusal("\n".join(f"string f{i}" for i in range(60_000)))

        assert (
            "the types in the text have 60000 fields in total; the limit is 3000 (definition_fields" in words
        )

    def test_the_fields_of_all_types_are_counted_together(self) -> None:
        large = "\n".join(f"string f{i}" for i in range(1000))
        others = {f"U{i}": "\n".join(f"Large l{j}" for j in range(15)) for i in range(100)}

        words = refusal(text_of("int32 x", Large=large, **others))

        assert "fields in total; the limit is 3000 (" in words

    def test_constants_are_counted(self) -> None:
        words = refusal("\n".join(f"int8 C{i}=1" for i in range(20_001)))

        assert "fields in total; the limit is 3000 (" in words

    def test_a_text_is_not_multiplied_by_the_types_that_embed_it(self) -> None:
        comment = "# " + "x" * 100_000
        others = {f"U{i}": "Large l" for i in range(900)}

        words = refusal(text_of("int32 x", Large=f"int32 x\n{comment}", **others))

        assert "each with its embedded types, exceed 67108864 bytes in total" in words

    def test_nesting_is_counted_through_types_that_were_met_before(self) -> None:
        chains = {f"A{i}": f"A{i + 1} x" for i in range(90)} | {"A90": "int8 x"}
        chains |= {f"B{i}": f"B{i + 1} x" for i in range(90)} | {"B90": "A0 a"}

        words = refusal(text_of("A0 a\nB0 b", **chains))

        assert f"nested deeper than {DEPTH_LIMIT}" in words

    def test_the_limits_apply(self) -> None:
        with changed(DEFINITION_BYTES=3):
            assert "longer than 3 characters" in refusal("int32 x", Limits())
        with changed(DEFINITION_TYPES=1):
            assert "more than 1 types" in refusal(text_of("int32 x", U=""), Limits())
        assert "fields in total; the limit is 1 (" in refusal("int32 x\nint32 y", Limits(definition_fields=1))
        with changed(MESSAGE_VALUES=8):
            assert "too many values; the limit is 8" in refusal("int32[9] x", Limits())
