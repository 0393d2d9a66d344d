"""Definitions for which no class can be generated, and constants."""

from __future__ import annotations

import math

import pytest

from pipros.basics.limits import Limits
from pipros.msg.compile.compiler import message_source, service_source
from pipros.msg.compile.run import run
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
