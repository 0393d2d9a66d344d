"""Text of a node, and the text that replaces parts of it."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from pipros_ros2.port.kinds import Kinds
from pipros_rosbag2.interfaces.catalog import Ros1Definitions

_QUOTE: Final = re.compile(r"\"\"\"|'''|\"|'")


@dataclass(frozen=True, slots=True)
class Change:
    """A part of a file and what becomes of it. `reason` says why a person must look at it."""

    line: int
    old: str
    new: str
    reason: str = ""


class PortedText:
    """A parsed file whose expressions and statements are replaced one by one."""

    def __init__(self, source: str, tree: ast.Module, definitions: Ros1Definitions) -> None:
        self._lines = [line.encode() for line in source.splitlines(keepends=True)]
        self._source = source.encode()
        self._starts = [0]
        for line in self._lines:
            self._starts.append(self._starts[-1] + len(line))
        self._tree = tree
        self._kinds = Kinds(tree, definitions)
        self._needs: set[str] = set()
        self._changes: list[Change] = []
        self._todos: list[str] = []

    def _span(self, node: ast.AST) -> tuple[int, int]:
        first: ast.AST = node
        decorators = getattr(node, "decorator_list", [])
        if decorators:
            first = decorators[0]
        line, column = getattr(first, "lineno", 0), getattr(first, "col_offset", 0)
        end_line, end_column = getattr(node, "end_lineno", 0), getattr(node, "end_col_offset", 0)
        return self._starts[line - 1] + column, self._starts[end_line - 1] + end_column

    def _original(self, node: ast.AST) -> str:
        begin, end = self._span(node)
        return self._source[begin:end].decode()

    def _children(self, node: ast.AST) -> Iterable[ast.AST]:
        if isinstance(node, ast.JoinedStr):
            yield from (each.value for each in ast.walk(node) if isinstance(each, ast.FormattedValue))
            return
        for child in ast.iter_child_nodes(node):
            if hasattr(child, "lineno"):
                yield child
            else:
                yield from self._children(child)

    def _render(self, node: ast.AST, begin: int, end: int) -> str:
        """Return the text between two positions, with the children of a node replaced."""
        parts, at = [], begin
        for child in sorted(self._children(node), key=self._span):
            first, last = self._span(child)
            if first < at:
                continue  # inside of the child before, or both names of a keyword
            parts += [self._source[at:first].decode(), self.text(child)]
            at = last
        return "".join([*parts, self._source[at:end].decode()])

    def text(self, node: ast.AST) -> str:
        """Return the text of a node in the draft."""
        if isinstance(node, ast.stmt):
            return self._statement(node)
        new = self._replaced(node) if isinstance(node, ast.expr) else None
        if new is not None:
            return new
        if isinstance(node, ast.JoinedStr):
            return self._f_string(node)
        return self._render(node, *self._span(node))

    def _f_string(self, node: ast.JoinedStr) -> str:
        """Return the text of an f-string.

        Before 3.12, Python does not know where some of its parts are, and allows no quotes of its own inside.
        """
        original, changes, todos = self._original(node), len(self._changes), len(self._todos)
        try:
            for each in self._children(node):
                if ast.dump(ast.parse(self._original(each).strip(), mode="eval").body) != ast.dump(each):
                    raise ValueError
            new = self._render(node, *self._span(node))
            ast.parse(new)
            quote = _QUOTE.search(original)
            if quote and new.count(quote[0]) != original.count(quote[0]):
                raise ValueError
        except (SyntaxError, ValueError, LookupError):
            del self._changes[changes:], self._todos[todos:]
            if any(self._kinds.full_name(each).startswith("rospy.") for each in ast.walk(node)):
                self._todo(node, "this f-string with rospy inside is not changed")
            return original
        return new

    def _replaced(self, node: ast.expr) -> str | None:
        """Return the text that replaces an expression, or None if only parts of it change."""
        raise NotImplementedError

    def _statement(self, node: ast.stmt) -> str:
        """Return the text of a statement, with TODO comments before it."""
        raise NotImplementedError

    def _called(self, node: ast.AST) -> str:
        return self._kinds.full_name(node.func) if isinstance(node, ast.Call) else ""

    def _root_is_module(self, node: ast.AST) -> bool:
        while isinstance(node, ast.Attribute):
            node = node.value
        return isinstance(node, ast.Name) and node.id in self._kinds.modules

    def _is_header(self, node: ast.AST) -> bool:
        return self._kinds.of(node) == "msg:std_msgs/Header" or getattr(node, "attr", "") == "header"

    def _change(self, node: ast.AST, new: str) -> None:
        self._changes.append(Change(getattr(node, "lineno", 0), self._original(node), new))

    def _todo(self, node: ast.AST, reason: str) -> None:
        self._todos.append(reason)
        self._changes.append(Change(getattr(node, "lineno", 0), self._original(node), "", reason))
