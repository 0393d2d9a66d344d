"""Definitions for which no class can be generated, and constants."""

import math

import pytest

from pipros.basics.limits import Limits
from pipros.msg.compile.compiler import message_source, service_source
from pipros.msg.compile.emitter import BLOCK_LIMIT, Emitter, Names, python_name, struct_layout
from pipros.msg.compile.run import run
from pipros.msg.language.parse import parse_message
from pipros.msg.language.spec import DefinitionError
from tests.support.constants import Constants
from tests.support.definitions import Packages


def source(packages: Packages, text: str, limits: Limits | None = None, name: str = "robot/Arm") -> str:
    package, _, file = name.partition("/")
    packages.write(f"{package}/msg/{file}.msg", text)
    definitions = packages.definitions
    return message_source(definitions.message(name), definitions.message, limits)[0]


def test_the_fields_of_all_embedded_messages_are_limited(packages: Packages) -> None:
    packages.write("robot/msg/Hand.msg", "int8 a\nint8 b\nint8 c")
    text = "Hand left\nHand right"
    source(packages, text, Limits(definition_fields=20))
    with pytest.raises(DefinitionError, match=r"the message has \d+ fields in total; the limit is 5"):
        source(packages, text, Limits(definition_fields=5), name="robot/Body")


def test_messages_that_no_reader_accepts_are_refused(packages: Packages, constants: Constants) -> None:
    packages.write("robot/msg/Nothing.msg", "")
    constants(EMPTY_ELEMENTS=9)
    with pytest.raises(
        DefinitionError,
        match=r"would exceed the budget of eight values per byte by \d+ values; the limit is 9",
    ):
        source(packages, "Nothing[1000] nothing\nint8 x", Limits())


def test_a_type_with_the_name_of_a_keyword_is_refused(packages: Packages) -> None:
    with pytest.raises(DefinitionError, match=r"\[None\] cannot be a Python class name"):
        source(packages, "int8 x", name="robot/None")
    packages.write("robot/srv/True.srv", "---")
    definitions = packages.definitions
    with pytest.raises(DefinitionError, match=r"\[True\] cannot be a Python class name"):
        service_source(definitions.service("robot/True"), definitions.message)


def test_constants_may_be_infinite_or_not_a_number(packages: Packages) -> None:
    made = run(source(packages, "float64 high=inf\nfloat64 low=-inf\nfloat32 no=nan"), {})["Arm"]
    assert made.high == math.inf
    assert made.low == -math.inf
    assert math.isnan(made.no)


# Python source under construction: names that cannot collide, indentation, the limit of nested loops.


SPEC = parse_message("int32 x", "a/T")


def test_keywords_and_self_get_an_underscore() -> None:
    assert [python_name(name) for name in ("from", "self", "x")] == ["from_", "self_", "x"]


def test_names_of_classes_cannot_be_equal() -> None:
    names = Names()

    found = [names.message_class(name) for name in ("a/b_c", "a_b/c", "a/b_c")]

    assert found[0] == found[2] != found[1]
    assert names.classes == {"a/b_c": found[0], "a_b/c": found[1]}


def test_each_struct_is_made_once_and_each_field_of_strings_has_its_own_reader() -> None:
    names = Names()

    assert names.struct_method("<I", "pack") == names.struct_method("<I", "pack")
    assert names.struct_method("<I", "unpack_from") != names.struct_method("<I", "pack")
    assert names.repeated_strings("strict") != names.repeated_strings("strict")


def test_blocks_are_indented() -> None:
    emitter = Emitter(Names(), indent=1)
    with emitter.block("if a:"):
        emitter.emit("b")
    emitter.emit("c")

    assert emitter.lines == ["    if a:", "        b", "    c"]


def test_each_assigned_local_has_a_new_name() -> None:
    emitter = Emitter(Names())

    assert emitter.assign("o", "1 + 1") != emitter.assign("o", "2")
    assert emitter.lines == ["o0 = 1 + 1", "o1 = 2"]


def test_captured_lines_are_kept_apart() -> None:
    emitter = Emitter(Names(), indent=2)
    with emitter.captured() as lines:
        emitter.emit("inner")
    emitter.emit("outer")

    assert lines == ["inner"]
    assert emitter.lines == ["        outer"]


def test_loops_are_limited_below_what_python_can_nest() -> None:
    emitter = Emitter(Names())

    def nest(depth: int) -> None:
        if depth:
            with emitter.loop("for _ in ():", SPEC):
                assert emitter.is_looping
                nest(depth - 1)

    nest(BLOCK_LIMIT)
    assert not emitter.is_looping
    with pytest.raises(DefinitionError, match=f"nested deeper than {BLOCK_LIMIT}"):
        nest(BLOCK_LIMIT + 1)


def test_codes_are_counted() -> None:
    assert struct_layout(["d", "d", "d", "I", "4s", "4s", "B"]) == "<3dI4s4sB"
