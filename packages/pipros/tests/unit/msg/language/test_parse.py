"""The language of definition files, compared with genmsg on the same lines."""

from typing import Any

import pytest

from pipros.basics.errors import NotFound
from pipros.msg.language.comments import comments_of
from pipros.msg.language.digest import (
    SEPARATOR,
    embedded_types,
    full_text,
    md5_text,
    message_md5,
    service_md5,
)
from pipros.msg.language.parse import parse_action, parse_message, parse_service
from pipros.msg.language.spec import Constant, DefinitionError, MessageSpec
from tests.support.definitions import Packages


def fields(text: str) -> list[tuple[str, str]]:
    return [(str(field.type), field.name) for field in parse_message(text, "pkg/T").fields]


def constant(text: str) -> Constant:
    (only,) = parse_message(text, "pkg/T").constants
    return only


@pytest.mark.parametrize(("text", "expected"), [
    ("", []), ("# only a comment", []), ("int32 a", [("int32", "a")]), (" int32   a ", [("int32", "a")]),
    ("int32 a#comment", [("int32", "a")]),
    ("int32 a # comment\r\nint32 b\r\n", [("int32", "a"), ("int32", "b")]),
    ("string s # x = y", [("string", "s")]),
    ("uint8[] data\nchar[4] tag\nint32[0] none",
        [("uint8[]", "data"), ("char[4]", "tag"), ("int32[0]", "none")]),
    ("Point p\nPoint[3] ps", [("pkg/Point", "p"), ("pkg/Point[3]", "ps")]),
    ("geometry_msgs/Point p", [("geometry_msgs/Point", "p")]),
    ("int32 class\nint32 a_", [("int32", "class"), ("int32", "a_")]),
])  # fmt: skip
def test_fields(text: str, expected: list[tuple[str, str]]) -> None:
    assert fields(text) == expected


def test_a_bare_header_is_the_one_of_std_msgs_and_an_array_of_headers_is_not() -> None:
    assert fields("Header h\nHeader[] hs") == [("std_msgs/Header", "h"), ("pkg/Header[]", "hs")]


@pytest.mark.parametrize(("text", "has_header"), [
    ("Header header", True), ("std_msgs/Header header\nint32 a", True), ("Header h", False),
    ("int32 a\nHeader header", False), ("pkg/Header header", False), ("Header[] header", False),
])  # fmt: skip
def test_only_a_leading_header_called_header_is_filled_in(text: str, has_header: bool) -> None:
    assert parse_message(text, "pkg/T").has_header is has_header


@pytest.mark.parametrize(("text", "value", "kept"), [
    ("int32 X=1", 1, "1"), ("int32 X = -1 # c", -1, "-1"), ("int32 X=010", 10, "010"),
    ("int32 X=+5", 5, "+5"), ("uint64 X=18446744073709551615", 2**64 - 1, "18446744073709551615"),
    ("byte X=-128", -128, "-128"), ("char X=200", 200, "200"), ("float32 X=1e3", 1000.0, "1e3"),
    ("float64 X=-.5", -0.5, "-.5"), ("bool X=True", True, "True"), ("bool X=0", False, "0"),
    ("bool X=2", True, "2"), ('string X= a "q" # no comment  ', 'a "q" # no comment', 'a "q" # no comment'),
    ("string X=", "", ""), ("string X==", "=", "="), ("string X='x'", "'x'", "'x'"),
])  # fmt: skip
def test_constants(text: str, value: Any, kept: str) -> None:
    found = constant(text)
    assert (found.name, found.value, found.text) == ("X", value, kept)
    assert type(found.value) is type(value)


