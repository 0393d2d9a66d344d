"""Migration rules for `rosbag check` and `rosbag fix`. They convert messages to newer definitions.

Rule files (`.bmr`) contain Python classes, in the form that genuine rosbag writes. They are parsed, never
executed; see `migration_update` for the statements that `update` may contain.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from pipros.msg.dynamic import message_classes_from_text
from pipros_tools.bag import migration_update
from pipros_tools.bag.errors import BagError

_DEPTH_LIMIT = 100
"""Maximum nesting of expressions and statements. Each `elif` adds one level."""


@dataclass(frozen=True, slots=True)
class MigrationRule:
    """A migration rule.

    Attributes:
        old, new: type and md5sum before and after migration. Both strings in `old` are empty if the type is
            new; both strings in `new` are empty if the type was removed.
        is_valid: False until the rule has been completed by hand.
    """

    name: str
    old: tuple[str, str]
    new: tuple[str, str]
    old_text: str
    new_text: str
    is_valid: bool
    methods: Mapping[str, ast.FunctionDef] = field(default_factory=dict, compare=False)


def parse_rules(
    text: str, file: str, on_refusal: Callable[[str], object] | None = None
) -> list[MigrationRule]:
    """Return the rules in a file.

    Args:
        on_refusal: called with the error text for each invalid rule, which is then skipped. If None, the
            first error is raised.

    Raises:
        BagError: the file is malformed, or contains statements that rules must not contain. The text names
            the line.
    """
    try:
        tree = ast.parse(text)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        line = getattr(error, "lineno", 0)
        raise BagError(f"{file}:{line}: the rule file is malformed: {error}") from None
    _check_depth(tree, file)
    rules = []
    for node in tree.body:
        if migration_update.is_text(node):
            continue
        try:
            rules.append(_rule(node, file))
        except BagError as error:
            if on_refusal is None:
                raise
            on_refusal(str(error))
    return rules


def _check_depth(tree: ast.Module, file: str) -> None:
    """Reject nesting so deep that checking or evaluating a rule would exceed Python's recursion limit."""
    left: list[tuple[ast.AST, int]] = [(tree, 0)]
    while left:
        node, depth = left.pop()
        if depth > _DEPTH_LIMIT:
            raise _refusal(node, file, f"a rule is nested more than {_DEPTH_LIMIT} deep")
        left += [(child, depth + 1) for child in ast.iter_child_nodes(node)]


def _rule(node: ast.stmt, file: str) -> MigrationRule:
    if not isinstance(node, ast.ClassDef):
        raise _refusal(node, file, "a rule file may only contain classes")
    values: dict[str, object] = {}
    methods: dict[str, ast.FunctionDef] = {}
    for part in node.body:
        if isinstance(part, ast.Assign) and len(part.targets) == 1 and isinstance(part.targets[0], ast.Name):
            try:
                values[part.targets[0].id] = ast.literal_eval(part.value)
            except (ValueError, TypeError, RecursionError):
                raise _refusal(part, file, "a value must be a literal") from None
        elif isinstance(part, ast.FunctionDef):
            if part.name != "get_class_def":  # genuine rosbag generates this method
                methods[part.name] = part
        elif not migration_update.is_text(part) and not isinstance(part, ast.Pass):
            raise _refusal(part, file, "a rule may only contain values and methods")
    try:
        migration_update.check(methods)
    except migration_update.RuleRefused as error:
        raise _refusal(error.node, file, str(error)) from None
    texts = {
        name: str(values.get(name, "")).strip()
        for name in ("old_type", "old_full_text", "new_type", "new_full_text")
    }
    old = texts["old_type"], _md5sum(texts["old_type"], texts["old_full_text"], node, file)
    new = texts["new_type"], _md5sum(texts["new_type"], texts["new_full_text"], node, file)
    is_valid = values.get("valid") is True and "update" in methods
    return MigrationRule(
        node.name, old, new, texts["old_full_text"], texts["new_full_text"], is_valid, methods
    )


def _md5sum(type_name: str, text: str, node: ast.AST, file: str) -> str:
    if not type_name:
        return ""  # the type was added or removed
    try:
        return message_classes_from_text(type_name, text)[type_name]._md5sum
    except Exception as error:
        raise _refusal(node, file, f"the definition of [{type_name}] is broken: {error}") from error


def _refusal(node: ast.AST, file: str, reason: str) -> BagError:
    return BagError(f"{file}:{getattr(node, 'lineno', 0)}: {reason}")
