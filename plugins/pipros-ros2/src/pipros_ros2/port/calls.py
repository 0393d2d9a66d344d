"""Text of expressions: calls of rospy, methods of what it returns, and names."""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from typing import Any, Final

from pipros_ros2.port.kinds import TIMES
from pipros_ros2.port.rules import (
    CALLS,
    EXACT,
    EXCEPTIONS,
    FIELDS,
    KEPT,
    LATE,
    LOGGING,
    METHODS,
    NODE,
    unsure,
)
from pipros_ros2.port.values import PortedValues
from pipros_rosbag2.interfaces.derive import member_name

_LOG: Final = re.compile(r"rospy\.log(debug|info|warn|err|fatal)(_throttle|_once|_throttle_identical)?")
_TIMES: Final = {"secs": "sec", "nsecs": "nanosec"}
_OF_ROS1: Final = (
    *("_buff", "_connection_header", "_full_text", "_has_header", "_md5sum", "_slot_types", "_type"),
    *("__slots__", "serialize", "deserialize", "serialize_numpy", "deserialize_numpy"),
)

_MOMENTS: Final = {"time": "time", "stamp": "time", "duration": "duration", "span": "duration"}
_SUMS: Final = (
    ("time", "time", ast.Sub),
    ("time", "duration", ast.Sub),
    ("time", "duration", ast.Add),
    ("duration", "time", ast.Add),
)
"""What rclpy's times can be added to and subtracted from."""


