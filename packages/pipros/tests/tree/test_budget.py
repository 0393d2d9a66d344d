"""Each folder of `packages` and `plugins` has budgets of lines of code, and each source file has a limit."""

import ast
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.support.environments import REPOSITORY
from tests.support.trees import parsed

BUDGETS = {
    "packages/pipros": (26_480, 49_970),
    "packages/pipros-bridges": (6_480, 6_010),
    "packages/pipros-libraries": (14_900, 4_530),
    "packages/pipros-page": (6_790, 11_320),
    "packages/pipros-rosbag2": (3_740, 1_570),
    "packages/pipros-server": (3_340, 1_660),
    "packages/pipros-simulation": (3_750, 1_960),
    "packages/pipros-tools": (30_180, 9_100),
    "packages/pipros-workspace": (6_510, 3_230),
    "plugins/pipros-assistants": (1_740, 1_930),
    "plugins/pipros-data": (3_020, 2_610),
    "plugins/pipros-fleet": (4_190, 3_160),
    "plugins/pipros-robot": (13_770, 11_760),
    "plugins/pipros-ros2": (9_700, 6_790),
    "plugins/pipros-tab": (1_840, 2_370),
    "plugins/pipros-wheels": (2_370, 2_480),
}
"""Lines of `src` and `facades`, and of `tests`: as they were on 2026-12-01, and 1 % more."""

MAX_LINES = 400
LONGER = {
    "plugins/pipros-ros2/src/pipros_ros2/agent/rclpy_agent.py": "one file, run by a Python without pipros",
}
"""Source files that are longer, and why."""


def lines_of(tree: ast.Module) -> Iterator[int]:
    """Yield the lines on which code starts or ends, without comments and docstrings."""
    nodes = [node for node in ast.walk(tree) if isinstance(node, ast.stmt | ast.expr)]
    texts = [node for node in nodes if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)]
    left_out = {id(each) for node in texts for each in (node, node.value)}
    for node in nodes:
        if id(node) not in left_out:
            yield from (node.lineno, node.end_lineno or node.lineno)


def code_lines(folders: list[Path], parse: Callable[[Path], ast.Module]) -> int:
    files = [file for folder in folders for file in folder.rglob("*.py")]
    return sum(len({*lines_of(parse(file))}) for file in files)


FOLDERS = [folder for top in ("packages", "plugins") for folder in REPOSITORY.glob(f"{top}/pipros*")]


@pytest.mark.parametrize("folder", sorted(str(each.relative_to(REPOSITORY)) for each in FOLDERS))
def test_a_folder_keeps_within_its_budget(folder: str) -> None:
    here = REPOSITORY / folder
    source, tests = BUDGETS[folder]
    advice = "take something out, or raise the number with a line in CHANGELOG.md that says what it bought"
    assert code_lines([here / "src", here / "facades"], parsed) <= source, advice
    assert code_lines([here / "tests"], lambda file: ast.parse(file.read_text())) <= tests, advice


def test_source_files_have_at_most_400_lines_except_those_with_a_reason() -> None:
    files = [file for each in FOLDERS for part in ("src", "facades") for file in (each / part).rglob("*.py")]
    lines = {str(file.relative_to(REPOSITORY)): len(file.read_text().splitlines()) for file in files}
    long = {name for name, count in lines.items() if count > MAX_LINES}
    assert len(lines) > 1000
    assert long - LONGER.keys() == set(), "let a piece with a name and a reason of its own leave"
    assert {name for name in LONGER if (REPOSITORY / name).exists()} <= long, "take out what is shorter"
