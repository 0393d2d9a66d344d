"""Each folder of `packages` and `plugins` has budgets of lines of code, and each source file has a limit."""

import re
from pathlib import Path

import pytest

from tests.support.environments import REPOSITORY

BUDGETS = {
    "packages/pipros": (27_200, 52_770),
    "packages/pipros-bridges": (6_650, 6_230),
    "packages/pipros-libraries": (15_130, 4_720),
    "packages/pipros-page": (6_900, 12_290),
    "packages/pipros-rosbag2": (3_810, 1_470),
    "packages/pipros-server": (3_410, 1_750),
    "packages/pipros-simulation": (3_780, 2_050),
    "packages/pipros-tools": (31_160, 9_330),
    "packages/pipros-workspace": (6_760, 3_290),
    "plugins/pipros-assistants": (1_800, 2_010),
    "plugins/pipros-data": (3_090, 2_670),
    "plugins/pipros-fleet": (4_300, 3_300),
    "plugins/pipros-robot": (13_980, 12_100),
    "plugins/pipros-ros2": (10_130, 7_170),
    "plugins/pipros-tab": (1_870, 2_620),
    "plugins/pipros-wheels": (2_440, 2_580),
}
"""Lines of `src` and `facades`, and of `tests`: as they were on 2026-12-01, and 1 % more."""

MAX_LINES = 400
LONGER = {
    "plugins/pipros-ros2/src/pipros_ros2/agent/rclpy_agent.py": "one file, run by a Python without pipros",
}
"""Source files that are longer, and why."""


NO_CODE = re.compile(r'^[ \t]*(?:[rR]?"{3}(?:[^"\\]|\\.|"(?!""))*"{3}|#[^\n]*)$', re.MULTILINE | re.DOTALL)
"""A docstring or another text that stands alone, and a comment."""


def code_lines(folders: list[Path]) -> int:
    codes = (NO_CODE.sub("", file.read_text()) for folder in folders for file in folder.rglob("*.py"))
    return sum(len(re.findall(r"^.*\S.*$", code, re.MULTILINE)) for code in codes)


FOLDERS = [folder for top in ("packages", "plugins") for folder in REPOSITORY.glob(f"{top}/pipros*")]


@pytest.mark.parametrize("folder", sorted(str(each.relative_to(REPOSITORY)) for each in FOLDERS))
def test_a_folder_keeps_within_its_budget(folder: str) -> None:
    here = REPOSITORY / folder
    source, tests = BUDGETS[folder]
    advice = "take something out, or raise the number with a line in CHANGELOG.md that says what it bought"
    assert code_lines([here / "src", here / "facades"]) <= source, advice
    assert code_lines([here / "tests"]) <= tests, advice


def test_source_files_have_at_most_400_lines_except_those_with_a_reason() -> None:
    files = [file for each in FOLDERS for part in ("src", "facades") for file in (each / part).rglob("*.py")]
    lines = {str(file.relative_to(REPOSITORY)): len(file.read_text().splitlines()) for file in files}
    long = {name for name, count in lines.items() if count > MAX_LINES}
    assert len(lines) > 1000
    assert long - LONGER.keys() == set(), "let a piece with a name and a reason of its own leave"
    assert {name for name in LONGER if (REPOSITORY / name).exists()} <= long, "take out what is shorter"
