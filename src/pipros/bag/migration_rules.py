"""Migration rules of `rosbag check` and `rosbag fix`: how messages of older definitions become newer ones.

Rule files are Python classes as genuine rosbag writes them (`.bmr`), but they are parsed, never run.
Statements of `update` may assign expressions of `old_msg` to fields of `new_msg`, and call `self.migrate` and
`self.migrate_array`; expressions are evaluated by `pipros.safe.expr`.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass

from pipros.bag.errors import BagError
from pipros.msg.dynamic import message_classes_from_text


@dataclass(frozen=True, slots=True)
class Assignment:
    """`new_msg.a.b = expression`. `path` is ("a", "b")."""

    path: tuple[str, ...]
    expression: str


@dataclass(frozen=True, slots=True)
class Migration:
    """`self.migrate(old_msg.a, new_msg.b)`: a message, or with `migrate_array` all messages of a list."""

    source: tuple[str, ...]
    path: tuple[str, ...]
    is_array: bool


@dataclass(frozen=True, slots=True)
class Rule:
    """One rule. `is_valid` is False for one that was written for a person to complete."""

    name: str
    old: tuple[str, str]
    new: tuple[str, str]
    new_text: str
    is_valid: bool
    statements: tuple[Assignment | Migration, ...]


def parse_rules(text: str, file: str) -> list[Rule]:
    """The rules of a file.

    Raises:
        BagError: it is malformed, or does what rules may not; the text names file and line.
    """
    try:
        tree = ast.parse(text)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        line = getattr(error, "lineno", 0)
        raise BagError(f"{file}:{line}: the rule file is malformed: {error}") from None
    return [_rule(node, file) for node in tree.body if not _is_text(node)]


def _rule(node: ast.stmt, file: str) -> Rule:
    if not isinstance(node, ast.ClassDef):
        raise _refusal(node, file, "a rule file may contain classes only")
    values: dict[str, object] = {}
    statements: tuple[Assignment | Migration, ...] = ()
    for part in node.body:
        if isinstance(part, ast.Assign) and len(part.targets) == 1 and isinstance(part.targets[0], ast.Name):
            try:
                values[part.targets[0].id] = ast.literal_eval(part.value)
            except (ValueError, TypeError):
                raise _refusal(part, file, "a value must be a literal") from None
        elif isinstance(part, ast.FunctionDef) and part.name == "update":
            statements = tuple(_statements(part, file))
        elif not _is_text(part) and not isinstance(part, ast.Pass):
            raise _refusal(part, file, "a rule may have values and a method update")
    texts = {
        name: str(values.get(name, "")) for name in ("old_type", "old_full_text", "new_type", "new_full_text")
    }
    old = texts["old_type"], _md5sum(texts["old_type"], texts["old_full_text"], node, file)
    new_text = texts["new_full_text"].strip()
    new = texts["new_type"], _md5sum(texts["new_type"], new_text, node, file)
    return Rule(node.name, old, new, new_text, values.get("valid") is True, statements)


def _md5sum(type_name: str, text: str, node: ast.AST, file: str) -> str:
    try:
        return message_classes_from_text(type_name, text.strip())[type_name]._md5sum
    except Exception as error:
        raise _refusal(node, file, f"the definition of [{type_name}] is broken: {error}") from error


def _statements(function: ast.FunctionDef, file: str) -> Iterator[Assignment | Migration]:
    for node in function.body:
        if _is_text(node) or isinstance(node, ast.Pass):
            continue
        if isinstance(node, ast.Assign) and len(node.targets) == 1:
            path = _path(node.targets[0], "new_msg")
            if path:
                yield Assignment(path, ast.unparse(node.value))
                continue
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            call = node.value
            method = ast.unparse(call.func)
            if method in ("self.migrate", "self.migrate_array") and len(call.args) >= 2:
                source, target = _path(call.args[0], "old_msg"), _path(call.args[1], "new_msg")
                if source and target:
                    yield Migration(source, target, method == "self.migrate_array")
                    continue
        raise _refusal(
            node, file, "a rule may assign to fields of new_msg, and call self.migrate and self.migrate_array"
        )


def _path(node: ast.expr, root: str) -> tuple[str, ...]:
    """The fields of `root.a.b`; empty for anything else."""
    names: list[str] = []
    while isinstance(node, ast.Attribute) and not node.attr.startswith("_"):
        names.insert(0, node.attr)
        node = node.value
    return tuple(names) if isinstance(node, ast.Name) and node.id == root else ()


def _is_text(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def _refusal(node: ast.AST, file: str, reason: str) -> BagError:
    return BagError(f"{file}:{getattr(node, 'lineno', 0)}: {reason}")
