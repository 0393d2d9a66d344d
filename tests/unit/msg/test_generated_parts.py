"""Parts of generated Python source for tools; tests/interop compares them with genuine genpy."""

from __future__ import annotations

import pytest

from genmsg import MsgContext
from genmsg.msg_loader import load_msg_from_string
from pipros.msg.generated_parts import (
    GenerationError,
    constructor,
    default_value,
    flattened,
    imports,
    is_simple,
    is_special,
    outfile_name,
    package_and_name,
    reduced_pattern,
    registered,
    special,
    struct_pattern,
    without_keywords,
)


@pytest.fixture
def context() -> MsgContext:
    context = MsgContext.create_default()
    load_msg_from_string(context, "int32 x\ntime stamp", "a_msgs/Inner")
    load_msg_from_string(context, "Inner one\nInner[] many\nstring text\nfloat32[3] lambda", "a_msgs/Outer")
    return context


def test_simple_and_special_types() -> None:
    assert is_simple("uint8")
    assert not is_simple("string")
    assert is_special("time")
    assert not is_special("uint8")
    found = special("duration")
    assert found is not None
    assert found.get_post_deserialize("x.d") == "x.d.canon()"
    header = special("Header")
    assert header is not None
    assert header.get_post_deserialize("x") is None
    assert special("uint8") is None


def test_an_unknown_type_is_an_error(context: MsgContext) -> None:
    assert registered(context, "a_msgs/Inner").full_name == "a_msgs/Inner"
    with pytest.raises(GenerationError, match=r"Unknown type \[a_msgs/None\]"):
        registered(context, "a_msgs/None")


def test_packages_of_types() -> None:
    assert package_and_name("own", "Type") == ("own", "Type")
    assert package_and_name("own", "other/Type") == ("other", "Type")
    with pytest.raises(GenerationError, match="illegal message type: a/b/c"):
        package_and_name("own", "a/b/c")


@pytest.mark.parametrize(
    ("type_", "expected"),
    [
        ("time", "genpy.Time()"),
        ("Header", "std_msgs.msg._Header.Header()"),
        ("Inner", "a_msgs.msg.Inner()"),
        ("a_msgs/Outer", "a_msgs.msg.Outer()"),
        ("other/Unknown", None),
        ("int32", None),
    ],
)
def test_constructors(context: MsgContext, type_: str, expected: str | None) -> None:
    assert constructor(context, "a_msgs", type_) == expected


@pytest.mark.parametrize(
    ("type_", "expected"),
    [
        ("int32[]", []),
        ("time", ["import genpy"]),
        ("Header", ["import std_msgs.msg"]),
        ("roslib/Header", ["import std_msgs.msg"]),
        ("Outer", ["import a_msgs.msg", "import genpy"]),
    ],
)
def test_imports(context: MsgContext, type_: str, expected: list[str]) -> None:
    assert imports(context, "a_msgs", type_) == expected


@pytest.mark.parametrize(
    ("type_", "expected"),
    [
        ("float64", "0."),
        ("bool", "False"),
        ("string", "''"),
        ("int8", "0"),
        ("Inner", "a_msgs.msg.Inner()"),
        ("int32[]", "[]"),
        ("uint8[]", "b''"),
        ("char[4]", "b'\\0'*4"),
        ("float32[3]", "[0.] * 3"),
        ("Inner[2]", "[a_msgs.msg.Inner() for _ in range(2)]"),
        ("time[2]", "[genpy.Time() for _ in range(2)]"),
    ],
)
def test_default_values(context: MsgContext, type_: str, expected: str) -> None:
    assert default_value(context, type_, "a_msgs") == expected


def test_names_that_are_keywords_get_an_underscore(context: MsgContext) -> None:
    spec = registered(context, "a_msgs/Outer")
    assert without_keywords(spec).names == ["one", "many", "text", "lambda_"]
    assert spec.names[-1] == "lambda"
    with_constant = load_msg_from_string(context, "int8 if=1\nint8 fine=2", "a_msgs/Constants")
    assert [constant.name for constant in without_keywords(with_constant).constants] == ["if_", "fine"]


def test_embedded_messages_are_flattened(context: MsgContext) -> None:
    context.register("time", load_msg_from_string(context, "uint32 secs\nuint32 nsecs", "a_msgs/time"))
    assert list(flattened(context, registered(context, "a_msgs/Outer"))) == [
        ("int32", "one.x"),
        ("uint32", "one.stamp.secs"),
        ("uint32", "one.stamp.nsecs"),
        ("a_msgs/Inner[]", "many"),
        ("string", "text"),
        ("float32[3]", "lambda"),
    ]


def test_patterns_of_struct() -> None:
    assert struct_pattern(["int32", "float64", "bool"]) == "idB"
    assert struct_pattern(["int32", "string"]) is None
    assert struct_pattern([]) is None
    assert reduced_pattern("iiidBB") == "3id2B"
    assert reduced_pattern("3id") == "3id"
    assert reduced_pattern("") == ""


def test_names_of_generated_files() -> None:
    assert outfile_name("/out", "/in/Type.msg", ".msg") == "/out/_Type.py"
