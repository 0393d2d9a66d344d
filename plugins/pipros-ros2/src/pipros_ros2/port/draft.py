"""Draft of a rospy node for rclpy: a list of changes, and the text with a TODO where a person must decide."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros_ros2.port.calls import PortedCalls
from pipros_ros2.port.rules import EXACT, HELPERS, IMPLIED, IMPORTS, NODE, NOT_ON_PYPI, unsure
from pipros_ros2.port.source import Change
from pipros_rosbag2.interfaces.catalog import Ros1Definitions

_IMPORTS: Final = "IMPORTS_OF_THE_DRAFT"
_START: Final = "START_OF_THE_DRAFT"
_GONE: Final = ("rospy", "roslib")


class NotPortable(PiprosError):
    """A file cannot be read as Python 3."""


@dataclass(frozen=True, slots=True)
class Draft:
    """The changes of a file, and its text after them. A file without rospy is unchanged."""

    changes: Sequence[Change]
    text: str


def draft_of(
    source: str, definitions: Ros1Definitions, file: str = "<node>", values: Mapping[str, Any] | None = None
) -> Draft:
    """Return the draft of a file.

    Args:
        values: those that launch files give to parameters, which become the defaults.

    Raises:
        NotPortable: the file is not valid Python 3, or is nested too deeply.
    """
    try:
        return _Porter(source, _parsed(source, file), definitions, values or {}).draft()
    except (RecursionError, MemoryError):  # the latter is that of CPython's parser
        raise NotPortable(f"{file}: nested too deeply") from None


def _parsed(source: str, file: str) -> ast.Module:
    try:
        return ast.parse(source)
    except (SyntaxError, ValueError) as error:
        line = getattr(error, "lineno", None) or 0
        raise NotPortable(f"{file}:{line}: not Python 3: {getattr(error, 'msg', error)}") from None


class _Porter(PortedCalls):
    def __init__(
        self, source: str, tree: ast.Module, definitions: Ros1Definitions, values: Mapping[str, Any]
    ) -> None:
        super().__init__(source, tree, definitions)
        self._values = values
        names = {each.id for each in ast.walk(tree) if isinstance(each, ast.Name)}
        names |= {each.arg for each in ast.walk(tree) if isinstance(each, ast.arg)}
        self._node = next(name for name in ("node", "ros_node", "rclpy_node") if name not in names)
        self._init, self._first, self._owner = self._find_init()
        self._has_import = False
        self._answers = {
            each: service
            for function, service in self._kinds.handlers()
            for each in ast.walk(function)
            if isinstance(each, ast.Return)
        }

    def draft(self) -> Draft:
        text = self._render(self._tree, 0, len(self._source))
        uses = any(name.split(".")[0] in _GONE for name in self._kinds.modules.values())
        if not self._changes and not uses:
            return Draft((), self._source.decode())
        needs = set(self._needs)
        for _ in range(3):
            needs |= {IMPLIED[each] for each in needs if each in IMPLIED}
        start = "spinner.start()" if "thread" in needs else ""
        lines = {"import rclpy", *(line for each in needs for line in IMPORTS.get(each, "").splitlines())}
        helpers = "".join(f"\n\n{text}" for name, text in HELPERS.items() if name in needs)
        waiting = "spinner_ended.wait()" if "thread" in needs else f"rclpy.spin({NODE})"
        helpers = helpers.replace("SPIN", waiting)
        text = re.sub(
            rf"\n[ \t]*{_START}", lambda match: match[0].replace(_START, start) if start else "", text
        )
        head, _, tail = text.partition(_IMPORTS)
        indented = "\n".join(sorted(lines, key=lambda each: (each.startswith("from"), each)))
        if self._first is None and re.search(rf"\b{NODE}\b", text + helpers):
            reason = f"this file has no init_node: set {NODE} before anything here uses it"
            self._changes.append(Change(1, "import rospy", "", reason))
            indented = f"# TODO: {reason}\n{indented}"
        place = _end_of_imports(tail) if helpers else 0
        text = head + indented + tail[:place] + helpers + tail[place:]
        text = re.sub(rf"\b{NODE}\b", self._node, text)
        changes = [
            Change(each.line, each.old, re.sub(rf"\b{NODE}\b", self._node, each.new), each.reason)
            for each in self._changes
        ]
        return Draft(sorted(changes, key=lambda each: each.line), text)

    def _statement(self, node: ast.stmt) -> str:
        outer, self._todos = self._todos, []
        new = self._special_statement(node)
        text = self._render(node, *self._span(node)) if new is None else new
        column = (
            self._span(node)[0]
            - self._starts[(getattr(node, "decorator_list", None) or [node])[0].lineno - 1]
        )
        before = self._lines[node.lineno - 1][: node.col_offset].decode()
        indent = " " * column
        rest = self._source[self._span(node)[1] :].partition(b"\n")[0].strip()
        if before.strip() and not rest:
            text += "".join(f"  # TODO: {each}" for each in dict.fromkeys(self._todos))
        elif before.strip():
            outer += self._todos
        else:
            text = "".join(f"# TODO: {each}\n{indent}" for each in dict.fromkeys(self._todos)) + text
        self._todos = outer
        if node is self._first:
            text = self._opening(indent) + (f"\n{indent}{text}" if text else "")
        return text

    def _special_statement(self, node: ast.stmt) -> str | None:
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            return self._import(node)
        if node is self._init:
            self._change(node, f"rclpy.init() and create_node, which creates {self._node}")
            return "" if node is self._first else "pass  # the node was created above"
        if isinstance(node, ast.Expr) and self._called(node.value).startswith("roslib."):
            self._change(node, "removed")
            return "pass"
        if isinstance(node, ast.Assign) and (
            len(node.targets) > 1 or isinstance(node.targets[0], (ast.Tuple, ast.List))
        ):
            return self._several(node)
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Attribute):
            target = node.targets[0]
            if target.attr == "seq" and self._is_header(target.value):
                self._change(node, "removed: std_msgs/Header has no seq in ROS 2")
                return "pass"
            return f"{self.text(target)} = {self._fitting(target, node.value)}"
        if isinstance(node, (ast.If, ast.While)):
            self._truth(node.test)
        if isinstance(node, ast.AugAssign):
            return self._augmented(node)
        if isinstance(node, ast.Return) and node in self._answers:
            return self._answer(node, self._answers[node])
        return None

    def _several(self, node: ast.Assign) -> str | None:
        """Return an assignment to several targets, or None if it stays as it is."""
        parts = [each for target in node.targets for each in getattr(target, "elts", [target])]
        if not any(isinstance(each, ast.Attribute) and self._kinds.field(each) is not None for each in parts):
            return None
        values = getattr(node.value, "elts", [node.value] * len(parts))
        words = [
            self._fitting(target, value) if isinstance(target, ast.Attribute) else self.text(value)
            for target, value in zip(parts, values, strict=False)
        ]
        is_chain = parts == node.targets and len(set(words)) == 1
        if not is_chain and (len(node.targets) > 1 or len(values) != len(parts) or node.value in values):
            self._todo(node, EXACT)
            return None
        targets = " = ".join(map(self.text, node.targets))
        return f"{targets} = {words[0] if is_chain else ', '.join(words)}"

    def _augmented(self, node: ast.AugAssign) -> str | None:
        """Return an assignment that a field with a time, which has no operators in ROS 2, requires."""
        operation = ast.copy_location(ast.BinOp(node.target, node.op, node.value), node)
        new, kind = self._with_times(operation), self._kinds.of(node.target)
        if new is None or kind not in ("stamp", "span"):
            return None
        sign, value = "+" if isinstance(node.op, ast.Add) else "-", self._as_time(node.value)
        new = f"{self.text(node.target)} = ({self._as_time(node.target)} {sign} {value}).to_msg()"
        self._change(node, new)
        return new

    def _import(self, node: ast.Import | ast.ImportFrom) -> str | None:
        if isinstance(node, ast.ImportFrom):
            return self._import_from(node)
        modules = [each.name for each in node.names]
        self._note_imports(node, modules, modules)
        others = [each for each in node.names if each.name.partition(".")[0] not in _GONE]
        if len(others) == len(node.names):
            return None
        kept = ", ".join(f"{each.name} as {each.asname}" if each.asname else each.name for each in others)
        return self._rclpy_import(node, f"import {kept}\n{' ' * node.col_offset}" if kept else "")

    def _import_from(self, node: ast.ImportFrom) -> str | None:
        module, old = node.module or "", [each.name for each in node.names]
        self._note_imports(node, [module], [f"{node.module}.{name}" for name in old])
        package, _, middle = module.partition(".")
        if package in _GONE:
            return self._rclpy_import(node, "")
        if middle != "srv":
            return None
        new = []
        for name in old:
            found = self._kinds.interface(f"{module}.{name}")
            kind, _, service = found[0].partition("/") if found else ("", "", "")
            new.append(service if kind.startswith(("req:", "res:")) else name)
        text = f"from {module} import {', '.join(dict.fromkeys(new))}"
        if len(set(new)) != len(old):
            self._change(node, text)
        return text if new != old else None

    def _note_imports(self, node: ast.stmt, modules: Sequence[str], members: Sequence[str]) -> None:
        """Add a TODO for each module that a person must install, and each member to decide about."""
        for module in sorted({each.partition(".")[0] for each in modules} & {*NOT_ON_PYPI}):
            self._todo(node, f"{module} exists in ROS 2, but not on PyPI")
        for member in members:
            reason = unsure(f"{member}.")
            if reason is not None and member.partition(".")[0] not in _GONE:
                self._todo(node, reason)
            elif self._kinds.is_of_action(member):
                self._todo(node, f"{member}: goals, results and feedback are parts of an action in ROS 2")

    def _rclpy_import(self, node: ast.stmt, before: str) -> str:
        self._change(node, "import rclpy")
        if self._has_import or node.col_offset:
            return f"{before}import rclpy"
        self._has_import = True
        return f"{before}{_IMPORTS}"

    def _find_init(self) -> tuple[ast.stmt | None, ast.stmt | None, ast.FunctionDef | None]:
        """Return the statement with init_node, the first statement of its block, and its function.

        A program without init_node, which only calls services, has only the first.
        """
        body = self._tree.body
        definitions = (ast.Import, ast.ImportFrom, ast.FunctionDef, ast.ClassDef)
        program = (
            number
            for number, each in enumerate(body)
            if not isinstance(each, definitions) and not _is_docstring(each)
        )
        for init, block, owner in self._inits(body, body[next(program, 0) :], None):
            return init, next(each for each in block if not _is_docstring(each)), owner
        mains = (each for each in body if isinstance(each, ast.If) and "__main__" in ast.unparse(each.test))
        return None, next((each.body[0] for each in mains), None), None

    def _inits(
        self, body: Sequence[ast.stmt], block: Sequence[ast.stmt], owner: ast.FunctionDef | None
    ) -> Iterator[tuple[ast.stmt, Sequence[ast.stmt], ast.FunctionDef | None]]:
        """Yield each statement with init_node in and below `body`, with its block and its function.

        Blocks are those of functions, and outside of functions those of `if`.
        """
        for each in body:
            if isinstance(each, ast.Expr) and self._called(each.value) == "rospy.init_node":
                yield each, block, owner
            inner = getattr(each, "body", None)
            if not isinstance(inner, list):
                continue
            if isinstance(each, ast.FunctionDef):
                yield from self._inits(inner, inner, each)
            else:
                is_block = isinstance(each, ast.If) and owner is None
                yield from self._inits(inner, inner if is_block else block, owner)

    def _opening(self, indent: str) -> str:
        call = getattr(self._init, "value", None)
        if not isinstance(call, ast.Call):
            call = ast.Call(ast.Name("init_node"), [], [])
        name = next(
            (each.value for each in call.keywords if each.arg == "name"), call.args[0] if call.args else None
        )
        lines = [f"global {NODE}"] if self._owner is not None else []
        lines += [
            "rclpy.init()",
            f"{NODE} = rclpy.create_node({self.text(name) if name is not None else repr('node')})",
        ]
        for keyword in call.keywords:
            if keyword.arg in ("log_level", "disable_signals", "argv"):
                lines.insert(0, f"# TODO: init_node: the argument {keyword.arg} has no counterpart")
                self._changes.append(
                    Change(
                        call.lineno, self._original(call), "", f"init_node: {keyword.arg} has no counterpart"
                    )
                )
        return f"\n{indent}".join(lines) + f"\n{indent}{_START}"


def _end_of_imports(text: str) -> int:
    """Return where the imports at the beginning of a text end, after its first line."""
    first = text.find("\n") + 1
    try:
        statements = ast.parse(text[first:]).body
    except SyntaxError:
        return first
    imports = takewhile(lambda each: isinstance(each, (ast.Import, ast.ImportFrom)), statements)
    count = max((each.end_lineno or 0 for each in imports), default=0)
    return first + sum(map(len, text[first:].splitlines(keepends=True)[:count]))


def _is_docstring(node: ast.stmt) -> bool:
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )
