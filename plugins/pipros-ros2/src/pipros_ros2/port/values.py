"""Values as rclpy requires them: named fields, no integers for floats, messages for times."""

from __future__ import annotations

import ast
import re
from collections.abc import Sequence

from pipros.msg.language.spec import FLOATS, OCTETS, MessageSpec
from pipros_ros2.port.rules import FIELDS
from pipros_ros2.port.source import PortedText
from pipros_rosbag2.interfaces.derive import member_name


class PortedValues(PortedText):
    """Text of values; see `PortedText`."""

    def _message(self, node: ast.Call, kind: str) -> str | None:
        """Return a constructor with names for all arguments, or None if it stays as it is."""
        if self._kinds.spec(kind) is None and not node.args:
            return None
        new = self._made(node, kind, self.text(node.func))
        if new is not None and (node.args or new != self._original(node)):
            self._change(node, new)
        return new

    def _made(self, node: ast.Call, kind: str, name: str) -> str | None:
        """Return a message that is made of the arguments of a call, or None after a TODO."""
        spec, shown = self._kinds.spec(kind), kind.partition(":")[2] or "the message's type"
        is_spread = any(isinstance(each, ast.Starred) for each in node.args)
        if spec is None:
            self._todo(node, f"{shown} is not installed: create it here, with names for its fields")
        elif is_spread or len(node.args) > len(spec.fields) or any(not each.arg for each in node.keywords):
            self._todo(node, f"the arguments of {shown} need names")
        else:
            return f"{name}({self._fields(spec, node.args, node.keywords)})"
        return None

    def _fields(
        self, spec: MessageSpec, values: Sequence[ast.expr], named: Sequence[ast.keyword] = ()
    ) -> str:
        """Return the arguments of a constructor, with names, and with numbers of the right type."""
        types = {each.name: each.type for each in spec.fields}
        pairs = [*zip(types, values, strict=False), *((each.arg or "", each.value) for each in named)]
        words = (
            f"{member_name(key)}={self._coerced(types.get(key), value)}"
            for key, value in pairs
            if key != "seq"
        )
        return ", ".join(words)

    def _class_text(self, kind: str) -> str:
        prefix, _, name = kind.partition(":")
        package, _, base = name.partition("/")
        middle = "msg" if prefix == "msg" else "srv"
        full = f"{package}.{middle}.{base}"
        known = next((alias for alias, target in self._kinds.modules.items() if target == full), None)
        suffix = {"req": ".Request", "res": ".Response"}.get(prefix, "")
        return f"{known or (base if package not in self._kinds.modules else full)}{suffix}"

    def _part_class(self, node: ast.expr, kind: str) -> str:
        suffix = "Request" if kind.startswith("req") else "Response"
        return f"{self._original(node).removesuffix(suffix)}.{suffix}"

    def _as_time(self, node: ast.expr) -> str:
        """Return a time or duration as one of rclpy."""
        text = self.text(node)
        new = {"stamp": "Time", "span": "Duration"}.get(self._kinds.of(node))
        if new is None:
            return text
        self._needs.add(new)
        return f"{new}.from_msg({text})"

    def _fitting(self, target: ast.Attribute, value: ast.expr) -> str:
        return self._coerced(self._kinds.field(target), value, target.attr)

    def _coerced(self, kind: object, value: ast.expr, name: str = "") -> str:
        """Return a value as rclpy requires it, for an attribute of this name if its type is unknown."""
        text, known = self.text(value), self._kinds.of(value)
        base, is_array = getattr(kind, "base", ""), getattr(kind, "is_array", False)
        if base in ("time", "duration") or (name == "stamp" and not base):
            if known in ("time", "duration"):
                return f"({text}).to_msg()" if isinstance(value, ast.BinOp) else f"{text}.to_msg()"
            if known not in ("stamp", "span"):
                self._todo(value, "a time in a message is a builtin_interfaces.msg.Time: to_msg() returns it")
        elif base == "byte" and not isinstance(value, ast.Attribute):  # such as DiagnosticStatus.OK
            self._todo(value, FIELDS["byte"])
        elif base == "bool" and not is_array and known != "bool":
            return f"bool({text})"
        elif base in OCTETS and is_array and known == "str":
            return f"{text}.encode()" if isinstance(value, ast.Constant) else f"({text}).encode()"
        elif base in FLOATS and not is_array and known != "float":
            return f"{text}.0" if re.fullmatch(r"-?\d+", text) else f"float({text})"
        elif base in FLOATS and is_array and not _has_floats(value):
            return f"[float(each) for each in {text}]"
        elif not base and name in ("w", "x", "y", "z") and known == "int":
            self._todo(value, "this must be a float if it is a field of a message")
        return text

    def _answer(self, node: ast.Return, service: str) -> str | None:
        """Return the statement of a handler, which rclpy requires to return a response."""
        if node.value is not None and self._kinds.of(node.value) == f"res:{service}":
            return None
        new = self._response(node, node.value, service)
        if new is not None:
            self._change(node, f"return {new}")
        return None if new is None else f"return {new}"

    def _response(self, node: ast.AST, value: ast.expr | None, service: str) -> str | None:
        """Return the response that is made of what a handler returns, or None after a TODO."""
        kind = f"res:{service}"
        spec, named = self._kinds.spec(kind), None if value is None else _keywords(value)
        values: list[ast.expr] = (
            [] if value is None else value.elts if isinstance(value, (ast.List, ast.Tuple)) else [value]
        )
        if spec is None or (named is None and len(values) not in (0, len(spec.fields))):
            self._todo(node, f"rclpy requires a response of {service or 'the service'} here")
            return None
        fields = self._fields(spec, values) if named is None else self._fields(spec, (), named)
        return f"{self._class_text(kind)}({fields})"


def _keywords(value: ast.expr) -> list[ast.keyword] | None:
    """Return the items of a dictionary whose keys are texts, or None for another value."""
    if isinstance(value, ast.Call) and getattr(value.func, "id", "") == "dict" and not value.args:
        return value.keywords
    if not isinstance(value, ast.Dict):
        return None
    keys = [each.value if isinstance(each, ast.Constant) else None for each in value.keys]
    if not all(isinstance(each, str) for each in keys):
        return None
    return [ast.keyword(str(key), each) for key, each in zip(keys, value.values, strict=True)]


def _has_floats(value: ast.expr) -> bool:
    items = value.elts if isinstance(value, (ast.List, ast.Tuple)) else None
    return items is not None and all(
        isinstance(each, ast.Constant) and isinstance(each.value, float) for each in items
    )
