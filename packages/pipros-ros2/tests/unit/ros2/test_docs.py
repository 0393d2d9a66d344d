"""The example, the figures and the cases of docs/ros2.md."""

from __future__ import annotations

import math
import re
import zlib

from pipros.ros2.rules import Direction, RuleKind, parse_gateway_rules
from tests.support.environments import REPOSITORY, SRC

ROOT = REPOSITORY
DOCUMENT = (ROOT / "docs" / "ros2.md").read_text()


def test_the_rules_are_valid() -> None:
    (example,) = re.findall(r"^```yaml\n(.*?)^```", DOCUMENT, re.MULTILINE | re.DOTALL)

    rules = parse_gateway_rules(example, "docs/ros2.md")

    assert rules.verdict(RuleKind.SERVICE, Direction.TO_ROS1, "/reset", is_local=False).passes
    assert [rule.rate for rule in rules.static] == [5.0, math.inf]


def test_the_size_of_the_carried_definitions_is_true() -> None:
    carried = (SRC / "pipros" / "ros2" / "interfaces" / "carried.msgs").read_bytes()

    sizes = (round(len(each) / 1000) for each in (carried, zlib.compress(carried)))

    assert "({} kB, {} kB in the wheel)".format(*sizes) in DOCUMENT


def test_the_cases_of_ros1_bridge_have_tests() -> None:
    section = DOCUMENT.partition("## Known complaints about ros1_bridge")[2].partition("\n## ")[0]
    named = re.findall(r"`(packages/[\w/-]+/tests/[\w/]+\.py)`((?:,? `test_\w+`)+)", section)

    assert len(named) >= 7
    for file, tests in named:
        text = (ROOT / file).read_text()
        missing = [each for each in re.findall(r"test_\w+", tests) if f"def {each}(" not in text]
        assert not missing, f"{file} lacks {missing}"
