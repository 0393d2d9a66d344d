"""Python source under construction: names that cannot collide, indentation, the limit of nested loops."""

from __future__ import annotations

import pytest

from pipros.msg.compile.emitter import BLOCK_LIMIT, Emitter, Names, python_name, struct_layout
from pipros.msg.language.parse import parse_message
from pipros.msg.language.spec import DefinitionError

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