class PortedCalls(PortedValues):
    """Text of expressions; see `PortedText`."""

    _values: Mapping[str, Any]

    def _replaced(self, node: ast.expr) -> str | None:
        if (
            isinstance(node, ast.UnaryOp)
            and isinstance(node.op, ast.Not)
            and self._called(node.operand) == "rospy.is_shutdown"
        ):
            self._change(node, "rclpy.ok()")
            return "rclpy.ok()"
        if isinstance(node, ast.Call):
            return self._call(node)
        if isinstance(node, (ast.BinOp, ast.Compare)):
            self._with_fields(node)
            return self._with_times(node)
        for condition in _conditions(node):
            self._truth(condition)
        if isinstance(node, ast.Attribute):
            return self._attribute(node)
        if isinstance(node, ast.Name):
            return self._named(node)
        return None

    def _truth(self, condition: ast.expr) -> None:
        """Add a TODO for a time of which only the truth counts, unless it may be None."""
        if self._kinds.may_be(condition, *TIMES) and not self._kinds.may_be(condition, "NoneType"):
            self._todo(condition, "a time of rclpy is true even if it is zero: compare its nanoseconds")

    def _with_fields(self, node: ast.BinOp | ast.Compare) -> None:
        """Add a TODO for an operation with a field that has another type in ROS 2."""
        if isinstance(node, ast.Compare) and isinstance(node.ops[0], (ast.In, ast.NotIn, ast.Is, ast.IsNot)):
            return
        for kind in {self._kinds.of(each) for each in _sides(node)} & {*FIELDS}:
            self._todo(node, FIELDS[kind])

    def _with_times(self, node: ast.BinOp | ast.Compare) -> str | None:
        """Return the text of an operation with times, or None for another one."""
        sides = _sides(node)
        kinds = [_MOMENTS.get(self._kinds.of(each), "") for each in sides]
        if not any(self._kinds.may_be(each, *TIMES) for each in sides):
            return None
        operators = [node.op] if isinstance(node, ast.BinOp) else node.ops
        if all(isinstance(each, (ast.Is, ast.IsNot, ast.In, ast.NotIn)) for each in operators):
            return None
        if isinstance(node, ast.BinOp) and kinds[0] == "" and self._kinds.of(node.left) == "str":
            return None
        is_sum = isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub))
        if isinstance(node, ast.BinOp) and (
            not is_sum or (all(kinds) and (*kinds, type(node.op)) not in _SUMS)
        ):
            self._todo(node, "rclpy's Time and Duration lack this operation: use their nanoseconds")
        elif not all(kinds):
            self._todo(node, "both sides must be a Time or Duration of rclpy: Time.from_msg converts a stamp")
        elif not is_sum and len(set(kinds)) > 1:
            self._todo(node, "rclpy compares no times with durations")
        if all(self._kinds.of(each) not in ("stamp", "span") for each in sides):
            return None
        parts, at = [], self._span(node)[0]
        for each in sides:
            first, last = self._span(each)
            parts += [self._source[at:first].decode(), self._as_time(each)]
            at = last
        return "".join([*parts, self._source[at : self._span(node)[1]].decode()])

    def _attribute(self, node: ast.Attribute) -> str | None:
        name = self._kinds.full_name(node)
        owners = {each.partition(":")[0] for each in self._kinds.all(node.value)}
        if any(node.attr not in KEPT.get(owner, (node.attr,)) for owner in owners):
            self._todo(node, f"rclpy's counterpart may have no {node.attr}")
            return None
        if name in EXCEPTIONS:
            return self._named(node)
        if node.attr in _TIMES and self._kinds.of(node.value) in ("stamp", "span"):
            self._change(node, _TIMES[node.attr])
            return f"{self.text(node.value)}.{_TIMES[node.attr]}"
        if node.attr in _OF_ROS1:
            self._todo(node, f"messages of ROS 2 have no {node.attr}")
            return None
        if node.attr == "seq" and self._is_header(node.value):
            self._todo(node, "std_msgs/Header has no seq in ROS 2")
            return None
        new = member_name(node.attr)
        if new != node.attr and self._kinds.field(node) is not None:
            self._change(node, new)
            return f"{self.text(node.value)}.{new}"
        return self._named(node) if name and self._root_is_module(node) else None

    def _named(self, node: ast.expr) -> str | None:
        """Return the text of an exception, the class of a part of a service, or an unknown name of rospy."""
        name = self._kinds.full_name(node)
        if self._kinds.may_be(node, "event"):
            self._todo(node, "rclpy's timers pass no event to their callback: this is None")
            return None
        if name in EXCEPTIONS:
            new, need, doubt = EXCEPTIONS[name]
            self._needs |= {need} - {""}
            if doubt:
                self._todo(node, doubt)
            else:
                self._change(node, new)
            return new
        found = self._kinds.interface(name)
        if found is not None and found[0][:4] in ("req:", "res:"):
            return self._part_class(node, found[0])
        if (reason := unsure(name)) is not None:
            self._todo(node, reason)
        return None

    def _call(self, node: ast.Call) -> str | None:
        name = self._kinds.full_name(node.func)
        log = _LOG.fullmatch(name)
        if log:
            return self._log(node, LOGGING[log[1]], log[2] or "")
        if name in ("rospy.get_param", "rospy.set_param", "rospy.has_param"):
            return self._parameter(node, CALLS[name].template)
        if name in CALLS:
            return self._by_rule(node, name)
        interface = self._kinds.interface(name)
        if interface is not None and interface[0][:4] in ("msg:", "req:", "res:"):
            return self._message(node, interface[0])
        if name in ("rospy.Header", "genpy.Time", "genpy.Duration"):
            self._todo(node, "import it from std_msgs.msg or builtin_interfaces.msg")
            return None
        if name in ("max", "min", "sorted") and any(
            self._kinds.of(each) in ("stamp", "span") or self._kinds.of_element(each) in ("stamp", "span")
            for each in node.args
        ):
            self._todo(node, "times of messages have no order in ROS 2: Time.from_msg converts them")
        if name == "setattr" and node.args and self._kinds.of(node.args[0]).startswith("msg:"):
            self._todo(node, EXACT)
        kind = self._kinds.of(node.func)
        if kind.startswith("proxy:"):
            return self._service_call(node, self.text(node.func), kind)
        if any(each.startswith("proxy:") for each in self._kinds.all(node.func)):
            self._todo(node, "clients of rclpy have the method call, which takes a request")
        return self._method(node)

    def _by_rule(self, node: ast.Call, name: str) -> str:
        rule, given = CALLS[name], self._kinds.arguments(node)
        texts = {key: self.text(value) for key, value in given.items() if not rule.has_no_counterpart(key)}
        for key in ("name", "topic", "service"):
            value = given.get(key)
            if isinstance(value, ast.Constant) and re.match(r"~[^/]", str(value.value)):
                texts[key] = repr(f"~/{str(value.value)[1:]}")
        if name in ("rospy.Publisher", "rospy.Subscriber"):
            self._topic(given, texts)
        if name in ("rospy.sleep", "rospy.Timer"):
            self._period(given, texts, is_timer=name == "rospy.Timer")
        if name == "rospy.Service":
            texts["handler"] = self._handler(given.get("handler"), self._kinds.of(node).partition(":")[2])
        template, callback = rule.template, given.get("callback") or given.get("handler")
        if callback is not None and not self._kinds.own(callback):  # it may be another one later
            for old, new in LATE.items():
                template = template.replace(old, new)
        used = re.findall(r"\{(\w+)\}", template)
        for key in [key for key in texts if key not in used]:
            self._todo(node, f"{name}: the argument {key} has no counterpart")
        texts = {**rule.defaults, **texts}
        if len(node.args) > len(rule.defaults) or not all(texts[key] for key in used):
            self._todo(node, f"{name}: the arguments are not understood")
            return self._original(node)
        self._needs |= set(rule.needs.split())
        new = template.format(**texts).replace(", nanoseconds=0", "")
        self._change(node, new)
        if rule.reason:
            self._todo(node, f"{name}: {rule.reason}")
        return new

    def _topic(self, given: dict[str, ast.expr], texts: dict[str, str]) -> None:
        latch, size = given.pop("latch", None), given.get("queue_size")
        texts.pop("latch", None)
        if isinstance(latch, ast.Constant) and latch.value:
            self._needs.add("latched")
            texts["queue_size"] = "QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)"
        elif latch is not None and not isinstance(latch, ast.Constant):
            self._todo(latch, "a latched publisher has the QoS durability TRANSIENT_LOCAL")
        if isinstance(size, ast.Constant) and not size.value and "QoS" not in texts["queue_size"]:
            texts["queue_size"] = "10"
        if "callback_args" in texts and "callback" in texts:
            arguments = texts.pop("callback_args")
            texts["callback"] = f"lambda message, args={arguments}: ({texts['callback']})(message, args)"

    def _handler(self, handler: ast.expr | None, service: str) -> str:
        """Return the text of a function that must return a response."""
        if isinstance(handler, ast.Lambda):
            body, response = handler.body, None
            if self._kinds.of(body) != f"res:{service}":
                response = self._response(handler, body, service)
            before = self._source[self._span(handler)[0] : self._span(body)[0]].decode()
            return f"{before}{response or self.text(body)}"
        if handler is not None and not self._kinds.own(handler):
            self._todo(handler, f"rclpy requires that this returns a response of {service or 'the service'}")
        return self.text(handler) if handler is not None else ""

    def _period(self, given: dict[str, ast.expr], texts: dict[str, str], *, is_timer: bool) -> None:
        key = "period" if is_timer else "duration"
        value = given.get(key)
        if value is None:
            return
        is_duration = self._kinds.of(value) == "duration"
        if is_timer:
            is_plain = self._called(value) == "rospy.Duration" and re.fullmatch(r"[^,*]+", _inner(value))
            seconds = _inner(value) if is_plain else f"{texts[key]}.nanoseconds / 1e9"
            texts[key] = seconds if is_duration else texts[key]
            if self._kinds.parameters(given.get("callback")) is None:
                self._todo(value, "rclpy's timers pass no event to their callback: it gets None")
        elif not is_duration:
            self._needs.add("Duration")
            texts[key] = f"Duration(seconds={texts[key]})"

    def _log(self, node: ast.Call, method: str, suffix: str) -> str:
        arguments = list(node.args)
        period = self.text(arguments.pop(0)) if suffix.startswith("_throttle") and arguments else ""
        words = [self.text(each) for each in arguments]
        is_text = bool(arguments) and self._kinds.of(arguments[0]) == "str"
        text = words[0] if is_text else f"str({words[0] if words else repr('')})"
        for each in node.keywords:
            if each.arg != "msg":
                self._todo(node, f"the argument {each.arg} has no counterpart")
        if len(words) == 2 and "%(" in words[0]:
            text = f"{words[0]} % {words[1]}"
        elif len(words) > 1:
            text = f"{words[0]} % ({', '.join(words[1:])}{',' if len(words) == 2 else ''})"
        extra = f", throttle_duration_sec={period}" if period else ", once=True" if suffix == "_once" else ""
        new = f"{NODE}.get_logger().{method}({text}{extra})"
        self._change(node, new)
        return new

    def _parameter(self, node: ast.Call, function: str) -> str:
        given = [*node.args, *(each.value for each in node.keywords)]
        name, rest = next(iter(given), None), given[1:]
        if not isinstance(name, ast.Constant) or not isinstance(name.value, str):
            reason = "the name of a parameter must be a text here; ROS 2 writes camera.rate for ~camera/rate"
            self._todo(node, reason)
            return self._original(node)
        if not name.value.startswith("~"):
            reason = f"[{name.value}] was on the parameter server; in ROS 2, it belongs to this node alone"
            self._todo(node, reason)
        if (
            rest
            and isinstance(rest[0], (ast.Dict, ast.List, ast.Tuple))
            and (
                isinstance(rest[0], ast.Dict)
                or self._kinds.of_element(rest[0]) not in ("bool", "float", "int", "str")
            )
        ):
            reason = "a parameter of ROS 2 is a number, a text, or an array with elements of one type"
            self._todo(node, reason)
        key, words, source = name.value.lstrip("~/").replace("/", "."), [self.text(each) for each in rest], ""
        launched = name.value if name.value.startswith("/") else key
        if function == "get_param" and launched in self._values:
            words, source = [repr(self._values[launched])], " with the launch files' value"
        self._needs |= {function} & {"get_param", "set_param"}
        new = f"{function}({', '.join([repr(key), *words])})"
        declared = f", a parameter that the node declares{source}" if function in self._needs else ""
        self._change(node, f"{new}{declared}")
        return new

    def _service_call(self, node: ast.Call, client: str, kind: str) -> str:
        request = f"req:{kind.partition(':')[2]}"
        only = node.args[0] if len(node.args) == 1 and not node.keywords else None
        if only is not None and self._kinds.of(only) == request:
            words: str | None = self.text(only)
        else:
            words = self._made(node, request, self._class_text(request))
        if words is None:
            return self._original(node)
        new = f"{client}.call({words})"
        self._change(node, new)
        return new

    def _method(self, node: ast.Call) -> str | None:
        if not isinstance(node.func, ast.Attribute):
            return None
        owner, method = self._kinds.of(node.func.value), node.func.attr
        prefix, _, name = owner.partition(":")
        text = (
            self.text(node.func.value) if prefix in ("pub", "proxy", *METHODS) or method == "to_sec" else ""
        )
        if prefix == "pub" and method == "publish":
            return self._publish(node, text, name)
        if method == "publish" and method not in self._kinds.functions and not self._has_message(node):
            self._todo(node, "publish takes a message only")
            return None
        if prefix == "proxy" and method == "call":
            return self._service_call(node, text, owner)
        if method in METHODS.get(prefix, {}):
            new = f"{text}.{METHODS[prefix][method]}()"
            self._change(node, new)
            return new
        if method in ("to_sec", "to_nsec") and not node.args:
            known = self._kinds.of(node.func.value)
            if known not in TIMES:
                self._todo(node, f"{method} is nanoseconds of rclpy's Time and Duration, but not of messages")
                return None
            text = self._as_time(node.func.value)
            new = f"({text}).nanoseconds" if isinstance(node.func.value, ast.BinOp) else f"{text}.nanoseconds"
            new = f"({new} / 1e9)" if method == "to_sec" else new
            self._change(node, new)
            return new
        return None

    def _has_message(self, node: ast.Call) -> bool:
        """Return whether the only argument of a call is a message."""
        return not node.keywords and len(node.args) == 1 and self._kinds.of(node.args[0]).startswith("msg:")

    def _publish(self, node: ast.Call, publisher: str, name: str) -> str:
        kind = f"msg:{name}"
        only = node.args[0] if len(node.args) == 1 and not node.keywords else None
        known = self._kinds.of(only) if only is not None else ""
        if only is not None and known == kind:
            return f"{publisher}.publish({self.text(only)})"
        if only is not None and not known:
            self._todo(node, f"publish takes a message of {name or 'the type of the publisher'} only")
            return f"{publisher}.publish({self.text(only)})"
        made = self._made(node, kind, self._class_text(kind))
        if made is None:
            return self._render(node, *self._span(node))
        new = f"{publisher}.publish({made})"
        self._change(node, new)
        return new


def _sides(node: ast.BinOp | ast.Compare) -> list[ast.expr]:
    return [node.left, node.right] if isinstance(node, ast.BinOp) else [node.left, *node.comparators]


def _conditions(node: ast.expr) -> list[ast.expr]:
    """Return the parts of an expression of which only the truth counts."""
    if isinstance(node, ast.BoolOp):
        return node.values
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        return [node.operand]
    return [node.test] if isinstance(node, ast.IfExp) else []


def _inner(call: ast.expr) -> str:
    """Return the text of the arguments of a call."""
    return ", ".join(map(ast.unparse, call.args)) if isinstance(call, ast.Call) and not call.keywords else ","
