import contextlib
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros.safe.expr import arithmetic, evaluate
from pipros.safe.expr_walk import ExpressionError
from pipros.safe.guarded import BITS_LIMIT
from tests.support.constants import Constants

MODULUS = (1 << 61) - 1
"""Python gives all multiples of it the same hash."""

NAMES = {"a": 3, "b": True, "s": "hi", "xs": [1, 2, 3], "d": {"k": "v"}}


@pytest.mark.parametrize(("text", "value"), [
    ("a + 1", 4), ("-a * 2 // 4", -2), ("2 ** 10", 1024), ("pow(2, 10, 7)", 2), ("prod([2, 3], start=2)", 12),
    ("'%05.1f' % 2.25", "002.2"), ("f'{2.5:06.2f}'", "002.50"), ("7 % 4", 3), ("1 << 4 | 3", 19),
    ("not b", False), ("a == 3 and s == 'hi'", True), ("0 or s", "hi"), ("1 < a < 3", False),
    ("2 in xs and 9 not in xs", True), ("'yes' if b else 'no'", "yes"), ("xs[0] + xs[-1]", 4),
    ("xs[1:]", [2, 3]), ("d['k']", "v"), ("{'x': a}", {"x": 3}), ("(a, s)", (3, "hi")), ("{a, a}", {3}),
    ("'x%d-%s' % (a, s)", "x3-hi"), ("f'{a}/{s!r:>6}'", "3/  'hi'"), ("s + ' x'", "hi x"), ("3 * '-'", "---"),
    ("max(a, 5)", 5), ("sum(xs)", 6), ("len(s)", 2), ("dict(k=1)", {"k": 1}), ("round(1.26, 1)", 1.3),
    ("sin(0) + cos(0)", 1.0), ("pi", math.pi), ("true", True), ("None", None), ("factorial(5)", 120),
    ("  a\n", 3), ("s.upper() + ' %s'.strip()", "HI%s"), ("' a,b '.strip().split(',')", ["a", "b"]),
    ("'-'.join(['x', s])", "x-hi"), ("s.replace('h', 'ch').zfill(5)", "00chi"),
    ("'{0:>4}|{name}|{1[0]}|{2[k]}'.format(a, xs, d, name=s)", "   3|hi|1|v"),
    ("'{} {!r}'.format(a, s)", "3 'hi'"), ("'a\\tb'.expandtabs(4)", "a   b"),
    ("d.get('k') + d.get('nope', '!')", "v!"), ("list(d.items())", [("k", "v")]),
    ("xs.index(2) + xs.count(9)", 1), ("(1, 2).index(2)", 1), ("{1, 2}.union({3}) == {1, 2, 3}", True),
    ("[x * a for x in xs if x > 1]", [6, 9]), ("{x % 2 for x in xs}", {0, 1}),
    ("{k: v.upper() for k, v in d.items()}", {"k": "V"}),
    ("[(x, y) for x in xs for y in range(x) if y]", [(2, 1), (3, 1), (3, 2)]),
    ("[[y for y in range(x)] for x in xs][-1]", [0, 1, 2]), ("[x for x, (y, z) in [(1, (2, 3))]]", [1]),
    ("any(x == 2 for x in xs)", True), ("[a for a in xs][0] + a", 4),
    ("list(map(str, xs)) + list(filter(None, [0, 'y']))", ["1", "2", "3", "y"]),
    ("sorted(['bbb', 'a'], key=len) + [max('xy', 'z', key=len)]", ["a", "bbb", "xy"]),
    ("[x + i for i, x in enumerate(reversed(xs))]", [3, 3, 3]),
])  # fmt: skip
def test_expressions_have_the_value_that_python_gives_them(text: str, value: Any) -> None:
    assert evaluate(text, names=NAMES) == value


def test_functions_of_the_caller_take_precedence() -> None:
    assert evaluate("arg('x') + len('abc')", functions={"arg": lambda name: name, "len": str}) == "xabc"


