"""Interpret the method `update` of a migration rule without running Python code.

The statements that occur in real rules are supported: assignments to message fields and to names, `assert`,
`if`, `for` over a list, `self.migrate`, `self.migrate_array`, `self.get_new_class(NAME)(…)`, calls to the
rule's other methods, directly or through a dictionary of methods, and `append`. Other statements are rejected
when the rule is parsed, with an error that names the line. `pipros.safe.expr` evaluates expressions.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.msg.base import Message
from pipros.msg.field_access import field_of
from pipros.safe.expr import Expression
from pipros_tools.bag.errors import BagError

_CLASS_MAKERS = ("get_new_class", "get_old_class")
_STATEMENT_LIMIT = 100_000
"""Maximum number of statements executed for one message."""
_CALL_DEPTH = 20

Migrate = Callable[[Message, type[Message]], Message]
FindClass = Callable[[str, str], type[Message] | None]
"""Callable that takes "new" or "old" and a type name, and returns the class in that definition, or None."""


class RuleRefused(Exception):
    """A rule contains an unsupported statement. `node` is the unsupported part."""

    def __init__(self, node: ast.AST, reason: str) -> None:
        super().__init__(reason)
        self.node = node


def check(methods: Mapping[str, ast.FunctionDef]) -> None:
    """Raise `RuleRefused` for the first unsupported statement."""
    for method in methods.values():
        _check_all(method.body, methods)


def _check_all(body: Sequence[ast.stmt], methods: Mapping[str, ast.FunctionDef]) -> None:
    for node in body:
        if isinstance(node, ast.If | ast.For):
            if isinstance(node, ast.For) and (not isinstance(node.target, ast.Name) or node.orelse):
                raise RuleRefused(node, "a loop must have a single target name and no else")
            _check_all(node.body, methods)
            _check_all(node.orelse, methods)
        elif isinstance(node, ast.Assign) and len(node.targets) == 1:
            _check_target(node.targets[0])
        elif isinstance(node, ast.AugAssign):
            _check_target(node.target)
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            if not _is_known_call(node.value, methods):
                raise RuleRefused(node, f"a rule must not call [{ast.unparse(node.value.func)}]")
        elif not isinstance(node, ast.Assert | ast.Pass) and not is_text(node):
            raise RuleRefused(
                node,
                "a rule may only contain assignments, calls, assert, pass, if and for",
            )


def _check_target(target: ast.expr) -> None:
    names = _attributes(target)
    if not names or (len(names) > 1 and names[0] == "self") or names[0] == "old_msg":
        raise RuleRefused(target, "a rule may only assign to names and message fields, but not to old_msg")


def _is_known_call(call: ast.Call, methods: Mapping[str, ast.FunctionDef]) -> bool:
    name = _of_self(call.func)
    if name in ("migrate", "migrate_array"):
        return len(call.args) >= 2 and len(_attributes(call.args[1])) > 0
    if name:
        return name in methods
    if isinstance(call.func, ast.Attribute):
        return call.func.attr == "append" and len(call.args) == 1 and len(_attributes(call.func.value)) > 0
    return isinstance(call.func, ast.Subscript)


def is_text(node: ast.stmt) -> bool:
    """Return whether a statement is a bare constant, such as a docstring."""
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def _attributes(node: ast.expr) -> tuple[str, ...]:
    """Return ("a", "b", "c") for `a.b.c`, and an empty tuple for anything else."""
    names: list[str] = []
    while isinstance(node, ast.Attribute) and not node.attr.startswith("_"):
        names.insert(0, node.attr)
        node = node.value
    return (node.id, *names) if isinstance(node, ast.Name) else ()


def _of_self(node: ast.expr) -> str:
    """Return the `name` of `self.name`, or an empty string."""
    is_it = isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "self"
    return node.attr if is_it and isinstance(node, ast.Attribute) else ""


class Update:
    """Interpreter for one rule's method `update`. Not thread-safe.

    Args:
        set_field: callable that sets a message's field, and migrates the value if necessary.
    """

    def __init__(
        self,
        rule: str,
        methods: Mapping[str, ast.FunctionDef],
        migrate: Migrate,
        find_class: FindClass,
        set_field: Callable[[Any, str, Any], None],
    ) -> None:
        self._rule = rule
        self._methods = methods
        self._migrate = migrate
        self._find_class = find_class
        self._set_field = set_field
        self._expressions: dict[ast.expr, Expression] = {}
        self._left = self._depth = 0

    def run(self, old: Message, new: Message) -> None:
        """Fill `new` from `old`.

        Raises:
            BagError, ExpressionError: the rule fails, for example because an `assert` failed, a field does
                not exist, or another rule is missing.
        """
        self._left, self._depth = _STATEMENT_LIMIT, 0
        try:
            self._call("update", [old, new])
        except PiprosError:
            raise
        except (TypeError, ValueError, AttributeError, KeyError) as error:
            raise BagError(f"rule {self._rule}, from [{old._type}] to [{new._type}]: {error}") from error

    def _call(self, name: str, values: Sequence[Any]) -> None:
        method = self._methods[name]
        parameters = [each.arg for each in method.args.args][1:]
        self._depth += 1
        if self._depth > _CALL_DEPTH:
            raise self._error(method, f"calls are nested more than {_CALL_DEPTH} deep")
        if len(parameters) != len(values):
            raise self._error(method, f"[{name}] takes {len(parameters)} arguments, got {len(values)}")
        self._do_all(method.body, dict(zip(parameters, values, strict=True)))
        self._depth -= 1

    def _do_all(self, body: Sequence[ast.stmt], names: dict[str, Any]) -> None:
        for node in body:
            self._left -= 1
            if self._left < 0:
                raise self._error(
                    node, f"a rule may execute at most {_STATEMENT_LIMIT} statements per message"
                )
            self._do(node, names)

    def _do(self, node: ast.stmt, names: dict[str, Any]) -> None:
        if isinstance(node, ast.Assign):
            self._assign(node.targets[0], self._value(node.value, names), names)
        elif isinstance(node, ast.AugAssign):
            operands = {"left": self._value(node.target, names), "right": self._value(node.value, names)}
            sign = ast.unparse(ast.BinOp(left=ast.Name("left"), op=node.op, right=ast.Name("right")))
            self._assign(node.target, Expression(sign).value(operands), names)
        elif isinstance(node, ast.Assert):
            if not self._value(node.test, names):
                reason = "" if node.msg is None else f": {self._value(node.msg, names)}"
                raise self._error(node, f"assertion failed{reason}")
        elif isinstance(node, ast.If):
            self._do_all(node.body if self._value(node.test, names) else node.orelse, names)
        elif isinstance(node, ast.For) and isinstance(node.target, ast.Name):
            for value in list(self._value(node.iter, names)):
                names[node.target.id] = value
                self._do_all(node.body, names)
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            self._statement_call(node.value, names)

    def _statement_call(self, call: ast.Call, names: dict[str, Any]) -> None:
        name = _of_self(call.func)
        if name == "migrate":
            self._migrate_into(call.args[1], self._value(call.args[0], names), names)
        elif name == "migrate_array":
            cls = None if len(call.args) < 3 else self._find_class("new", self._value(call.args[2], names))
            values = self._value(call.args[0], names)
            made = values if cls is None else [self._migrate(each, cls) for each in values]
            self._assign(call.args[1], made, names)
        elif isinstance(call.func, ast.Attribute) and not name:
            current = self._value(call.func.value, names)
            self._assign(call.func.value, [*current, self._value(call.args[0], names)], names)
        else:
            chosen = name or self._value(call.func, names)
            if not isinstance(chosen, str) or chosen not in self._methods:
                raise self._error(call, "only methods of the rule can be called")
            self._call(chosen, [self._value(each, names) for each in call.args])

    def _migrate_into(self, target: ast.expr, value: Any, names: dict[str, Any]) -> None:
        path = _attributes(target)
        if len(path) > 1:
            self._assign(target, value, names)
            return
        into = names.get(path[0])
        if not isinstance(into, Message) or not isinstance(value, Message):
            raise self._error(target, "self.migrate requires two messages")
        for field in into.__slots__:
            self._set_field(into, field, field_of(value, field))

    def _assign(self, target: ast.expr, value: Any, names: dict[str, Any]) -> None:
        path = _attributes(target)
        if len(path) == 1:
            names[path[0]] = value
            return
        owner = names.get(path[0])
        for name in path[1:-1]:
            owner = field_of(owner, name)
        if not isinstance(owner, Message) or path[-1] not in owner.__slots__:
            kind = getattr(owner, "_type", type(owner).__name__)
            raise self._error(target, f"{kind} does not have a field [{path[-1]}]")
        self._set_field(owner, path[-1], value)

    def _value(self, node: ast.expr, names: Mapping[str, Any]) -> Any:
        if isinstance(node, ast.Dict) and node.values and all(map(_of_self, node.values)):
            keys = (self._value(key, names) for key in node.keys if key is not None)
            return dict(zip(keys, map(_of_self, node.values), strict=True))
        if isinstance(node, ast.List) and any(map(_made_class, node.elts)):
            return [self._value(each, names) for each in node.elts]
        maker = _made_class(node)
        if maker is not None and isinstance(node, ast.Call) and isinstance(node.func, ast.Call):
            cls = self._find_class(maker[4:7], self._value(node.func.args[0], names))
            if cls is None:
                raise self._error(node, "the rule's definitions do not contain this type")
            made = cls()
            for field, value in self._arguments(node, cls, names):
                self._set_field(made, field, value)
            return made
        if node not in self._expressions:
            self._expressions[node] = Expression(ast.unparse(node), fields=field_of)
        return self._expressions[node].value(names)

    def _arguments(
        self, call: ast.Call, cls: type[Message], names: Mapping[str, Any]
    ) -> Iterator[tuple[str, Any]]:
        if call.args and len(call.args) != len(cls.__slots__):
            raise self._error(call, f"{cls._type} has {len(cls.__slots__)} fields, got {len(call.args)}")
        yield from zip(cls.__slots__, (self._value(each, names) for each in call.args), strict=False)
        for keyword in call.keywords:
            if keyword.arg not in cls.__slots__:
                raise self._error(call, f"{cls._type} does not have a field [{keyword.arg}]")
            yield keyword.arg, self._value(keyword.value, names)

    def _error(self, node: ast.AST, reason: str) -> BagError:
        return BagError(f"rule {self._rule}, line {getattr(node, 'lineno', 0)}: {reason}")


def _made_class(node: ast.expr) -> str | None:
    """Return the name of the called method, such as `get_new_class`, for `self.get_new_class(NAME)(…)`.

    Return None for any other expression.
    """
    if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Call) or len(node.func.args) != 1:
        return None
    name = _of_self(node.func.func)
    return name if name in _CLASS_MAKERS else None
