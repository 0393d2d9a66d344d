from __future__ import annotations

from collections.abc import Callable
from math import pi

import pytest

from pipros_libraries.robot_model.joint_values import JointChoices, JointValues, MimicCircle
from pipros_libraries.robot_model.urdf import Joint, Mimic, Robot
from tests.support.steps import grows_linearly

JOINTS = (
    Joint("high", "revolute", "base", "a", limits=(1.0, 2.0)),
    Joint("wheel", "continuous", "a", "b"),
    Joint("weld", "fixed", "b", "c"),
    Joint("slide", "prismatic", "c", "d", limits=(-1.0, 1.0), soft_limits=(-0.5, 0.25)),
    Joint("copy", "revolute", "d", "e", limits=(0.0, 1.0), mimic=Mimic("slide", 2.0, 0.5)),
    Joint("bare", "revolute", "e", "f"),
)
ROBOT = Robot("r", ("base", "a", "b", "c", "d", "e", "f"), JOINTS)
NOTHING = JointChoices({}, {})


def test_joints_begin_at_zero_or_in_the_middle_of_their_range() -> None:
    values = JointValues(ROBOT, NOTHING)
    assert values.names == ["high", "wheel", "slide", "copy"]
    assert values.without_limits == ["bare"]
    assert values.columns() == ([1.5, 0, 0, 0.5], [], [])
    assert values.free["slide"] | {"min": -0.5, "max": 0.25} == values.free["slide"]


def test_choices_decide_which_values_are_published() -> None:
    choices = JointChoices(
        {"wheel": 0.75, "high": 0}, {}, mimic_tags=False, smallest_limits=False, velocities=True, efforts=True
    )
    values = JointValues(ROBOT, choices)
    assert values.columns() == ([1.5, 0.75, 0, 0], [0.0] * 4, [0.0] * 4)
    assert values.free["slide"]["max"] == 1.0
    assert JointValues(ROBOT, JointChoices({}, {}, mimic_tags=False, positions=False)).columns() == (
        [],
        [],
        [],
    )


def test_sources_report_their_values() -> None:
    values = JointValues(ROBOT, NOTHING)
    values.update(["slide", "unknown", "wheel"], position=[0.1, 9.0, 0.2], velocity=[], effort=[3.0])
    assert values.columns() == ([1.5, 0.2, 0.1, 0.7], [], [0.0, 0.0, 3.0, 3.0])


def test_a_chain_of_dependent_joints_is_followed_to_its_root() -> None:
    dependent = {
        "high": {"parent": "wheel", "factor": 2, "offset": 1},
        "slide": {"parent": "high", "factor": -1},
    }
    values = JointValues(ROBOT, JointChoices({"wheel": 0.5}, dependent))
    assert values.columns()[0] == [2.0, 0.5, -2.0, -3.5]


@pytest.mark.parametrize("parent", ["high", "slide"])
def test_a_circle_of_dependent_joints_is_refused(parent: str) -> None:
    dependent = {"high": {"parent": "slide"}, "slide": {"parent": parent}}
    with pytest.raises(MimicCircle, match="mimic joints form a cycle"):
        JointValues(ROBOT, JointChoices({}, dependent))


def test_a_sweep_goes_there_and_back_or_around() -> None:
    values = JointValues(ROBOT, JointChoices({}, {}, mimic_tags=False))
    seen = []
    for _ in range(4):
        values.sweep(0.3)
        seen.append(values.free["slide"]["position"])
    assert seen == pytest.approx([0.25, -0.05, -0.35, -0.5])
    values.free["wheel"]["position"] = pi
    values.sweep(0.1)
    assert values.free["wheel"]["position"] == -pi


@pytest.mark.parametrize("is_chain", [False, True], ids=["star", "chain"])
def test_publishing_costs_the_same_for_each_joint_however_long_the_chains(is_chain: bool) -> None:
    """A chain of 2,500 joints took 100 s."""

    def publish(count: int) -> Callable[[], object]:
        dependent = {
            f"j{number}": {"parent": f"j{number - 1 if is_chain else 0}"} for number in range(1, count)
        }
        joints = [Joint(f"j{number}", "continuous", "a", "b") for number in range(count)]
        values = JointValues(Robot("r", (), tuple(joints)), JointChoices({"j0": 0.5}, dependent))
        assert values.columns()[0] == [0.5] * count
        return values.columns

    assert grows_linearly(publish)
