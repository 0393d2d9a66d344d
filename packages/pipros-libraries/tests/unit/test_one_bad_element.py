"""One bad element among good ones closes only itself, whether it is the first, in the middle or the last."""

import math
from typing import Any

import pytest

from pipros_libraries.diagnostics.aggregation import Aggregation
from pipros_libraries.diagnostics.items import ERROR, OK, ComponentStatus
from pipros_libraries.robot_model.joint_values import JointChoices, JointValues
from pipros_libraries.robot_model.urdf import Joint, Robot

PLACES = pytest.mark.parametrize("place", range(3), ids=["first", "middle", "last"])
GOOD = ["one", "two"]
ROBOT = Robot("r", (), tuple(Joint(name, "continuous", "a", "b") for name in ("one", "bad", "two")))


ANALYZERS: dict[str, Any] = {
    "a number": 5,
    "no type": {"path": "Bad"},
    "a type in C++": {"type": "vendor/Special", "path": "Bad", "startswith": "x"},
    "an invalid expression": {"type": "GenericAnalyzer", "path": "Bad", "regex": "("},
    "a list as a timeout": {"type": "GenericAnalyzer", "path": "Bad", "startswith": "x", "timeout": []},
    "nothing to match": {"type": "GenericAnalyzer", "path": "Bad"},
}


@PLACES
@pytest.mark.parametrize("bad", ANALYZERS)
def test_of_analyzers(bad: str, place: int) -> None:
    described = {name: {"type": "GenericAnalyzer", "path": name, "startswith": name} for name in GOOD}
    name = ["a", "p", "z"][place]  # analyzers are sorted by name
    aggregation = Aggregation("Robot", {**described, name: ANALYZERS[bad]})
    for each in GOOD:
        aggregation.take(ComponentStatus(f"{each} motor", OK, "fine"), 0.0)
    reported = {status.name: status for status in aggregation.report(1.0)}
    assert [reported[f"/Robot/{each}/{each} motor"].level for each in GOOD] == [OK, OK]
    assert reported[f"/Robot/{name}"].level == reported["/Robot"].level == ERROR
    assert list(aggregation.problems()) == [f"/Robot/{name}"]


@PLACES
@pytest.mark.parametrize("bad", ["text", math.inf, None, [1.0], True], ids=str)
def test_of_initial_joint_positions(bad: Any, place: int) -> None:
    names = ["one", "two"]
    names.insert(place, "bad")
    values = JointValues(ROBOT, JointChoices({name: bad if name == "bad" else 0.5 for name in names}, {}))
    assert dict(zip(values.names, values.columns()[0], strict=True)) == {"one": 0.5, "bad": 0, "two": 0.5}
    assert values.problems == [f"zeros: bad must be a finite number, got {bad!r}"]


@PLACES
@pytest.mark.parametrize("bad", ["one", 3, {"parent": "one", "factor": "text"}], ids=str)
def test_of_rules_for_dependent_joints(bad: Any, place: int) -> None:
    names = ["two", "three"]
    names.insert(place, "bad")
    rules = {name: bad if name == "bad" else {"parent": "one"} for name in names}
    values = JointValues(ROBOT, JointChoices({"one": 0.25}, rules))
    assert dict(zip(values.names, values.columns()[0], strict=True)) == {"one": 0.25, "bad": 0, "two": 0.25}
    assert values.problems == [
        f"dependent_joints: bad must be a mapping with parent, factor and offset, got {bad!r}"
    ]


def test_rules_for_joints_can_be_changed_while_the_values_are_used() -> None:
    values = JointValues(ROBOT, JointChoices({"one": 0.5}, {"two": {"parent": "one"}}))
    assert values.columns()[0] == [0.5, 0, 0.5]
    values.dependent["two"] = {"parent": "one", "factor": 2.0}
    assert values.columns()[0] == [0.5, 0, 1.0]
