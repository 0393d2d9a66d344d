"""Definitions for which no class can be generated, and constants."""

import math

import pytest

from pipros.basics.limits import Limits
from pipros.msg.compile.compiler import message_source, service_source
from pipros.msg.compile.emitter import BLOCK_LIMIT, Emitter, Names
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
    assert (made.high, made.low) == (math.inf, -math.inf)
    assert math.isnan(made.no)


# Python source under construction: names that cannot collide, indentation, the limit of nested loops.


SPEC = parse_message("int32 x", "a/T")


def test_names_of_classes_cannot_be_equal() -> None:
    names = Names()

    found = [names.message_class(name) for name in ("a/b_c", "a_b/c", "a/b_c")]

    assert found[0] == found[2] != found[1]
    assert names.repeated_strings("strict") != names.repeated_strings("strict"), "each field has its own"
    assert names.classes == {"a/b_c": found[0], "a_b/c": found[1]}


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
