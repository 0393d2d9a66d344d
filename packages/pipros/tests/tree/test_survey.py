"""The survey of real packages: its committed result, and what counts as a name that a file needs."""

from __future__ import annotations

import ast
import importlib
import re
from types import ModuleType

import pytest

from tests.support.environments import BENCHMARKS

SOURCE = """
import rospy, os.path as paths
import tf.transformations
from std_msgs.msg import String, Int8 as Number
from . import own
try:
    import optional
except ImportError:
    optional = None
try:
    import needed
finally:
    pass

def main(tf2):
    import later
    tf2.unknown
    rospy.spin = None
    rospy.Publisher(paths.curdir, tf.transformations, optional.x)
"""


@pytest.fixture
def benchmarks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(BENCHMARKS))


def module(name: str) -> ModuleType:
    return importlib.import_module(name)


@pytest.mark.usefixtures("benchmarks")
def test_the_committed_result_has_every_source_and_its_totals() -> None:
    survey = module("survey")
    lines = (BENCHMARKS / "survey.txt").read_text().splitlines()
    start = next(number for number, line in enumerate(lines) if line.startswith("source "))
    table = lines[start + 1 : lines.index("", start)]
    listed = [line.split() for line in survey.rows(survey.DEBIAN + survey.PYPI)]

    assert [line.split()[:2] for line in table[:-1]] == listed
    assert len(listed) >= 40
    numbers = [list(map(int, re.findall(r"\d+", line[42:]))) for line in table]
    assert [sum(column) for column in zip(*numbers[:-1], strict=True)] == numbers[-1]
    assert table[-1].startswith(f"{len(listed)} sources ")


@pytest.mark.usefixtures("benchmarks")
def test_names_are_those_without_which_a_file_fails() -> None:
    found = set(module("survey_names").used_names(ast.parse(SOURCE)))

    assert found == {
        *(("rospy", ""), ("os.path", ""), ("tf.transformations", ""), ("needed", ""), ("later", "")),
        *(("std_msgs.msg", "String"), ("std_msgs.msg", "Int8")),
        *(("rospy", "Publisher"), ("os.path", "curdir"), ("tf", "transformations")),
    }
