"""Bounds of the operations of expressions: each result, all results together, and the work for them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from pipros.safe.guarded import BITS_LIMIT, CONSTANTS, FUNCTIONS, ResultTooLarge, WorkBudget, format_value
from tests.support.constants import changed


def budget(size: int = 100, work: int = 1000) -> WorkBudget:
    with changed(EXPRESSION_SIZE=size, EXPRESSION_WORK=work):
        return WorkBudget()


@pytest.mark.parametrize(
    "operation",
    [
        lambda of: of.add("a" * 60, "b" * 60),
        lambda of: of.add([0] * 60, [1] * 60),
        lambda of: of.multiply("ab", 51),
        lambda of: of.multiply(51, [1, 2]),
        lambda of: of.multiply(1 << 3000, 1 << 3000),
        lambda of: of.power(2, BITS_LIMIT + 1),
        lambda of: of.shift_left(1, BITS_LIMIT),
        lambda of: of.modulo("%s" * 10, ("a" * 60,)),
        lambda of: of.modulo("%*d", (5, 5)),
        lambda of: of.modulo("%9999d", 5),
        lambda of: of.functions["range"](101),
        lambda of: of.charge(["a" * 60] * 2),
    ],
)
def test_a_result_above_the_limit_is_not_computed(operation: Callable[[WorkBudget], Any]) -> None:
    with pytest.raises(ResultTooLarge):
        operation(budget())


@pytest.mark.parametrize(
    ("operation", "result"),
    [
        (lambda of: of.add("a", "b"), "ab"),
        (lambda of: of.multiply("ab", 2), "abab"),
        (lambda of: of.power(2, 10), 1024),
        (lambda of: of.power(2, 10, 7), 2),
        (lambda of: of.shift_left(1, 4), 16),
        (lambda of: of.modulo(7, 4), 3),
        (lambda of: of.modulo("%05.1f", 2.25), "002.2"),
        (lambda of: of.functions["sum"]([1, 2]), 3),
        (lambda of: of.functions["prod"]([2, 3], start=2), 12),
        (lambda of: of.functions["dict"]([("a", 1)], b=2), {"a": 1, "b": 2}),
        (lambda of: of.functions["set"]([1, 1]), {1}),
    ],
)
def test_small_results_are_as_in_python(operation: Callable[[WorkBudget], Any], result: Any) -> None:
    assert operation(budget()) == result


def test_many_small_results_exhaust_the_budget() -> None:
    of = budget(work=1000)

    for _ in range(10):
        of.charge("x" * 100)
    with pytest.raises(ResultTooLarge, match="does too much work"):
        of.charge("x")


def test_a_text_in_a_list_counts_each_time() -> None:
    long = "x" * 30

    with pytest.raises(ResultTooLarge):
        budget().charge([long] * 4)


def test_numbers_with_equal_hashes_count_as_comparisons() -> None:
    modulus = (1 << 61) - 1  # the modulus of Python's integer hash
    colliding = [1 + number * modulus for number in range(200)]
    distinct = list(range(200))

    assert len(budget(1000, 10_000).functions["set"](distinct)) == 200
    with pytest.raises(ResultTooLarge):
        budget(1000, 10_000).functions["set"](colliding)
    with pytest.raises(ResultTooLarge):
        budget(1000, 10_000).functions["dict"]([(key, 0) for key in colliding])


@pytest.mark.parametrize("name", ["factorial", "comb", "perm", "lcm"])
def test_slow_functions_take_small_numbers_only(name: str) -> None:
    arguments = (1001,) if name == "factorial" else (1001, 2)

    with pytest.raises(ResultTooLarge, match="arguments above 1000"):
        FUNCTIONS[name](*arguments)
    assert FUNCTIONS["factorial"](5) == 120


def test_widths_and_digits_are_bounded() -> None:
    assert format_value(2.5, "06.2f") == "002.50"
    with pytest.raises(ResultTooLarge, match="a width above"):
        format_value(2.5, ">99999")
    with pytest.raises(ResultTooLarge, match="digits"):
        FUNCTIONS["round"](2.5, 10_000)


def test_no_attribute_leads_to_the_interpreter() -> None:
    names = {*CONSTANTS, *FUNCTIONS}

    assert not names & {"eval", "exec", "open", "getattr", "type", "vars", "globals", "__import__", "object"}
    assert {"pi", "true", "sqrt", "len"} <= names
