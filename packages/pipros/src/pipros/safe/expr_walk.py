"""Evaluate the syntax tree of an expression, node by node."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.safe import guarded, operators
from pipros.safe.methods import find_method

TYPE_NAMES = ("_type", "_md5sum")
"""Names with a leading underscore that may be looked up with `fields`, such as a message's type."""

DEPTH_LIMIT = 50
"""Maximum nesting, well below the depth that would exhaust the interpreter's stack."""

_STEP = 2
"""Units of `EXPRESSION_WORK` charged for each loop iteration, and for each node evaluated in a loop."""

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


def column_of(text: str, node: ast.AST) -> int:
    """Return the position of a node in the text, counted from 1, or 0 if it has none."""
    if not isinstance(node, ast.expr):
        return 0
    line = text.lstrip().encode().splitlines()[node.lineno - 1]
    return first_column(text, node.lineno) + len(line[: node.col_offset].decode())


def first_column(text: str, number: int) -> int:
    """Return the position of the first character of a line of the expression."""
    parsed = text.lstrip()
    before = parsed.encode().splitlines(keepends=True)[: number - 1]
    return len(text) - len(parsed) + len(b"".join(before).decode()) + 1


def _name_of(node: ast.expr) -> str:
    """Return the identifier of a name node, or an empty string for other nodes."""
    return node.id if isinstance(node, ast.Name) else ""


class Walk:
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
        return ExpressionError(self._text, column_of(self._text, node), reason)

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
_NODES: Mapping[type[ast.expr], Callable[[Walk, Any], Any]] = {
    ast.Constant: Walk.constant,
    ast.Name: Walk.name,
    ast.UnaryOp: Walk.unary,
    ast.BinOp: Walk.binary,
    ast.BoolOp: Walk.boolean,
    ast.Compare: Walk.compare,
    ast.IfExp: Walk.conditional,
    ast.Subscript: Walk.subscript,
    ast.Slice: Walk.bounds,
    ast.List: Walk.new_list,
    ast.Tuple: Walk.new_tuple,
    ast.Set: Walk.new_set,
    ast.Dict: Walk.new_dict,
    ast.Call: Walk.call,
    ast.Attribute: Walk.attribute,
    ast.ListComp: Walk.list_of,
    ast.GeneratorExp: Walk.list_of,
    ast.SetComp: Walk.set_of,
    ast.DictComp: Walk.dict_of,
    ast.JoinedStr: Walk.joined_text,
    ast.FormattedValue: Walk.formatted,
}
