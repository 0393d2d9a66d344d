"""Classes from untrusted definitions: the same classes, within limits."""

import copy
import io
import pickle
import subprocess
import sys
from typing import Any

import pytest
from nav_msgs.msg import Odometry
from std_msgs.msg import Header

import genpy.dynamic
from genmsg import InvalidMsgSpec, MsgGenerationException, MsgNotFound
from pipros.msg.class_finder import ClassFinder, MissingDefinition
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.language.digest import SEPARATOR
from pipros.msg.language.full_text import DEFINITION_BYTES, DEFINITION_TYPES
from pipros.msg.language.spec import DefinitionError


def written(message: Any) -> bytes:
    buff = io.BytesIO()
    message.serialize(buff)
    return buff.getvalue()


def test_a_full_text_gives_classes_for_all_types_in_it() -> None:
    classes = message_classes_from_text("nav_msgs/Odometry", Odometry._full_text)

    assert list(classes)[:3] == ["nav_msgs/Odometry", "std_msgs/Header", "geometry_msgs/PoseWithCovariance"]
    made = classes["nav_msgs/Odometry"]
    assert (made._md5sum, made._full_text) == (Odometry._md5sum, Odometry._full_text)
    original = Odometry(child_frame_id="base")
    assert written(made().deserialize(written(original))) == written(original)


def test_the_classes_are_independent_of_the_installed_ones() -> None:
    made = message_classes_from_text("std_msgs/Header", "int32 other")["std_msgs/Header"]
    assert made.__slots__ == ["other"]


@pytest.mark.parametrize(
    ("text", "error", "words"),
    [("int32", InvalidMsgSpec, "expected a type and a name"), ("U u", MsgNotFound, "unknown type")],
)
def test_genpy_raises_what_programs_catch(text: str, error: type[Exception], words: str) -> None:
    for caught in (error, MsgGenerationException):
        with pytest.raises(caught, match=words):
            genpy.dynamic.generate_dynamic("p/T", text)


def test_line_ends_of_another_system_change_nothing() -> None:
    text = f"U u\r\n{SEPARATOR}\r\nMSG: p/U\r\nint32 x\r\n"

    made = message_classes_from_text("p/T", text)["p/T"]

    assert made._full_text == text.replace("\r", "")
    assert made().u.x == 0


def test_the_header_of_old_bags_is_the_one_of_today() -> None:
    text = f"Header header\n{SEPARATOR}\nMSG: roslib/Header\n{Header._full_text}"

    classes = message_classes_from_text("p/T", text)

    assert list(classes) == ["p/T", "std_msgs/Header"]
    assert classes["p/T"]._has_header


def test_copies_are_of_the_same_class() -> None:
    made = message_classes_from_text("p/T", f"U[] u\n{part('p/U', 'int32 x')}")["p/T"]
    message = made()
    message.u.append(message_classes_from_text("p/U", "int32 x")["p/U"](3))

    assert copy.copy(message).u is message.u
    assert copy.deepcopy(message) == message
    assert copy.deepcopy(message).u is not message.u
    assert pickle.loads(pickle.dumps(message)) == message  # noqa: S301 # our own


def test_another_process_needs_no_definition_to_read_a_pickle() -> None:
    made = message_classes_from_text("p/T", "int32 x")["p/T"]
    code = f"import pickle; print(pickle.loads({pickle.dumps(made(3))!r}))"

    printed = subprocess.run(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, check=True
    ).stdout

    assert printed == "x: 3\n"


def test_constants_may_begin_with_an_underscore_but_not_replace_what_a_class_has() -> None:
    assert message_classes_from_text("p/T", "int32 _LOW=-3")["p/T"]._LOW == -3

    with pytest.raises(DefinitionError, match="the name _type is taken"):
        message_classes_from_text("p/T", "int32 _type=3")


