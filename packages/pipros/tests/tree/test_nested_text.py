"""Text that is nested too deeply is refused like other malformed text, wherever it is parsed."""

from __future__ import annotations

import ast
from collections.abc import Iterator

import pytest

from tests.support.environments import ROOTS, files_below, import_path

PARSERS = {"json.load", "json.loads", "literal_eval", "ast.literal_eval"}
"""They raise ValueError for malformed text, and RecursionError for deep text."""
DEEP = {"RecursionError", "RuntimeError", "Exception", "BaseException"}


def caught(block: ast.Try) -> set[str]:
    types = (each.type for each in block.handlers)
    return {ast.unparse(name) for each in types if each for name in getattr(each, "elts", [each])}


def shallow(node: ast.AST, names: frozenset[str] = frozenset()) -> Iterator[int]:
    """Yield the lines of parsers inside of a `try` that catches malformed text only."""
    if (
        isinstance(node, ast.Call)
        and ast.unparse(node.func) in PARSERS
        and "ValueError" in names
        and not names & DEEP
    ):
        yield node.lineno
    body = node.body if isinstance(node, ast.Try) else []
    for child in ast.iter_child_nodes(node):
        yield from shallow(
            child, names | caught(node) if isinstance(node, ast.Try) and child in body else names
        )


def test_whoever_catches_malformed_text_also_catches_deep_text() -> None:
    found = {
        f"{import_path(file).as_posix()}:{line}"
        for folder in ROOTS
        for file in files_below(folder, "*.py")
        if any(word in (text := file.read_text(encoding="utf-8")) for word in ("json.load", "literal_eval"))
        for line in shallow(ast.parse(text))
    }

    assert found == set(), "catch RecursionError, too"


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("try: json.loads(x)\nexcept ValueError: pass", [1]),
        ("try:\n  with a:\n    f(json.load(x))\nexcept (OSError, ValueError): pass", [3]),
        ("try: json.loads(x)\nexcept (ValueError, RecursionError): pass", []),
        ("try:\n  try: json.loads(x)\n  except ValueError: pass\nexcept RecursionError: pass", []),
        ("try: pass\nexcept ValueError: json.loads(x)", []),
    ],
)
def test_the_rule_finds_them(text: str, lines: list[int]) -> None:
    assert list(shallow(ast.parse(text))) == lines
