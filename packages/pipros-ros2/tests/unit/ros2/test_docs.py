"""The example and the figures of docs/ros2.md."""

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