@pytest.mark.parametrize(("text", "line", "column", "reason"), [
    ("int32", 1, 1, "expected a type and a name, got [int32]"),
    ("int32 a\n  int32 a b", 2, 3, "expected a type and a name"),
    ("\tint32\ta", 1, 2, "separate them by spaces, not tabs"),
    ("int32 1a", 1, 7,
        "a field name must start with a letter and contain only letters, digits and _, got [1a]"),
    ("int32 _a", 1, 7, "digits and _, got [_a]"), ("int32 a-b", 1, 7, "digits and _, got [a-b]"),
    ("/Foo x", 1, 1, "a type must be name or package/Name, with [] or [number] for an array, got [/Foo]"),
    ("foo/bar/Baz x", 1, 1, "got [foo/bar/Baz]"), ("int32[-1] x", 1, 1, "for an array, got [int32[-1]]"),
    ("int32[2][3] x", 1, 1, "got [int32[2][3]]"), ("int32[99999999999] x", 1, 1, "array length must be <="),
    ("int32 a\nfloat64 a", 2, 1, "already a field named a"),
    ("time T=1", 1, 1, "a constant cannot have the type [time]"),
    ("int32[] X=3", 1, 1, "a constant cannot have the type [int32[]]"),
    ("uint8 U=256", 1, 1, "must be between 0 and 255"), ("int8 U=-129", 1, 1, "must be between -128 and 127"),
    ("int32 X=0x10", 1, 1, "[0x10] is not a valid int32 constant"),
    ("bool B=yes", 1, 1, "[yes] is not a valid bool constant"),
    ("int32 X=1=2", 1, 1, "expected int32 NAME=value"),
    ("int32 a b=3", 1, 1,
        "a constant's name must start with a letter, or with _ and a letter, and contain only letters, "
        "digits and _, got [a b]"),
])  # fmt: skip
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


@pytest.mark.parametrize(("text", "request_text", "response_text"), [
    ("int32 a", "int32 a\n", ""), ("int32 a\n---\n---\n", "int32 a\n", "\n"),
    ("---\nint32 a\n---\nint32 b", "", "int32 a\nint32 b\n"),
])  # fmt: skip
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
        ("std_msgs/Header", "header"), ("actionlib_msgs/GoalID", "goal_id"), ("pkg/CountGoal", "goal"),
    ]  # fmt: skip


class Library:
    """Definitions by name, as a lookup."""

    def __init__(self, **texts: str) -> None:
        self.specs = {f"pkg/{name}": parse_message(text, f"pkg/{name}") for name, text in texts.items()}
        header = parse_message("uint32 seq\ntime stamp\nstring frame_id\n", "std_msgs/Header")
        self.specs["std_msgs/Header"] = header

    def __call__(self, type_name: str) -> MessageSpec:
        return self.specs[type_name]


@pytest.mark.parametrize(("text", "expected"), [
    ("", "d41d8cd98f00b204e9800998ecf8427e"), ("Header header", "d7be0bb39af8fb9129d5a76e6b63a290"),
    ("int32 a\nHeader header", "22475ff36eef9d99a29f9f056d5d5bf7"),
    ("Header[] hs", "f2cd187f68e3368967cae34c051dcef7"),
    ("In i\nIn[3] j\nIn[] k", "e17f1a2b123117efa48a8c9473e68924"),
    ("In i\nint32 X=1", "4d4bf1a2223b5d156be8e27909524b45"),
    ('string S= a "q" # no comment  ', "a7821c139d8e748664b103165ddad431"),
    ("float64 PI=3.14159 # pi", "a625147d10260b66baf35018bef4baf3"),
    ("time t\nduration d\nbyte b\nchar c", "f6b7dcf2fda64ccfb0caa151929576f7"),
    ("int32[0] z", "7a1a545cacebec01895e1bcf2bc7dea2"),
])  # fmt: skip
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
        "A a\nB b\n\n", f"MSG: pkg/A\n{a}\n", f"MSG: pkg/C\n{c}\n", f"MSG: pkg/B\n{b}",
    ]  # fmt: skip


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


# The elements of a definition to which its comments belong.


def test_a_comment_belongs_to_the_declaration_on_its_line_and_directly_below() -> None:
    text = "# Head.\n\nint32 A=1 # one\n# above,\n#  indented\nint32 b  ## behind\n\n# lost\n\nint32 c\n"

    found = comments_of(text)

    assert (found.head, found.of) == ("Head.", {"A": "one", "b": "above,\n indented\nbehind"})


