"""Evaluate expressions from files and command lines without running Python code.

Python's own parser builds a syntax tree, which is then evaluated node by node. Nodes that are not on the
allow-list are rejected with their position. Methods are looked up in a fixed table (`methods.py`) and other
attributes do not exist, so an expression cannot reach the internals of the interpreter (CVE-2024-39835,
CVE-2024-39289). A caller may allow *fields* by passing a function that looks them up. The length of the text,
the depth, the number of steps and the size of every result are limited, so an expression cannot exhaust
memory or processor time.

`evaluate` is for `$(eval …)` and message filters, and `arithmetic` for the angles `rad(…)` and `deg(…)` in
parameter files.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.basics.limits import Limits, process_limits
from pipros.basics.syntax_trees import SYNTAX_TREES
from pipros.safe import guarded, operators
from pipros.safe.methods import find_method

TYPE_NAMES = ("_type", "_md5sum")
"""Names with a leading underscore that may be looked up with `fields`, such as a message's type."""

DEPTH_LIMIT = 50
"""Maximum nesting, well below the depth that would exhaust the interpreter's stack."""

_STEP = 2
"""Units of `expression_work` charged for each loop iteration, and for each node evaluated in a loop."""

_TAKE_A_FUNCTION = ("map", "filter")
_HAVE_A_KEY = ("sorted", "min", "max")

Function = Callable[..., Any]
FieldAccess = Callable[[Any, str], Any]


class ExpressionError(PiprosError, ValueError):
    """An expression is malformed, uses a forbidden feature, or fails.

    Attributes:
        text: the whole expression.
        column: the position of the error, counted from 1; 0 if unknown.
    """

    def __init__(self, text: str, column: int, reason: str) -> None:
        self.text = text
        self.column = column
        self.reason = reason
        place = f", column {column}" if column else ""
        shown = text if len(text) <= 200 else text[:200] + "…"
        super().__init__(f"in the expression [{shown}]{place}: {reason}")


_ARITHMETIC = (
    ast.Constant, ast.Name, ast.UnaryOp, ast.UAdd, ast.USub,
    ast.BinOp, ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Pow,
)  # fmt: skip


def evaluate(
    text: str,
    *,
    names: Mapping[str, Any] | None = None,
    functions: Mapping[str, Function] | None = None,
    fields: FieldAccess | None = None,
    limits: Limits | None = None,
) -> Any:
    """Return the value of an expression.

    The expression may contain literals, arithmetic, comparisons, `and`/`or`/`not`, `a if b else c`,
    subscripts, f-strings, comprehensions, the methods in `methods.py`, and calls to named functions. The
    functions and constants of `guarded.py`, which include `math`, are predefined; `functions` and `names` add
    others, or replace them. `map`, `filter` and `key=` take the name of a function. Generator expressions,
    `map` and similar functions return lists. `a.b` calls `fields(a, "b")`, if `fields` is given; if the
    result is callable, it is a method, which the expression must call. The default limits are the
    process-wide limits.

    Raises:
        ExpressionError: the text is malformed, or evaluation failed. If a called function raised an
            exception, that exception is the cause.

    >>> evaluate("rate * 2 if fast else max(rate, 1)", names={"rate": 5, "fast": True})
    10
    """
    return Expression(text, functions=functions, fields=fields, limits=limits).value(names or {})


class Expression:
    """An expression that is parsed once and evaluated many times.

    Takes the same arguments as `evaluate`, except `names`.

    Raises:
        ExpressionError: the text is malformed or too long.

    >>> Expression("a + b").value({"a": 1, "b": 2})
    3
    """

    def __init__(
        self,
        text: str,
        *,
        functions: Mapping[str, Function] | None = None,
        fields: FieldAccess | None = None,
        limits: Limits | None = None,
    ) -> None:
        self._text = text
        self._limits = limits or process_limits()
        self._tree = _parse(text, self._limits)
        self._functions = functions or {}
        self._fields = fields

    def names(self) -> set[str]:
        """Return all names in the expression: variables, functions and loop variables."""
        return {node.id for node in ast.walk(self._tree) if isinstance(node, ast.Name)}

    def value(self, names: Mapping[str, object]) -> Any:
        """Evaluate the expression with the given names. Raises the same errors as `evaluate`."""
        budget = guarded.WorkBudget(self._limits)
        walk = _Walk(
            self._text,
            {**guarded.CONSTANTS, **names},
            {**guarded.FUNCTIONS, **budget.functions, **self._functions},
            self._fields,
            budget,
        )
        return walk.value(self._tree)


