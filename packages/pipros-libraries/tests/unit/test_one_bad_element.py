"""One bad element among good ones closes only itself, whether it is the first, in the middle or the last."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import pytest

from pipros.basics.names import valid_topics
from pipros_libraries.diagnostics.aggregation import Aggregation
from pipros_libraries.diagnostics.items import ERROR, OK, ComponentStatus
from pipros_libraries.robot_model.joint_values import JointChoices, JointValues
from pipros_libraries.robot_model.urdf import Joint, Robot
from pipros_libraries.transforms.buffer import TransformBuffer

T = TypeVar("T")
PLACES = pytest.mark.parametrize("place", range(3), ids=["first", "middle", "last"])
GOOD = ["one", "two"]
ROBOT = Robot("r", (), tuple(Joint(name, "continuous", "a", "b") for name in ("one", "bad", "two")))


def among(place: int, bad: T, make: Callable[[str], T]) -> list[T]:
    """Return what `make` returns for both good names, with `bad` at a place."""
    found = [make(name) for name in GOOD]
    found.insert(place, bad)
    return found


NAN, HUGE = math.nan, 1e308
UNIT = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
TRANSFORMS: dict[str, tuple[str, str, int, Sequence[float]]] = {
    "a NaN": ("map", "bad", 1, (NAN, *UNIT[1:])),
    "no rotation": ("map", "bad", 1, (0.0,) * 7),
    "a huge rotation": ("map", "bad", 1, (0.0, 0.0, 0.0, HUGE, HUGE, 0.0, 1.0)),
    "its own parent": ("bad", "bad", 1, UNIT),
    "no parent": ("", "bad", 1, UNIT),
    "no name": ("map", "", 1, UNIT),
    "a time before 1970": ("map", "bad", -1, UNIT),
}


@PLACES
@pytest.mark.parametrize("bad", TRANSFORMS)
def test_of_transforms(bad: str, place: int) -> None:
    buffer = TransformBuffer()
    good: Callable[[str], Any] = lambda name: ("map", name, 1, UNIT)  # noqa: E731
    reasons = [
        reason
        for parent, child, stamp, pose in among(place, TRANSFORMS[bad], good)
        for reason in buffer.insert(parent, child, stamp, tuple(pose), "/node")  # type: ignore[arg-type]
    ]
    assert all(buffer.can_transform("map", name, 0) is None for name in GOOD)
    assert len(reasons) >= 1
    assert all("/node" in reason for reason in reasons)


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


@PLACES
@pytest.mark.parametrize("bad", [5, "", "/", "a b", "1st", None], ids=repr)
def test_of_topics_in_a_parameter(bad: Any, place: int) -> None:
    complaints: list[str] = []
    assert valid_topics("source_list", among(place, bad, str), complaints.append) == GOOD
    assert complaints == [f"source_list: {bad!r} is not a topic name; it is left out"]


@pytest.mark.parametrize("given", ["joints", 5, {"a": 1}])
def test_a_parameter_that_is_not_a_list_of_topics_is_ignored(given: Any) -> None:
    complaints: list[str] = []
    assert valid_topics("source_list", given, complaints.append) == []
    assert complaints == [f"source_list must be a list of topics, got {given!r}; it is ignored"]


def test_rules_for_joints_can_be_changed_while_the_values_are_used() -> None:
    values = JointValues(ROBOT, JointChoices({"one": 0.5}, {"two": {"parent": "one"}}))
    assert values.columns()[0] == [0.5, 0, 0.5]
    values.dependent["two"] = {"parent": "one", "factor": 2.0}
    assert values.columns()[0] == [0.5, 0, 1.0]
