"""The language of definition files, compared with genmsg on the same lines."""

from __future__ import annotations

from typing import Any

import pytest

from pipros.msg.language.parse import parse_action, parse_message, parse_service
from pipros.msg.language.spec import Constant, DefinitionError


def fields(text: str) -> list[tuple[str, str]]:
    return [(str(field.type), field.name) for field in parse_message(text, "pkg/T").fields]


def constant(text: str) -> Constant:
    (only,) = parse_message(text, "pkg/T").constants
    return only


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", []),
        ("# only a comment", []),
        ("int32 a", [("int32", "a")]),
        (" int32   a ", [("int32", "a")]),
        ("int32 a#comment", [("int32", "a")]),
        ("int32 a # comment\r\nint32 b\r\n", [("int32", "a"), ("int32", "b")]),
        ("string s # x = y", [("string", "s")]),
        (
            "uint8[] data\nchar[4] tag\nint32[0] none",
            [("uint8[]", "data"), ("char[4]", "tag"), ("int32[0]", "none")],
        ),
        ("Point p\nPoint[3] ps", [("pkg/Point", "p"), ("pkg/Point[3]", "ps")]),
        ("geometry_msgs/Point p", [("geometry_msgs/Point", "p")]),
        ("int32 class\nint32 a_", [("int32", "class"), ("int32", "a_")]),
    ],
)
def test_fields(text: str, expected: list[tuple[str, str]]) -> None:
    assert fields(text) == expected


def test_a_bare_header_is_the_one_of_std_msgs_and_an_array_of_headers_is_not() -> None:
    assert fields("Header h\nHeader[] hs") == [("std_msgs/Header", "h"), ("pkg/Header[]", "hs")]


@pytest.mark.parametrize(
    ("text", "has_header"),
    [
        ("Header header", True),
        ("std_msgs/Header header\nint32 a", True),
        ("Header h", False),
        ("int32 a\nHeader header", False),
        ("pkg/Header header", False),
        ("Header[] header", False),
    ],
)
def test_only_a_leading_header_called_header_is_filled_in(text: str, has_header: bool) -> None:
    assert parse_message(text, "pkg/T").has_header is has_header


@pytest.mark.parametrize(
    ("text", "value", "kept"),
    [
        ("int32 X=1", 1, "1"),
        ("int32 X = -1 # c", -1, "-1"),
        ("int32 X=010", 10, "010"),
        ("int32 X=+5", 5, "+5"),
        ("uint64 X=18446744073709551615", 2**64 - 1, "18446744073709551615"),
        ("byte X=-128", -128, "-128"),
        ("char X=200", 200, "200"),
        ("float32 X=1e3", 1000.0, "1e3"),
        ("float64 X=-.5", -0.5, "-.5"),
        ("bool X=True", True, "True"),
        ("bool X=0", False, "0"),
        ("bool X=2", True, "2"),
        ('string X= a "q" # no comment  ', 'a "q" # no comment', 'a "q" # no comment'),
        ("string X=", "", ""),
        ("string X==", "=", "="),
        ("string X='x'", "'x'", "'x'"),
    ],
)
def test_constants(text: str, value: Any, kept: str) -> None:
    found = constant(text)
    assert (found.name, found.value, found.text) == ("X", value, kept)
    assert type(found.value) is type(value)


