"""Facades translate names, defaults and exceptions: their functions have few branches."""

from __future__ import annotations

import ast
import functools
from collections.abc import Iterator, Mapping

import pytest

from tests.support.environments import FACADES, source_files
from tests.support.trees import parsed

MAX_BRANCHES = 6

EXCEPTIONS: Mapping[str, str] = {
    "rosbridge_library.capability.Capability.basic_type_check": "one branch per kind of mistake",
    "rosbridge_library.internal.ros_loader._load": "one exception of rosbridge per kind of mistake",
    "rosbridge_server.programs.options_from_parameters": "one branch per optional parameter",
    "rospy.service.convert_return_to_response": "one branch per kind of value that a handler may return",
}
"""Functions with more branches, each with the reason."""

Function = ast.FunctionDef | ast.AsyncFunctionDef


def functions_of(tree: ast.AST, name: str) -> Iterator[tuple[str, Function]]:
    """Yield the functions in a module, class or function, each with its full name."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.ClassDef | Function):
            inner = f"{name}.{node.name}"
            if isinstance(node, Function):
                yield inner, node
            yield from functions_of(node, inner)
        else:
            yield from functions_of(node, name)


def branches_of(function: ast.AST) -> int:
    """Count the branches of a function, without those of functions and classes inside it."""
    count = 0
    for node in ast.iter_child_nodes(function):
        if isinstance(node, Function | ast.ClassDef):
            continue
        match node:
            case (
                ast.If() | ast.IfExp() | ast.For() | ast.AsyncFor() | ast.While() | ast.ExceptHandler()
            ) | ast.match_case():
                count += 1
            case ast.BoolOp(values=values):
                count += len(values) - 1
            case ast.comprehension(ifs=conditions):
                count += len(conditions)
        count += branches_of(node)
    return count


@functools.cache
def facade_functions() -> Mapping[str, int]:
    """Count the branches of each function of the facades."""
    found = {}
    for file in source_files():
        root = next((folder for folder in FACADES if file.is_relative_to(folder)), None)
        if root is not None:
            parts = file.relative_to(root).with_suffix("").parts
            for name, function in functions_of(parsed(file), ".".join(parts)):
                found[name] = branches_of(function)
    return found


def test_functions_of_facades_have_few_branches() -> None:
    assert len(facade_functions()) > 1900
    wrong = {name: count for name, count in facade_functions().items() if count > MAX_BRANCHES}
    assert {name: count for name, count in wrong.items() if name not in EXCEPTIONS} == {}, (
        "move what they do into pipros"
    )


def test_exceptions_are_still_needed() -> None:
    assert [name for name in EXCEPTIONS if facade_functions().get(name, 0) <= MAX_BRANCHES] == []


@pytest.mark.parametrize(
    ("code", "branches"),
    [
        ("def f(): return 1", 0),
        ("def f():\n  if a and b or c: return 1 if d else 2", 4),
        ("def f():\n  for a in b:\n    while c: pass", 2),
        ("def f():\n  try: pass\n  except A: pass\n  except B: pass", 2),
        ("def f(): return [a for a in b if c if d]", 2),
        ("def f():\n  match a:\n    case 1: pass\n    case _: pass", 2),
        ("def f():\n  def g():\n    if a: pass", 0),
        ("def f(): return lambda: a or b", 1),
    ],
)
def test_branches_are_counted(code: str, branches: int) -> None:
    [(_, function), *_] = functions_of(ast.parse(code), "m")

    assert branches_of(function) == branches