def arithmetic(text: str) -> float:
    """Return the value of an arithmetic expression of numbers and `pi`, such as `pi/2` or `-2*(pi+1)`.

    Raises:
        ExpressionError: the text is not such an expression.

    >>> round(arithmetic("pi/2"), 4)
    1.5708
    """
    limits = process_limits()
    tree = _parse(text, limits)
    for node in ast.walk(tree):
        if isinstance(node, (ast.expr_context, *_ARITHMETIC)):
            continue
        raise ExpressionError(
            text, _column(text, node), "only numbers, pi, + - * / ** and brackets are allowed"
        )
    value = _Walk(text, {"pi": math.pi}, {}, None, guarded.WorkBudget(limits)).value(tree)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ExpressionError(text, 0, f"{value!r} is not a number")
    try:
        return float(value)
    except OverflowError as error:
        raise ExpressionError(text, 0, str(error)) from None


def _parse(text: str, limits: Limits) -> ast.expr:
    if len(text) > limits.expression_characters:
        raise ExpressionError(
            text, 0, f"the expression is longer than {limits.expression_characters} characters"
        )
    try:
        with SYNTAX_TREES:
            return ast.parse(text.strip(), mode="eval").body
    except SyntaxError as error:
        column = _first_column(text, error.lineno or 1) + error.offset - 1 if error.offset else 0
        raise ExpressionError(text, column, f"{error.msg}") from None
    except (ValueError, RecursionError, MemoryError) as error:
        raise ExpressionError(text, 0, str(error) or "nested too deeply") from None


def _column(text: str, node: ast.AST) -> int:
    """Return the position of a node in the text, counted from 1, or 0 if it has none."""
    if not isinstance(node, ast.expr):
        return 0
    line = text.lstrip().encode().splitlines()[node.lineno - 1]
    return _first_column(text, node.lineno) + len(line[: node.col_offset].decode())


def _first_column(text: str, number: int) -> int:
    """Return the position of the first character of a line of the expression."""
    parsed = text.lstrip()
    before = parsed.encode().splitlines(keepends=True)[: number - 1]
    return len(text) - len(parsed) + len(b"".join(before).decode()) + 1


def _name_of(node: ast.expr) -> str:
    """Return the identifier of a name node, or an empty string for other nodes."""
    return node.id if isinstance(node, ast.Name) else ""


