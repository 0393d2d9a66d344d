"""What is known about the values in a node: names of modules, types of messages, and kinds of variables.

Kinds are short texts: `float`, `int`, `str`, `bool`, `time`, `duration` (of rospy), `stamp` (the field of a
message), `msg:std_msgs/String`, `req:` and `res:` of a service, `pub:`, `sub:`, `proxy:`, `timer:`.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from typing import Final

from pipros.basics.errors import PiprosError
from pipros.msg.language.spec import FLOATS, INTEGERS, FieldType, MessageSpec, ServiceSpec
from pipros.ros2.interfaces.catalog import Ros1Definitions
from pipros.ros2.port.rules import CALLS

_PARTS: Final = {"Request": "req", "Response": "res"}
_MADE: Final = {
    "rospy.Publisher": "pub",
    "rospy.Subscriber": "sub",
    "rospy.ServiceProxy": "proxy",
    "rospy.Service": "service",
    "rospy.Timer": "timer",
}
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
        assignments = [each for each in ast.walk(tree) if isinstance(each, ast.Assign)]
        for _ in range(2):  # a variable may get the value of another one
            for assignment in assignments:
                for target in assignment.targets:
                    self._variables.setdefault(self._key(target), set()).add(self.of(assignment.value))

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
        known = self._variables.get(self._key(node), set()) - {""}
        return next(iter(known)) if len(known) == 1 else ""

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
        if isinstance(node.func, ast.Attribute) and node.func.attr in _METHODS:
            return _METHODS[node.func.attr]
        return CALLS[name].kind if name in CALLS else "float" if name.startswith(_FLOAT_MODULES) else ""

    @staticmethod
    def _of_operation(left: str, operator: ast.operator, right: str) -> str:
        times = ("time", "stamp", "duration")
        if left == "str" and isinstance(operator, (ast.Mod, ast.Add)):
            return "str"
        if left in times and right in times:
            return "duration" if isinstance(operator, ast.Sub) and left != "duration" else "time"
        if "float" in (left, right) or isinstance(operator, ast.Div):
            return "float"
        return "int" if left == right == "int" else ""

    def _key(self, node: ast.AST) -> str:
        if isinstance(node, ast.Name):
            local = f"{self._scopes.get(node, '')}:{node.id}"
            return local if local in self._variables or isinstance(node.ctx, ast.Store) else f":{node.id}"
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
        kind = self.interface(
            self.full_name(arguments.get("data_class") or arguments.get("service_class") or call)
        )
        handler = arguments.get("callback") or arguments.get("handler")
        base = handler.attr if isinstance(handler, ast.Attribute) else getattr(handler, "id", "")
        function = self.functions.get(base)
        if name not in ("rospy.Subscriber", "rospy.Service") or kind is None or function is None:
            return
        names = [each.arg for each in function.args.args if each.arg != "self"]
        if names:
            prefix = "req" if name == "rospy.Service" else "msg"
            self._variables.setdefault(f"{base}:{names[0]}", set()).add(
                f"{prefix}:{kind[0].partition(':')[2]}"
            )

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
            if self.full_name(call.func) == "rospy.Service":
                handler = self.arguments(call).get("handler")
                base = handler.attr if isinstance(handler, ast.Attribute) else getattr(handler, "id", "")
                if base in self.functions:
                    yield self.functions[base], self.of(call).partition(":")[2]


def _of_field(kind: FieldType) -> str:
    if kind.base in ("time", "duration"):
        return "stamp" if kind.base == "time" else "span"
    if kind.base in FLOATS or kind.base in INTEGERS:
        return "float" if kind.base in FLOATS else "int"
    return {"string": "str", "bool": "bool"}.get(kind.base, f"msg:{kind.base}")