@pytest.mark.parametrize("text", [
    "().__class__.__bases__[0].__subclasses__()", "(1).real", "s.upper", "s.encode()", "s.format_map(d)",
    "s.translate({104: 'x'})", "s.__len__()", "xs.append(1)", "xs.sort()", "d.update(k=1)", "d.pop('k')",
    "'{0[k].__class__}'.format(d)", "'{:{0.__class__}}'.format(1)", "map", "map('len', xs)", "map(map, xs)",
    "sorted(xs, key=s)", "[len for x in xs]", "[x for x in xs] + x", "[x for x in a]",
    "[x for x, y in [(1, 2, 3)]]", "[0 for xs[0] in xs]", "[x async for x in xs]", "[(y := x) for x in xs]",
    "'{0.__class__}'.format(1)", "f'{s.__class__}'", "f'{xs.append}'", "math.os", "__import__('os')",
    "open('/etc/passwd')", "eval('1')", "exec('1')", "getattr(s, 'upper')", "(lambda: 1)()", "(a := 1)",
    "print(*xs)", "dict(**d)", "{**d}", "xs[0]()", "len", "a @ a", "nope", "type(a)", "vars()", "globals()",
    "object()", "import os", "a = 1", "", "1 +", "yield a",
])  # fmt: skip
def test_attributes_and_methods_outside_the_allow_list_are_refused(text: str) -> None:
    with pytest.raises(ExpressionError):
        evaluate(text, names=NAMES)


@pytest.mark.parametrize("text", [
    "9 ** 9 ** 9", f"2 ** {BITS_LIMIT + 1}", f"1 << {BITS_LIMIT}", "(1 << 3000) * (1 << 3000)",
    "s * 30000 + s * 30000", "[0] * 60000 + [0] * 60000", "[s * 20000] * 4", "range(100001)", "'%9999d' % 5",
    "f'{2.5:>99999}'", "round(2.5, 10000)", "factorial(1001)", "comb(1001, 2)", "perm(1001, 2)",
    "lcm(1001, 2)", "10 ** -(10 ** 9)", "pow(10, 10 ** 9)", "1 << 10 ** 9", "'a' * 10 ** 9", "10 ** 9 * 'a'",
    "[0] * 10 ** 9", "str([['a' * 300] * 300] * 300)", "'%999999999d' % 1", "'%*d' % (999999999, 1)",
    "'%s' * 900 % ((s * 40000,) * 900)", "f'{1:999999999}'", "f'{1:{10 ** 9}}'", "factorial(10 ** 6)",
    "comb(10 ** 6, 10 ** 5)", "round(5, -10 ** 300)", "list(range(10 ** 9))", "sum(range(10 ** 12))",
    "prod([10 ** 300] * 300)", "[" + ", ".join(["range(90000)"] * 50) + "]", "+".join(["a"] * 100_000),
    "(" * 500 + "a" + ")" * 500, "-" * 500 + "1", "-" * 3000 + "1", "not " * 300 + "1",
    f"len(set(range(0, 100000 * {MODULUS}, {MODULUS})))",
    f"len(set(zip(range(0, 40000 * {MODULUS}, {MODULUS}))))",
    f"len(dict(zip(range(0, 30000 * {MODULUS}, {MODULUS}), range(30000))))", "len(sum([[0]] * 45000, []))",
    "len(prod([1] * 45000, start=[0] * 90000))",
    "[0 for x in range(1000) for y in range(1000) for z in range(1000)]",
    "sum(sum(y for y in range(10000)) for x in range(10000))",
    "[x for x in range(90000) if x in range(90000)]", "[x for x in range(90000) if [0] * 9000 == [0] * 9000]",
    "[min(range(9000)) for x in range(90000)]", "[(s * 40000).find('x') for x in range(9000)]",
    "[(s * 40000)[x:] for x in range(9000)]", "list(map(sorted, [range(50000)] * 1000))",
    "sorted([range(50000)] * 1000, key=sum)", "'a'.ljust(10 ** 9)", "'{:>999999999}'.format(1)",
    "'{:>{}}'.format(1, 10 ** 9)", "('{0}' * 900).format(s * 40000)", "('a' * 1000).replace('a', 'b' * 1000)",
    "(s * 40000).join([s * 100] * 900)", "('\\t' * 1000).expandtabs(10 ** 9)", "(s * 90000).split('h')",
    f"len({{x for x in range(0, 90000 * {MODULUS}, {MODULUS})}})",
    f"len({{x: 0 for x in range(0, 90000 * {MODULUS}, {MODULUS})}})",
])  # fmt: skip
def test_expressions_that_would_exhaust_resources_are_refused(text: str) -> None:
    """Without a limit, each would exceed the time limit of a test or exhaust memory."""
    with pytest.raises(ExpressionError):
        evaluate(text, names=NAMES)


