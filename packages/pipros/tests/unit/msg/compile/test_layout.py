"""The properties of a type that the compiler determines before it generates code."""

from typing import Any

import pytest

from pipros.msg.compile.layout import INLINE_ARRAY_LIMIT, TypeLayout, TypeLayouts
from pipros.msg.language.parse import parse_message

TYPES = {
    "p/Empty": "", "p/Point": "float64 x\nfloat64 y\nfloat64 z", "p/Flag": "bool set",
    "p/Image": "uint32 width\nuint8[] data", "p/Named": "string name\nPoint at",
    "p/Nested": "Empty[3] nothing",
}  # fmt: skip


def layout_of(definition: str) -> TypeLayout:
    specs = {name: parse_message(text, name) for name, text in TYPES.items()}
    return TypeLayouts(specs.__getitem__).of(parse_message(definition, "p/Outer"))


@pytest.mark.parametrize(("definition", "attribute", "value"), [
    ("uint8[] data", "has_octets", True), ("char[] data", "has_octets", True),
    ("Image[] images", "has_octets", True), ("uint8[8] data", "has_octets", False),
    ("int8[] data", "has_octets", False), ("", "takes_bytes", False),
    ("Empty nothing\nNested nothing_else", "takes_bytes", False),
    ("Point[0] points\nstring[0] names", "takes_bytes", False), ("Empty[] list", "takes_bytes", True),
    ("Flag flag", "takes_bytes", True), ("Point a\ntime t\nuint8[500] data", "is_one_unpack", True),
    (f"float32[{INLINE_ARRAY_LIMIT}] a", "is_one_unpack", True),
    (f"float32[{INLINE_ARRAY_LIMIT + 1}] a", "is_one_unpack", False),
    ("Point[2] points", "is_one_unpack", False), ("string s", "is_one_unpack", False),
    ("Named n", "is_one_unpack", False), ("", "is_one_unpack", False),
    ("Empty nothing\nint8 x", "is_one_unpack", False), ("float64 a\nfloat64 b", "only_code", "d"),
    ("int8 a\nbyte b", "only_code", "b"), ("bool a\nbool b", "only_code", None),
    ("float64 a\nfloat32 b", "only_code", None), ("float64[2] a", "only_code", None),
    ("Flag a", "only_code", None), ("", "only_code", None),
])  # fmt: skip
def test_a_type_has_the_properties_that_decide_on_its_code(
    definition: str, attribute: str, value: Any
) -> None:
    assert getattr(layout_of(definition), attribute) == value


@pytest.mark.parametrize(("definition", "size"), [
    ("", 0), ("int8 A=1\nint8 a", 2), ("Point p", 5), ("Point p\nPoint q", 10), ("Named[9] n", 8),
    ("float32[7] a", 8), ("uint8[7] a\nfloat32[] b\nstring[7] c\nfloat32[65] d", 4),
])  # fmt: skip
def test_all_fields_in_the_generated_code_are_counted(definition: str, size: int) -> None:
    assert layout_of(definition).code_size == size


@pytest.mark.parametrize(("definition", "values", "least_bytes"), [
    ("", 0, 0), ("int8 a\nstring s\ntime t", 6, 13), ("uint8[80] data", 11, 80),
    ("string[3] names\nint32[] numbers", 5, 16), ("Point[2] points", 15, 48), ("Nested n", 6, 0),
])  # fmt: skip
def test_values_and_bytes_of_a_new_message_are_counted(
    definition: str, values: int, least_bytes: int
) -> None:
    layout = layout_of(definition)
    assert (layout.value_count, layout.least_bytes) == (values, least_bytes)


def test_values_that_no_byte_explains_are_counted() -> None:
    assert layout_of("Point p").unpaid_values == 0
    assert layout_of("Empty[100] nothing").unpaid_values == 101
    assert layout_of("Empty[100] nothing\nint8 x").unpaid_values == 95
    assert layout_of("").unpaid_values_of_element == 1
