"""Nodes survive a time that moves back: they compare moments with `elapsed`, and their loops go on."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.environments import REPOSITORY
from tests.support.trees import nodes_of, parsed
from tests.tree.test_layering import FILES

MOMENT = re.compile(r"(now|stamp|time|moment)\w*")
DURATION = re.compile(r"timeout|window|interval|period|limit|tolerance|extension|delay|history")
NODES = re.compile(r"src/pipros(_libraries|\w*/(navigation|perception))/")

MAY_WAIT = {
    "topic_tools/rates.py": "sets its moment to now before, as genuine throttle does",
    "filter/kalman.py": "commands may be newer than the estimate; the reset of a filter forgets them",
    "filter/timeline.py": "`reset_on_time_jump` decides, as in genuine robot_localization",
}


def name_of(node: ast.expr) -> str:
    """Return the last name of an expression: `now_ns` for `self._now_ns()`."""
    node = node.func if isinstance(node, ast.Call) else node
    return node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")


def subtracted(tree: ast.Module) -> Iterator[int]:
    """Yield the lines where one bound is compared with a moment minus an earlier one of the object."""
    for node in nodes_of(tree):
        if not (isinstance(node, ast.Compare) and len(node.ops) == 1):
            continue
        for side in (node.left, *node.comparators):
            if isinstance(side, ast.BinOp) and isinstance(side.op, ast.Sub):
                is_kept = isinstance(side.right, ast.Attribute) and not DURATION.search(side.right.attr)
                if is_kept and MOMENT.fullmatch(name_of(side.left).lstrip("_")):
                    yield node.lineno


def ending_loops(tree: ast.Module) -> Iterator[int]:
    """Yield the lines of rospy's pauses that raise if the time moves back, which ends a program."""
    for node in nodes_of(tree):
        if isinstance(node, ast.Call) and ast.unparse(node.func) in ("rospy.Rate", "rospy.sleep"):
            is_start = [ast.unparse(each) for each in node.args] == ["0"]  # only waits for the first time
            if not is_start and not any(each.arg == "reset" for each in node.keywords):
                yield node.lineno


def is_monotonic(file: Path) -> bool:
    return "monotonic" in file.read_text()


def test_no_node_subtracts_moments_of_a_clock_that_may_move_back() -> None:
    found = [
        f"{file.relative_to(REPOSITORY)}:{line}"
        for file in FILES
        if NODES.search(file.as_posix()) and not file.as_posix().endswith(tuple(MAY_WAIT))
        if not is_monotonic(file)
        for line in subtracted(parsed(file))
    ]
    assert not found, f"use pipros.basics.intervals.elapsed, or two bounds: {found}"


def test_no_program_ends_because_the_time_moves_back() -> None:
    found = [
        f"{file.relative_to(REPOSITORY)}:{line}"
        for file in FILES
        if "facades" in file.parts and "rospy" not in file.parts
        for line in ending_loops(parsed(file))
    ]
    assert not found, f"use rospy.Rate(hz, reset=True): {found}"


@pytest.mark.parametrize(("code", "is_wrong"), [
    ("now_ns - self._saved_ns >= period", True), ("limit < self._now_s() - context.last_s", True),
    ("0 <= now_s - self._last_s < limit", False), ("elapsed(now_s, self._last_s) < limit", False),
    ("stamp_ns > now_ns - self._timeout_ns", False),
])  # fmt: skip
def test_the_rule_for_moments_finds_what_it_should(code: str, is_wrong: bool) -> None:
    assert bool(list(subtracted(ast.parse(code)))) == is_wrong


@pytest.mark.parametrize(
    ("code", "is_wrong"),
    [
        ("rospy.Rate(10)", True), ("rospy.sleep(1.0)", True), ("rospy.Rate(10, reset=True)", False),
        ("rospy.sleep(0)", False),
    ],
)  # fmt: skip
def test_the_rule_for_loops_finds_what_it_should(code: str, is_wrong: bool) -> None:
    assert bool(list(ending_loops(ast.parse(code)))) == is_wrong