def test_sets_and_dictionaries_are_as_large_as_other_results() -> None:
    assert (evaluate("len(set(range(45000)))"), evaluate("len(set([1] * 45000))")) == (45_000, 1)
    assert evaluate("len(dict(zip(range(15000), range(15000))))") == 15_000
    assert evaluate("dict([('a', 1), 'bc'], d=2)") == {"a": 1, "b": "c", "d": 2}
    assert (evaluate("dict(dict(a=1), b=2)"), evaluate("set()")) == ({"a": 1, "b": 2}, set())


@pytest.mark.parametrize("text", [
    "[f'{1:999}' for x in range(90000)]", "[f'{text}{text}' for text in ['a' * 49999] for x in range(90000)]",
    "set().union([x * (2**61 - 1) for x in range(3000)])",
    "{0}.symmetric_difference([x * (2**61 - 1) for x in range(3000)])",
    "{x * (2**61 - 1) for x in range(1500)} | {x * (2**61 - 1) for x in range(1500, 3000)}",
    "[s - s for s in [set(range(30000))] for x in range(1000)]",
])  # fmt: skip
def test_texts_and_sets_count_as_work(text: str) -> None:
    with pytest.raises(ExpressionError, match="does too much work"):
        evaluate(text)


def test_sets_are_combined() -> None:
    assert (evaluate("{1, 2}.union([2, 3], {4})"), evaluate("{1, 2} | {3}")) == ({1, 2, 3, 4}, {1, 2, 3})
    assert evaluate("{1, 2}.issubset(range(5))") is True


@pytest.mark.parametrize(("text", "limit", "words"), [
    ("1 + 1", {"EXPRESSION_CHARACTERS": 4}, "longer than 4 characters"),
    ("'abc' + 'de'", {"EXPRESSION_SIZE": 4}, "more than 4 characters or elements"),
    ("1 + 1 + 1 + 1", {"EXPRESSION_WORK": 2}, "does too much work"),
])  # fmt: skip
def test_each_limit_applies(constants: Constants, text: str, limit: dict[str, int], words: str) -> None:
    constants(**limit)
    with pytest.raises(ExpressionError, match=words):
        evaluate(text)


def test_an_error_names_the_place() -> None:
    with pytest.raises(ExpressionError, match=r"column 5: name 'nope' is not defined") as error:
        evaluate("1 + nope")
    assert (error.value.column, error.value.text) == (5, "1 + nope")


@pytest.mark.parametrize(
    ("text", "column"),
    [("  nope", 3), ("'äö' == nope", 9), ("(1 +\n nope)", 7), ("  1 +* 2", 6), ("(1 +\n  * 2)", 8), ("", 0)],
)
def test_errors_have_the_position_in_the_text_that_was_given(text: str, column: int) -> None:
    with pytest.raises(ExpressionError) as error:
        evaluate(text)
    assert error.value.column == column


def test_an_error_of_a_function_is_kept_as_the_cause() -> None:
    def fail() -> None:
        raise KeyError("x")

    with pytest.raises(ExpressionError) as error:
        evaluate("1 if fail() else 2", functions={"fail": fail})
    assert isinstance(error.value.__cause__, KeyError)


def test_fields_are_resolved_only_for_the_caller() -> None:
    def field(value: Any, name: str) -> Any:
        return value[name]

    assert evaluate("m.header.seq > 6", names={"m": {"header": {"seq": 7}}}, fields=field) is True
    with pytest.raises(ExpressionError):
        evaluate("m._slots", names={"m": {"_slots": 1}}, fields=field)


@pytest.mark.parametrize(
    ("text", "value"), [("pi/2", math.pi / 2), ("-2*(pi+1)", -2 * (math.pi + 1)), (" 90 ", 90), ("2**3", 8)]
)
def test_arithmetic_knows_numbers_and_pi(text: str, value: float) -> None:
    assert arithmetic(text) == pytest.approx(value)


@pytest.mark.parametrize(
    "text",
    ["", "x", "sin(1)", "'a'", "1 if 1 else 2", "1 < 2", "True", "a.b", "1j", "1/0", "8**9**9", "9" * 400],
)
def test_arithmetic_refuses_other_syntax(text: str) -> None:
    with pytest.raises(ExpressionError):
        arithmetic(text)


@given(st.text(alphabet="abs(),.[]{}'\"+-*/%<>=:! \n0123456789_lambdifoneratu", max_size=60))
def test_any_text_returns_a_value_or_raises_an_expression_error(text: str) -> None:
    with contextlib.suppress(ExpressionError):
        evaluate(text, names=NAMES)
