"""The example of docs/ros2.md."""

from __future__ import annotations

import math
import re
from pathlib import Path

from pipros.ros2.rules import Direction, Kind, parse_gateway_rules

DOCUMENT = (Path(__file__).resolve().parents[3] / "docs" / "ros2.md").read_text()


def test_the_rules_are_valid() -> None:
    (example,) = re.findall(r"^```yaml\n(.*?)^```", DOCUMENT, re.MULTILINE | re.DOTALL)

    rules = parse_gateway_rules(example, "docs/ros2.md")

    assert rules.verdict(Kind.SERVICE, Direction.TO_ROS1, "/reset", is_local=False).passes
    assert [rule.rate for rule in rules.static] == [5.0, math.inf]