@pytest.mark.parametrize(("text", "head", "first"), [
    ("# Head.\nint32 x\n", "Head.", None), ("# Head.\nint32 x  # first\n", "Head.", "first"),
    ("# Head.\n# More.\n\n# Last.\n\nint32 x\n", "Head.\nMore.\n\nLast.", None),
    ("# Head.\n\n# first\nint32 x\n", "Head.", "first"), ("#####\n# Head.\n#####\nint32 x\n", "Head.", None),
    ("\n\nint32 x\n", "", None), ("# Nothing else.", "Nothing else.", None), ("", "", None),
])  # fmt: skip
def test_a_comment_at_the_top_belongs_to_the_whole_definition(
    text: str, head: str, first: str | None
) -> None:
    found = comments_of(text)
    assert (found.head, found.of.get("x")) == (head, first)


def test_the_value_of_a_string_constant_is_not_a_comment() -> None:
    assert comments_of("# Head.\n\n# name\nstring A=a # b\n").of == {"A": "name"}


def test_the_note_in_messages_of_an_action_is_not_a_comment() -> None:
    action = parse_action("# Head.\n\nint32 x  # goal\n---\n---\nint32 y\n", "robot/Go")
    assert [comments_of(message.text).head for message in action.messages] == ["Head.", *[""] * 6]


def test_names_are_those_of_files_and_of_messages_of_actions(packages: Packages) -> None:
    packages.write("robot/msg/Arm.msg", "")
    packages.write("robot/msg/notes.txt", "")
    packages.write("robot/srv/Ask.srv", "---")
    packages.write("robot/action/Do.action", "---\n---")

    files = packages.definitions.files

    assert files.names("msg", "robot") == [
        *("Arm", "DoAction", "DoActionFeedback", "DoActionGoal", "DoActionResult", "DoFeedback", "DoGoal"),
        "DoResult",
    ]
    assert files.names("srv", "robot") == ["Ask"]


def test_the_messages_of_an_action_are_found_in_its_file(packages: Packages) -> None:
    packages.write("robot/action/Do.action", "int32 order\n---\n---\n")
    assert [field.name for field in packages.definitions.message("robot/DoGoal").fields] == ["order"]
    assert packages.definitions.message("robot/DoActionGoal").has_header


def test_an_action_whose_name_ends_like_one_of_its_messages(packages: Packages) -> None:
    packages.write("robot/action/SetGoal.action", "int32 order\n---\n---\n")
    assert [field.name for field in packages.definitions.message("robot/SetGoalGoal").fields] == ["order"]


def test_line_ends_of_other_systems_do_not_count(packages: Packages) -> None:
    packages.write("robot/msg/Arm.msg", b"int32 a\r\nint32 b")
    assert packages.definitions.message("robot/Arm").text == "int32 a\nint32 b"


def test_a_missing_definition_is_reported_with_the_searched_places(packages: Packages) -> None:
    packages.write("robot/msg/Arm.msg", "")
    with pytest.raises(NotFound, match=r"no message Leg in package robot: looked for .*/robot/msg/Leg\.msg"):
        packages.definitions.message("robot/Leg")
    with pytest.raises(NotFound, match="there is no package cat: ROS_PACKAGE_PATH is not set"):
        packages.definitions.message("cat/Paw")


def test_bytes_that_are_not_text_are_a_mistake_in_the_file(packages: Packages) -> None:
    file = packages.write("robot/msg/Arm.msg", b"int32 \xff")
    with pytest.raises(DefinitionError, match=r"Arm\.msg: the file cannot be read") as caught:
        packages.definitions.message("robot/Arm")
    assert caught.value.file == str(file)


def test_a_folder_besides_msg_is_searched_last_and_must_be_unambiguous(packages: Packages) -> None:
    """As `add_message_files(DIRECTORY test/msg FILES Arm.msg)` allows."""
    packages.write("robot/test/msg/Arm.msg", "int32 a")
    packages.write("robot/test/srv/Ask.srv", "int32 b\n---")
    assert packages.definitions.message("robot/Arm").text == "int32 a"
    assert [field.name for field in packages.definitions.service("robot/Ask").request.fields] == ["b"]

    packages.write("robot/old/Leg.msg", "int32 a")
    packages.write("robot/new/Leg.msg", "int32 a")
    with pytest.raises(NotFound, match=r"more than one file defines the message robot/Leg: .*Leg\.msg, "):
        packages.definitions.message("robot/Leg")
    packages.write("robot/msg/Leg.msg", "int32 c")
    assert packages.definitions.message("robot/Leg").text == "int32 c"