@pytest.mark.parametrize(
    ("text", "line", "column", "reason"),
    [
        ("int32", 1, 1, "expected a type and a name, got [int32]"),
        ("int32 a\n  int32 a b", 2, 3, "expected a type and a name"),
        ("\tint32\ta", 1, 2, "separate them by spaces, not tabs"),
        (
            "int32 1a",
            1,
            7,
            "a field name must start with a letter and contain only letters, digits and _, got [1a]",
        ),
        ("int32 _a", 1, 7, "digits and _, got [_a]"),
        ("int32 a-b", 1, 7, "digits and _, got [a-b]"),
        ("/Foo x", 1, 1, "a type must be name or package/Name, with [] or [number] for an array, got [/Foo]"),
        ("foo/bar/Baz x", 1, 1, "got [foo/bar/Baz]"),
        ("int32[-1] x", 1, 1, "for an array, got [int32[-1]]"),
        ("int32[2][3] x", 1, 1, "got [int32[2][3]]"),
        ("int32[99999999999] x", 1, 1, "array length must be <="),
        ("int32 a\nfloat64 a", 2, 1, "already a field named a"),
        ("time T=1", 1, 1, "a constant cannot have the type [time]"),
        ("int32[] X=3", 1, 1, "a constant cannot have the type [int32[]]"),
        ("uint8 U=256", 1, 1, "must be between 0 and 255"),
        ("int8 U=-129", 1, 1, "must be between -128 and 127"),
        ("int32 X=0x10", 1, 1, "[0x10] is not a valid int32 constant"),
        ("bool B=yes", 1, 1, "[yes] is not a valid bool constant"),
        ("int32 X=1=2", 1, 1, "expected int32 NAME=value"),
        (
            "int32 a b=3",
            1,
            1,
            "a constant's name must start with a letter, or with _ and a letter, and contain only letters, "
            "digits and _, got [a b]",
        ),
    ],
)
def test_a_mistake_is_named_with_its_place(text: str, line: int, column: int, reason: str) -> None:
    with pytest.raises(DefinitionError) as caught:
        parse_message(text, "pkg/T", "some/T.msg")

    assert (caught.value.file, caught.value.line, caught.value.column) == ("some/T.msg", line, column)
    assert reason in str(caught.value)
    assert str(caught.value).startswith(f"some/T.msg:{line}:{column}: ")


def test_a_name_of_both_a_field_and_a_constant_is_refused() -> None:
    with pytest.raises(DefinitionError, match="a is both a field and a constant"):
        parse_message("int32 a\nint32 a=2", "pkg/T")


def test_a_service_has_two_halves_that_may_be_empty() -> None:
    spec = parse_service("int32 a\n---\n", "pkg/Ask")

    assert (spec.request.type, spec.response.type) == ("pkg/AskRequest", "pkg/AskResponse")
    assert [field.name for field in spec.request.fields] == ["a"]
    assert spec.response.fields == ()


@pytest.mark.parametrize(
    ("text", "request_text", "response_text"),
    [
        ("int32 a", "int32 a\n", ""),
        ("int32 a\n---\n---\n", "int32 a\n", "\n"),
        ("---\nint32 a\n---\nint32 b", "", "int32 a\nint32 b\n"),
    ],
)
def test_wrong_numbers_of_service_separators_are_handled_like_genmsg(
    text: str, request_text: str, response_text: str
) -> None:
    spec = parse_service(text, "pkg/Ask")

    assert (spec.request.text, spec.response.text) == (request_text, response_text)


def test_a_length_stays_as_it_was_written() -> None:
    (field,) = parse_message("int32[03] a", "pkg/T").fields

    assert (str(field.type), field.type.length) == ("int32[03]", 3)


def test_a_length_of_thousands_of_digits_is_refused() -> None:
    with pytest.raises(DefinitionError, match="a type must be"):
        parse_message(f"int32[{'9' * 5000}] a", "pkg/T")


def test_mistakes_in_the_second_half_count_lines_from_the_top_of_the_file() -> None:
    with pytest.raises(DefinitionError) as caught:
        parse_service("int32 a\n---\nint32", "pkg/Ask", "Ask.srv")
    assert caught.value.line == 3

    with pytest.raises(DefinitionError) as caught:
        parse_action("int32 a\n---\n---\nint32", "pkg/Do", "Do.action")
    assert caught.value.line == 4


def test_an_action_defines_seven_messages() -> None:
    spec = parse_action("int32 order\n---\n---\nfloat32 done\n", "pkg/Count")

    assert [message.name for message in spec.messages] == [
        *("CountGoal", "CountResult", "CountFeedback"),
        *("CountActionGoal", "CountActionResult", "CountActionFeedback", "CountAction"),
    ]
    goal = spec.messages[3]
    assert [(str(field.type), field.name) for field in goal.fields] == [
        ("std_msgs/Header", "header"),
        ("actionlib_msgs/GoalID", "goal_id"),
        ("pkg/CountGoal", "goal"),
    ]
