"""What is known about the values in a node: names of modules, types of messages, and kinds of variables.

Kinds are short texts: `float`, `int`, `number` (of any type), `str`, `bool`, `time`, `duration` (of rospy),
`stamp` and `span` (fields of messages), `byte` and `array` (fields that ROS 2 has as `bytes` and arrays),
`event` (of a timer), `rate`, `msg:std_msgs/String`, `req:` and `res:` of a service, `pub:`, `sub:`, `proxy:`,
`timer:`. The elements of a list or dictionary `x` have the kinds of the variable `x[]`.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Final

from pipros.basics.errors import PiprosError
from pipros.msg.language.spec import FLOATS, INTEGERS, NUMBERS, FieldType, MessageSpec, ServiceSpec
from pipros_ros2.port.rules import CALLS
from pipros_rosbag2.interfaces.catalog import Ros1Definitions

_PARTS: Final = {"Request": "req", "Response": "res"}
_MADE: Final = {
    "rospy.Publisher": "pub",
    "rospy.Subscriber": "sub",
    "rospy.ServiceProxy": "proxy",
    "rospy.Service": "service",
    "rospy.Timer": "timer",
}
TIMES: Final = frozenset({"time", "stamp", "duration", "span"})
_METHODS: Final = {"to_sec": "float", "format": "str", "upper": "str", "lower": "str", "join": "str"}
_FLOAT_MODULES: Final = ("math.", "random.uniform", "random.random", "random.gauss", "time.time", "float")


class Kinds:
    """The names and variables of a file. A variable with values of several kinds has none."""

    def __init__(self, tree: ast.Module, definitions: Ros1Definitions) -> None:
        self._definitions = definitions
        self.modules: dict[str, str] = {}
        self._stars: list[str] = []
        self._variables: dict[str, set[str]] = {}
        self._scopes: dict[ast.AST, str] = {}
        self.functions = {each.name: each for each in ast.walk(tree) if isinstance(each, ast.FunctionDef)}
        for each in ast.walk(tree):
            self._import(each)
        for scope in self.functions.values():
            for inner in ast.walk(scope):
                self._scopes[inner] = scope.name
        self._calls = [each for each in ast.walk(tree) if isinstance(each, ast.Call)]
        for call in self._calls:
            self._callback(call)
        for _ in range(2):  # a variable may get the value of another one
            for function in self.functions.values():
                self._returns(function)
            for each in ast.walk(tree):
                self._bind(each)

    def _add(self, key: str, kind: str) -> None:
        if key:
            self._variables.setdefault(key, set()).add(kind)

    def _returns(self, function: ast.FunctionDef) -> None:
        for each in ast.walk(function):
            if isinstance(each, ast.Return) and each.value is not None:
                self._add(f"{function.name}()", self.of(each.value))

    def _bind(self, node: ast.AST) -> None:
        """Remember the kinds of the variables that get their values here."""
        if isinstance(node, ast.Assign):
            for target in node.targets:
                self._assign(target, node.value)
        elif isinstance(node, ast.ClassDef):
            for each in node.body:
                if isinstance(each, ast.Assign) and isinstance(each.targets[0], ast.Name):
                    self._add(f"self.{each.targets[0].id}", self.of(each.value))
        elif isinstance(node, (ast.For, ast.comprehension)):
            self._loop(node.target, node.iter)
        elif isinstance(node, ast.Call):
            self._pass(node)

    def _assign(self, target: ast.expr, value: ast.expr) -> None:
        key, items = self._key(target), _elements(value)
        self._add(key, self.of(value))
        for each in items:
            self._add(f"{key}[]" if key else "", self.of(each))
        if isinstance(target, (ast.Tuple, ast.List)) and len(items) == len(target.elts):
            for inner, each in zip(target.elts, items, strict=True):
                self._assign(inner, each)

    def _loop(self, target: ast.expr, values: ast.expr) -> None:
        match target, values:
            case (
                ast.Tuple([_, value]),
                ast.Call(ast.Attribute(owner, "items")) | ast.Call(ast.Name("enumerate"), [owner, *_]),
            ):
                self._add(self._key(value), self.of_element(owner))
            case _:
                self._add(self._key(target), self.of_element(values))

    def _pass(self, call: ast.Call) -> None:
        """Remember the kinds of arguments: of functions of this file, and of what lists and sets get."""
        if (
            isinstance(call.func, ast.Attribute)
            and call.func.attr in ("append", "add", "insert")
            and call.args
        ):
            key = self._key(call.func.value)
            self._add(f"{key}[]" if key else "", self.of(call.args[-1]))
        elif self._own_function(call):
            for parameter, value in zip(self.parameters(call.func) or (), call.args, strict=False):
                self._add(parameter, self.of(value))

    def _own_function(self, call: ast.Call) -> str:
        """Return the name of the function of this file that is called; empty if it is another one."""
        name = self.full_name(call.func).removeprefix("self.")
        return name if name in self.functions else ""

    def full_name(self, node: ast.AST) -> str:
        """Return the dotted name of an expression, with the names of imports; empty if it has none."""
        if isinstance(node, ast.Attribute):
            outer = self.full_name(node.value)
            return f"{outer}.{node.attr}" if outer else ""
        if not isinstance(node, ast.Name):
            return ""
        if node.id in self.modules:
            return self.modules[node.id]
        for module in self._stars:
            found = self.interface(f"{module}.{node.id}")
            if found is not None and self._is_known(found[0]):
                return f"{module}.{node.id}"
        return node.id

    def interface(self, name: str) -> tuple[str, MessageSpec | None] | None:
        """Return the kind of an interface's class and its definition, which may be unknown."""
        package, _, rest = name.partition(".")
        middle, _, base = rest.partition(".")
        if middle == "msg" and base:
            return f"msg:{package}/{base}", self._message(f"{package}/{base}")
        if middle != "srv" or not base:
            return None
        for suffix, kind in _PARTS.items():
            if base.endswith(suffix):
                service = self._service(f"{package}/{base.removesuffix(suffix)}")
                part = None if service is None else getattr(service, suffix.lower())
                return f"{kind}:{package}/{base.removesuffix(suffix)}", part
        return f"srv:{package}/{base}", None

    def is_of_action(self, name: str) -> bool:
        """Return whether a name is that of a message which catkin makes of an action."""
        kind, _ = self.interface(name) or ("", None)
        base = re.sub("(Action)?(Action|Goal|Result|Feedback)$", "", kind.removeprefix("msg:"))
        return kind.startswith("msg:") and self._is_known(f"msg:{base}ActionGoal")

    def _is_known(self, kind: str) -> bool:
        prefix, _, name = kind.partition(":")
        return (self._message(name) if prefix == "msg" else self._service(name)) is not None

    def spec(self, kind: str) -> MessageSpec | None:
        """Return the definition of a kind `msg:`, `req:` or `res:`."""
        prefix, _, name = kind.partition(":")
        if prefix == "msg":
            return self._message(name)
        service = self._service(name) if prefix in ("req", "res") else None
        return None if service is None else service.request if prefix == "req" else service.response

    def _message(self, name: str) -> MessageSpec | None:
        try:
            return self._definitions.message(name)
        except PiprosError:
            return None

    def _service(self, name: str) -> ServiceSpec | None:
        try:
            return self._definitions.service(name)
        except PiprosError:
            return None

    def field(self, target: ast.Attribute) -> FieldType | None:
        """Return the type of the field that an attribute is, or None if it is unknown."""
        spec = self.spec(self.of(target.value))
        return next((each.type for each in spec.fields if each.name == target.attr), None) if spec else None

    def of(self, node: ast.AST) -> str:
        """Return the kind of an expression; empty if it is unknown."""
        match node:
            case ast.Constant(value):
                return type(value).__name__
            case ast.JoinedStr():
                return "str"
            case ast.Compare() | ast.UnaryOp(ast.Not()):
                return "bool"
            case ast.IfExp(_, body, other):
                return _single([self.of(body), self.of(other)])
            case ast.UnaryOp(_, operand):
                return self.of(operand)
            case ast.BinOp(left, operator, right):
                return self._of_operation(self.of(left), operator, self.of(right))
            case ast.Call():
                return self._of_call(node)
            case ast.Attribute():
                found = self.field(node)
                if found is not None and not found.is_array:
                    return _of_field(found)
                if node.attr == "stamp" and getattr(node.value, "attr", "") == "header":
                    return "stamp"
                if found is not None and found.base in NUMBERS:
                    return "array"
            case ast.Subscript(owner, index) if not isinstance(index, ast.Slice):
                return self.of_element(owner)
        return self._of_name(self._key(node))

    def of_element(self, node: ast.AST) -> str:
        """Return the kind of the elements of an expression; empty if it is unknown."""
        match node:
            case ast.Attribute() if (found := self.field(node)) is not None and found.is_array:
                return _of_field(found)
            case ast.Call(ast.Attribute(owner, "values"), []):
                return self.of_element(owner)
            case ast.Call(ast.Name("list" | "reversed" | "set" | "sorted" | "tuple"), [owner, *_]):
                return self.of_element(owner)
        key = self._key(node)
        return _single(map(self.of, _elements(node))) or (self._of_name(f"{key}[]") if key else "")

    def _of_name(self, name: str) -> str:
        return _single(self._variables.get(name, ()))

    def all(self, node: ast.AST) -> set[str]:
        """Return the kinds of an expression, or of all values of a variable."""
        return {self.of(node), *self._variables.get(self._key(node), ())}

    def may_be(self, node: ast.AST, *kinds: str) -> bool:
        """Return whether an expression, or one of the values of a variable, has one of the kinds."""
        return not self.all(node).isdisjoint(kinds)

    def _of_call(self, node: ast.Call) -> str:
        name = self.full_name(node.func)
        interface = self.interface(name)
        if interface is not None:
            return interface[0]
        if name in _MADE:
            argument = next(
                (each.value for each in node.keywords if each.arg in ("data_class", "service_class")), None
            )
            argument = argument or (node.args[1] if len(node.args) > 1 else None)
            made = self.interface(self.full_name(argument)) if argument is not None else None
            return f"{_MADE[name]}:{made[0].partition(':')[2] if made else ''}"
        if name == "rospy.wait_for_message" and len(node.args) > 1:
            made = self.interface(self.full_name(node.args[1]))
            return made[0] if made else ""
        called = self.of(node.func)
        if called.startswith("proxy:"):
            return f"res:{called.partition(':')[2]}"
        if name in ("str", "int", "len", "bool", "round"):
            return {"len": "int", "round": "int"}.get(name, name)
        if own := self._own_function(node):
            return self._of_name(f"{own}()")
        if name in ("max", "min"):
            return self.of_element(node.args[0]) if len(node.args) == 1 else _single(map(self.of, node.args))
        if isinstance(node.func, ast.Attribute) and node.func.attr in ("get", "pop", "popleft"):
            return self.of_element(node.func.value)
        if isinstance(node.func, ast.Attribute) and node.func.attr in _METHODS:
            return _METHODS[node.func.attr]
        return CALLS[name].kind if name in CALLS else "float" if name.startswith(_FLOAT_MODULES) else ""

    @staticmethod
    def _of_operation(left: str, operator: ast.operator, right: str) -> str:
        times = TIMES
        if left == "str" and isinstance(operator, (ast.Mod, ast.Add)):
            return "str"
        if left in times and right in times:
            moments = sum(each in ("time", "stamp") for each in (left, right))
            return "time" if moments == 1 else "duration"
        if {left, right} <= {"float", "int"}:  # others may be those of numpy, which rclpy does not take
            return "float" if "float" in (left, right) or isinstance(operator, ast.Div) else "int"
        is_number = isinstance(operator, (ast.Div, ast.FloorDiv, ast.Sub, ast.Pow))
        return "number" if is_number or {"float", "number"} & {left, right} else ""

    def _key(self, node: ast.AST) -> str:
        if isinstance(node, ast.Name):
            local = f"{self._scopes.get(node, '')}:{node.id}"
            return local if local in self._variables or isinstance(node.ctx, ast.Store) else f":{node.id}"
        if isinstance(node, ast.Subscript):
            owner = "" if isinstance(node.slice, ast.Slice) else self._key(node.value)
            return f"{owner}[]" if owner else ""
        return ast.unparse(node) if isinstance(node, ast.Attribute) else ""

    def _import(self, node: ast.AST) -> None:
        if isinstance(node, ast.Import):
            for each in node.names:
                self.modules[each.asname or each.name.partition(".")[0]] = (
                    each.name if each.asname else each.name.partition(".")[0]
                )
        elif isinstance(node, ast.ImportFrom) and node.module:
            for each in node.names:
                if each.name == "*":
                    self._stars.append(node.module)
                else:
                    self.modules[each.asname or each.name] = f"{node.module}.{each.name}"

    def _callback(self, call: ast.Call) -> None:
        """Remember the kind of the first argument of a callback."""
        name, arguments = self.full_name(call.func), self.arguments(call)
        if name == "rospy.Timer":
            for parameter in (self.parameters(arguments.get("callback")) or ())[:1]:
                self._add(parameter, "event")
            return
        kind = self.interface(
            self.full_name(arguments.get("data_class") or arguments.get("service_class") or call)
        )
        parameters = self.parameters(arguments.get("callback") or arguments.get("handler"))
        if name in ("rospy.Subscriber", "rospy.Service") and kind is not None and parameters:
            prefix = "req" if name == "rospy.Service" else "msg"
            self._add(parameters[0], f"{prefix}:{kind[0].partition(':')[2]}")

    def parameters(self, callback: ast.expr | None) -> list[str] | None:
        """Return the variables that are the parameters of a callback, or None if it is not in this file."""
        if isinstance(callback, ast.Lambda):
            return [f"{self._scopes.get(callback, '')}:{each}" for each in _names(callback)]
        base = self.own(callback)
        return [f"{base}:{each}" for each in _names(self.functions[base])] if base else None

    def arguments(self, call: ast.Call) -> dict[str, ast.expr]:
        """Return the arguments of a call that has a rule, by the names of the parameters."""
        rule = CALLS.get(self.full_name(call.func))
        return {
            **dict(zip(rule.defaults if rule else (), call.args, strict=False)),
            **{each.arg: each.value for each in call.keywords if each.arg},
        }

    def handlers(self) -> Iterator[tuple[ast.FunctionDef, str]]:
        """Yield each function that answers requests, with the name of its service."""
        for call in self._calls:
            base = self.own(self.arguments(call).get("handler"))
            if base and self.full_name(call.func) == "rospy.Service":
                yield self.functions[base], self.of(call).partition(":")[2]

    def own(self, function: ast.expr | None) -> str:
        """Return the name of a function or method of this file; empty for other expressions."""
        base = function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")
        return base if base in self.functions else ""


def _names(function: ast.FunctionDef | ast.Lambda) -> list[str]:
    return [each.arg for each in function.args.args if each.arg != "self"]


def _single(kinds: Iterable[str]) -> str:
    """Return the only kind of values, of which some may be None or unknown; empty if there are several."""
    known = {*kinds} - {"", "NoneType"}
    return known.pop() if len(known) == 1 else ""


def _elements(node: ast.AST) -> Sequence[ast.expr]:
    """Return the elements of a list, or the values of a dictionary, as far as they are written there."""
    match node:
        case ast.List(items) | ast.Tuple(items) | ast.Set(items) | ast.Dict(_, items):
            return items
        case ast.ListComp(item) | ast.SetComp(item) | ast.GeneratorExp(item) | ast.DictComp(_, item):
            return [item]
    return ()


def _of_field(kind: FieldType) -> str:
    if kind.base == "byte":
        return "byte"
    if kind.base in ("time", "duration"):
        return "stamp" if kind.base == "time" else "span"
    if kind.base in FLOATS or kind.base in INTEGERS:
        return "float" if kind.base in FLOATS else "int"
    return {"string": "str", "bool": "bool"}.get(kind.base, f"msg:{kind.base}")