class _Walk:
    """One evaluation: its names, the current depth, and the remaining budget."""

    def __init__(
        self,
        text: str,
        names: Mapping[str, object],
        functions: Mapping[str, Function],
        fields: FieldAccess | None,
        budget: guarded.WorkBudget,
    ) -> None:
        self._text = text
        self._names = names
        self._functions = functions
        self._fields = fields
        self._depth = 0
        self._loops = 0
        self._budget = budget

    def value(self, node: ast.expr) -> Any:
        evaluate_node = _NODES.get(type(node))
        if evaluate_node is None:
            raise self._error(node, operators.refusal(node))
        if self._depth >= DEPTH_LIMIT:
            raise self._error(node, f"the expression is nested more than {DEPTH_LIMIT} deep")
        self._depth += 1
        try:
            if self._loops:
                self._budget.spend(_STEP)
            return evaluate_node(self, node)
        except ExpressionError:
            raise
        except Exception as error:
            raise self._error(node, f"{error}") from error
        finally:
            self._depth -= 1

    def _error(self, node: ast.AST, reason: str) -> ExpressionError:
        return ExpressionError(self._text, _column(self._text, node), reason)

    def constant(self, node: ast.Constant) -> Any:
        return node.value

    def name(self, node: ast.Name) -> Any:
        if node.id in self._names:
            return self._names[node.id]
        if node.id in self._functions:
            raise self._error(node, f"{node.id} is a function; call it as {node.id}(…)")
        raise self._error(node, f"name '{node.id}' is not defined")

    def unary(self, node: ast.UnaryOp) -> Any:
        return operators.UNARY[type(node.op)](self.value(node.operand))

    def binary(self, node: ast.BinOp) -> Any:
        left, right = self.value(node.left), self.value(node.right)
        if growing := operators.GROWING.get(type(node.op)):
            return self._budget.charge(growing(self._budget, left, right))
        if plain := operators.BINARY.get(type(node.op)):
            if isinstance(left, set) and isinstance(right, set):
                self._budget.spend_on_reading(left, right)
                self._budget.spend_on_hashes([*left, *right])
            return self._budget.charge(plain(left, right))
        raise self._error(node, "this operator is not allowed")

    def boolean(self, node: ast.BoolOp) -> Any:
        ends_on = isinstance(node.op, ast.Or)
        result: Any = None
        for part in node.values:
            result = self.value(part)
            if bool(result) is ends_on:
                break
        return result

    def compare(self, node: ast.Compare) -> Any:
        left = self.value(node.left)
        result: Any = True
        for operation, part in zip(node.ops, node.comparators, strict=True):
            right = self.value(part)
            if self._loops:
                self._budget.spend_on_reading(right)
            result = operators.COMPARE[type(operation)](left, right)
            if not result:
                break
            left = right
        return result

    def conditional(self, node: ast.IfExp) -> Any:
        return self.value(node.body if self.value(node.test) else node.orelse)

    def subscript(self, node: ast.Subscript) -> Any:
        part = self.value(node.value)[self.value(node.slice)]
        return self._budget.charge(part) if self._loops and isinstance(node.slice, ast.Slice) else part

    def bounds(self, node: ast.Slice) -> Any:
        parts = (node.lower, node.upper, node.step)
        return slice(*(None if part is None else self.value(part) for part in parts))

    def new_list(self, node: ast.List) -> Any:
        return self._budget.charge([self.value(part) for part in node.elts])

    def new_tuple(self, node: ast.Tuple) -> Any:
        return self._budget.charge(tuple(self.value(part) for part in node.elts))

    def new_set(self, node: ast.Set) -> Any:
        return self._budget.charge({self.value(part) for part in node.elts})

    def new_dict(self, node: ast.Dict) -> Any:
        result = {}
        for key, part in zip(node.keys, node.values, strict=True):
            if key is None:
                raise self._error(node, "unpacking with ** is not allowed")
            result[self.value(key)] = self.value(part)
        return self._budget.charge(result)

    def call(self, node: ast.Call) -> Any:
        function = self._called(node.func)
        by_name = node.args[:1] if _name_of(node.func) in _TAKE_A_FUNCTION else []
        arguments = [self._function_named(item) for item in by_name]
        arguments += [self.value(argument) for argument in node.args[len(by_name) :]]
        keywords = {}
        for keyword in node.keywords:
            if keyword.arg is None:
                raise self._error(node, "unpacking with ** is not allowed")
            is_function = keyword.arg == "key" and _name_of(node.func) in _HAVE_A_KEY
            keywords[keyword.arg] = (self._function_named if is_function else self.value)(keyword.value)
        if self._loops and _name_of(node.func) != "len":
            self._budget.spend_on_reading(*arguments)
        return self._budget.charge(function(*arguments, **keywords))

    def _called(self, node: ast.expr) -> Function:
        """Return the function that a call refers to: a named function, or a method of a value."""
        if isinstance(node, ast.Name):
            function = self._functions.get(node.id)
            if function is None:
                raise self._error(node, f"function '{node.id}' is not defined")
            return function
        if not isinstance(node, ast.Attribute):
            raise self._error(node, "only functions and methods that have a plain name can be called")
        value = self.value(node.value)
        method = find_method(value, node.attr)
        if method is not None:
            if self._loops:
                self._budget.spend_on_reading(value)
            return partial(method, self._budget, value)
        found = None if self._fields is None or node.attr.startswith("_") else self._fields(value, node.attr)
        if not callable(found):
            raise self._error(
                node, f"the method .{node.attr}() of {type(value).__name__} is not allowed here"
            )
        return found  # type: ignore[no-any-return]

    def _function_named(self, node: ast.expr) -> Function | None:
        """Return the function that is passed by name as an argument to another function.

        Each call of the returned function is charged like a call in the expression, because `map` may call it
        a hundred thousand times.
        """
        if isinstance(node, ast.Constant) and node.value is None:
            return None
        name = _name_of(node)
        if name in _TAKE_A_FUNCTION or name not in self._functions:
            raise self._error(node, "this must be a function name")
        function = self._functions[name]

        def charged(*arguments: object) -> Any:
            self._budget.spend_on_reading(*arguments)
            return self._budget.charge(function(*arguments))

        return charged

    def attribute(self, node: ast.Attribute) -> Any:
        if self._fields is None or (node.attr.startswith("_") and node.attr not in TYPE_NAMES):
            raise self._error(node, f"attributes such as .{node.attr} are not allowed here")
        found = self._fields(self.value(node.value), node.attr)
        if callable(found):
            raise self._error(node, f".{node.attr} is a method; call it as .{node.attr}(…)")
        return found

    # ---- comprehensions

    def list_of(self, node: ast.ListComp | ast.GeneratorExp) -> Any:
        return self._budget.charge(self._each(node.generators, lambda: self.value(node.elt)))

    def set_of(self, node: ast.SetComp) -> Any:
        members = self._each(node.generators, lambda: self.value(node.elt))
        return self._budget.charge(self._budget.functions["set"](members))

    def dict_of(self, node: ast.DictComp) -> Any:
        pairs = self._each(node.generators, lambda: (self.value(node.key), self.value(node.value)))
        return self._budget.charge(self._budget.functions["dict"](pairs))

    def _each(self, generators: list[ast.comprehension], make: Callable[[], Any]) -> list[Any]:
        """Return the value of `make` for each iteration of the loops. The loop variables are discarded."""
        outer, made = self._names, list[Any]()
        names = dict(outer)
        self._names = names
        self._loops += 1
        try:
            self._loop(generators, names, lambda: made.append(make()))
        finally:
            self._names = outer
            self._loops -= 1
        return made

    def _loop(
        self, generators: list[ast.comprehension], names: dict[str, Any], act: Callable[[], None]
    ) -> None:
        if not generators:
            self._budget.spend(_STEP)
            act()
            return
        first, *rest = generators
        if first.is_async:
            raise self._error(first.iter, "async is not allowed")
        for item in self.value(first.iter):
            self._assign(first.target, item, names)
            if all(self.value(condition) for condition in first.ifs):
                self._loop(rest, names, act)

    def _assign(self, target: ast.expr, value: Any, names: dict[str, Any]) -> None:
        if isinstance(target, ast.Name):
            names[target.id] = value
        elif isinstance(target, (ast.Tuple, ast.List)):
            self._budget.spend_on_reading(value)
            for part, item in zip(target.elts, list(value), strict=True):
                self._assign(part, item, names)
        else:
            raise self._error(target, "loop variables must be plain names")

    # ---- strings

    def joined_text(self, node: ast.JoinedStr) -> Any:
        text = ""
        for part in node.values:
            text = self._budget.add(text, str(self.value(part)))
        return self._budget.charge(text)

    def formatted(self, node: ast.FormattedValue) -> Any:
        value = self.value(node.value)
        if node.conversion != -1:
            value = operators.CONVERSIONS[node.conversion](value)
        form = "" if node.format_spec is None else self.value(node.format_spec)
        return guarded.format_value(value, form)


# The allow-list: all other nodes are rejected.
_NODES: Mapping[type[ast.expr], Callable[[_Walk, Any], Any]] = {
    ast.Constant: _Walk.constant,
    ast.Name: _Walk.name,
    ast.UnaryOp: _Walk.unary,
    ast.BinOp: _Walk.binary,
    ast.BoolOp: _Walk.boolean,
    ast.Compare: _Walk.compare,
    ast.IfExp: _Walk.conditional,
    ast.Subscript: _Walk.subscript,
    ast.Slice: _Walk.bounds,
    ast.List: _Walk.new_list,
    ast.Tuple: _Walk.new_tuple,
    ast.Set: _Walk.new_set,
    ast.Dict: _Walk.new_dict,
    ast.Call: _Walk.call,
    ast.Attribute: _Walk.attribute,
    ast.ListComp: _Walk.list_of,
    ast.GeneratorExp: _Walk.list_of,
    ast.SetComp: _Walk.set_of,
    ast.DictComp: _Walk.dict_of,
    ast.JoinedStr: _Walk.joined_text,
    ast.FormattedValue: _Walk.formatted,
}
