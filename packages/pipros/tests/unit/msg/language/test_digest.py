"""md5 and full text. The expected sums were computed by genuine genmsg."""

from __future__ import annotations

import pytest

from pipros.msg.language.digest import (
    SEPARATOR,
    embedded_types,
    full_text,
    md5_text,
    message_md5,
    service_md5,
)
from pipros.msg.language.parse import parse_message, parse_service
from pipros.msg.language.spec import DefinitionError, MessageSpec


class Library:
    """Definitions by name, as a lookup."""

    def __init__(self, **texts: str) -> None:
        self.specs = {f"pkg/{name}": parse_message(text, f"pkg/{name}") for name, text in texts.items()}
        header = parse_message("uint32 seq\ntime stamp\nstring frame_id\n", "std_msgs/Header")
        self.specs["std_msgs/Header"] = header

    def __call__(self, type_name: str) -> MessageSpec:
        return self.specs[type_name]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "d41d8cd98f00b204e9800998ecf8427e"),
        ("Header header", "d7be0bb39af8fb9129d5a76e6b63a290"),
        ("int32 a\nHeader header", "22475ff36eef9d99a29f9f056d5d5bf7"),
        ("Header[] hs", "f2cd187f68e3368967cae34c051dcef7"),
        ("In i\nIn[3] j\nIn[] k", "e17f1a2b123117efa48a8c9473e68924"),
        ("In i\nint32 X=1", "4d4bf1a2223b5d156be8e27909524b45"),
        ('string S= a "q" # no comment  ', "a7821c139d8e748664b103165ddad431"),
        ("float64 PI=3.14159 # pi", "a625147d10260b66baf35018bef4baf3"),
        ("time t\nduration d\nbyte b\nchar c", "f6b7dcf2fda64ccfb0caa151929576f7"),
        ("int32[0] z", "7a1a545cacebec01895e1bcf2bc7dea2"),
    ],
)
def test_md5(text: str, expected: str) -> None:
    library = Library(T=text, In="int32 x\n", Header="int32 own\n")
    assert message_md5(library("pkg/T"), library) == expected


def test_the_md5_covers_constants_first_and_embedded_types_by_their_md5() -> None:
    library = Library(T="In i # comment\n\nint32 X = 1", In="int32 x")
    assert md5_text(library("pkg/T"), library) == "int32 X=1\n19aac5e823802d733295ea3ec20e6350 i"


def test_a_service_is_summed_over_both_halves() -> None:
    library = Library()
    spec = parse_service("int64 a\nint64 b\n---\nint64 sum\n", "pkg/AddTwoInts")
    assert service_md5(spec, library) == "6a2e34150c00229791cc89ff309fff21"


def test_the_full_text_has_every_embedded_definition_once_in_the_order_of_first_use() -> None:
    library = Library(T="A a\nB b\n", A="C c\n", B="C c\nA a\n", C="int32 x\n")
    a, b, c = "C c\n", "C c\nA a\n", "int32 x\n"
    assert full_text(library("pkg/T"), library).split(f"{SEPARATOR}\n") == [
        "A a\nB b\n\n",
        f"MSG: pkg/A\n{a}\n",
        f"MSG: pkg/C\n{c}\n",
        f"MSG: pkg/B\n{b}",
    ]


def test_a_message_within_itself_is_refused_at_the_field_that_closes_the_circle() -> None:
    library = Library(T="int32 x\nA a", A="T[] t")
    with pytest.raises(DefinitionError, match="cannot contain itself: pkg/T -> pkg/A -> pkg/T") as caught:
        embedded_types(library("pkg/T"), library)
    assert (caught.value.file, caught.value.line) == ("<definition of pkg/A>", 1)


def test_an_unknown_type_is_refused_at_the_field_that_uses_it() -> None:
    library = Library(T="int32 x\nNo_such y")
    with pytest.raises(DefinitionError, match=r"unknown type \[pkg/No_such\]") as caught:
        embedded_types(library("pkg/T"), library)
    assert (caught.value.line, caught.value.column) == (2, 1)


def test_nesting_has_a_limit() -> None:
    texts = {f"T{i}": f"T{i + 1} x" for i in range(200)} | {"T200": "int32 x"}
    library = Library(**texts)
    with pytest.raises(DefinitionError, match="nested deeper than 100"):
        embedded_types(library("pkg/T0"), library)
