"""The example and the figures of docs/guides/ros2.md."""

import math
import re
import zlib

from pipros_ros2.rules import Direction, RuleKind, parse_gateway_rules
from tests.support import documents
from tests.support.environments import REPOSITORY, source

ROOT = REPOSITORY
DOCUMENT = documents.text_of("guides/ros2.md")
TASK = documents.text_of("how/ros2-nodes.md")


def test_the_rules_are_valid() -> None:
    (example,) = re.findall(r"^```yaml\n(.*?)^```", DOCUMENT, re.MULTILINE | re.DOTALL)

    rules = parse_gateway_rules(example, "plugins/pipros-ros2/docs/guides/ros2.md")

    assert rules.verdict(RuleKind.SERVICE, Direction.TO_ROS1, "/reset", is_local=False).passes
    assert [rule.rate for rule in rules.static] == [5.0, math.inf]


def test_the_rules_of_the_task_let_pass_what_it_says() -> None:
    (example,) = re.findall(r'^```yaml title="rules.yaml"\n(.*?)^```', TASK, re.MULTILINE | re.DOTALL)

    rules = parse_gateway_rules(example, "rules.yaml")

    def passes(kind: RuleKind, direction: Direction, name: str) -> bool:
        return bool(rules.verdict(kind, direction, name, is_local=False).passes)

    assert passes(RuleKind.TOPIC, Direction.TO_ROS1, "/cmd_vel")
    assert passes(RuleKind.TOPIC, Direction.TO_ROS2, "/scan")
    assert passes(RuleKind.SERVICE, Direction.TO_ROS2, "/add_two_ints")
    assert passes(RuleKind.SERVICE, Direction.TO_ROS1, "/reset")
    assert not passes(RuleKind.SERVICE, Direction.TO_ROS2, "/reset")
    assert not passes(RuleKind.TOPIC, Direction.TO_ROS1, "/scan")


def test_the_size_of_the_carried_definitions_is_true() -> None:
    carried = source("pipros_rosbag2/interfaces/carried.msgs").read_bytes()

    sizes = (round(len(each) / 1000) for each in (carried, zlib.compress(carried)))

    assert "({} kB, {} kB in the wheel)".format(*sizes) in DOCUMENT