def part(name: str, text: str) -> str:
    return f"{SEPARATOR}\nMSG: {name}\n{text}\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("p/Missing x", r"unknown type \[p/Missing\]"),
        ("T t", "cannot contain itself"),
        (f"int32 x\n{SEPARATOR}\nint32 y", "must be followed by MSG: package/Name"),
        (f"int32 x\n{part('no name', 'int32 x')}", "a type name must have the form package/Name, got"),
        ("int32 serialize", "the name serialize is taken"),
        ("int32 from\nint32 from_", "the name from_ is taken"),
        ("x" * (DEFINITION_BYTES + 1), "is longer than"),
        ("int32 x\n" + "".join(part(f"p/T{i}", "") for i in range(DEFINITION_TYPES)), "more than 1000 types"),
        ("int32[67108865] x", "array length must be <= 67108864, got 67108865"),
        ("A[3000] a\n" + part("p/A", "int32[3000] x"), "would contain too many values; the limit is 4194304"),
        (
            "A[] a\n"
            + "".join(
                part(f"p/{a}", f"{b}[] x")
                for a, b in zip("ABCDEFGHIJKLMNOPQ", "BCDEFGHIJKLMNOPQR", strict=True)
            )
            + part("p/R", "int8 x"),
            "arrays are nested deeper",
        ),
        (
            "A a\n"
            + "".join(
                part(f"p/{a}", "\n".join(f"{b} x{i}" for i in range(10)))
                for a, b in zip("ABCDE", "BCDEF", strict=True)
            )
            + part("p/F", "int8 x"),
            "fields in total; the limit is 3000",
        ),
    ],
)
def test_untrusted_definitions_are_limited(text: str, words: str) -> None:
    with pytest.raises(DefinitionError, match=words):
        message_classes_from_text("p/T", text)


def test_every_name_is_checked_before_python_uses_it() -> None:
    for text in ["int32 x\nint32 y;import os", "int32 x=__import__('os')", "int32 é", "string x\x00"]:
        with pytest.raises(DefinitionError):
            message_classes_from_text("p/T", text)


def test_constants_survive_a_round_trip() -> None:
    text = (
        'string S="); import os; (" \\n # x\nfloat32 N=nan\nfloat32 P=-inf\nfloat32 float=2.5\nstring str=x'
    )
    made: Any = message_classes_from_text("p/T", text)["p/T"]
    assert made.S == '"); import os; (" \\n # x'
    assert made.N != made.N
    assert (made.P, made.float, made.str) == (float("-inf"), 2.5, "x")


# Definitions that lack embedded types, or are cut, are completed from installed packages.


HEAD = "Header header\ngeometry_msgs/Point[] points\nown/Part part\n"


TEXTS = {
    "std_msgs/Header": "uint32 seq\ntime stamp\nstring frame_id\n",
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z\n",
    "own/Part": "int8 a\n",
}


def text_of(*names: str) -> str:
    return HEAD + "".join(f"{SEPARATOR}\nMSG: {name}\n{TEXTS[name]}" for name in names)


WHOLE = message_classes_from_text("own/Whole", text_of(*TEXTS))["own/Whole"]


@pytest.mark.parametrize(
    "text",
    [
        text_of("own/Part"),
        text_of("own/Part", "geometry_msgs/Point"),
        text_of("own/Part", "std_msgs/Header", "geometry_msgs/Point")[:-11],  # a field is missing
        text_of("own/Part", "std_msgs/Header", "geometry_msgs/Point")[:-13],  # within a field
        text_of("own/Part") + f"{SEPARATOR}\nMSG: std_ms",
        text_of("own/Part") + f"{SEPARATOR}\n",
        text_of("own/Part") + SEPARATOR[:9],
        text_of("own/Part").replace("\n", "\r\n"),
    ],
)
def test_types_of_installed_packages_are_added_if_the_md5_agrees(text: str) -> None:
    found = ClassFinder().find("own/Whole", WHOLE._md5sum, text)

    assert (found._md5sum, found._slot_types) == (WHOLE._md5sum, WHOLE._slot_types)
    assert found().header.frame_id == ""


def test_types_are_not_added_if_the_md5_differs() -> None:
    with pytest.raises(DefinitionError, match="std_msgs/Header"):
        ClassFinder().find("own/Whole", "1" * 32, text_of("own/Part"))
    with pytest.raises(DefinitionError):
        ClassFinder().find("own/Whole", WHOLE._md5sum, text_of())
    with pytest.raises(MissingDefinition):
        ClassFinder().find("own/Whole", WHOLE._md5sum, "")


def test_a_complete_definition_is_used_although_its_md5_differs() -> None:
    assert ClassFinder().find("own/Whole", "1" * 32, text_of(*TEXTS))._md5sum == WHOLE._md5sum
