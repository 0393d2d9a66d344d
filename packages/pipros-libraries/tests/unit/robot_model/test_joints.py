"""Values of joints, and the poses of their links."""

from collections.abc import Callable
from math import cos, pi, sin

import pytest

from pipros_libraries.robot_model.joint_poses import JointFrames, pose_of
from pipros_libraries.robot_model.joint_values import JointChoices, JointValues, MimicCircle
from pipros_libraries.robot_model.urdf import Joint, Mimic, Robot
from tests.support.steps import grows_linearly

LINKS = ("base", "upper", "lower", "tool", "cart", "eye")


TURN = Joint("turn", "revolute", "base", "upper", origin=(1, 0, 0, 0, 0, sin(pi / 4), cos(pi / 4)))


COPY = Joint("copy", "continuous", "upper", "lower", axis=(0, 0, 1), mimic=Mimic("turn", -1.0, 0.5))


SLIDE = Joint("slide", "prismatic", "lower", "tool", axis=(0, 1, 0))


ROBOT = Robot(
    "r",
    LINKS,
    (TURN, COPY, SLIDE, Joint("weld", "fixed", "tool", "cart"), Joint("fly", "floating", "base", "eye")),
)


def test_a_revolute_joint_turns_about_its_axis_after_its_origin() -> None:
    x, y, z, a, b, c, d = pose_of(TURN, pi)
    assert (x, y, z) == (1, 0, 0)
    assert (a, b, c, d) == pytest.approx((cos(pi / 4), sin(pi / 4), 0, 0))


def test_a_prismatic_joint_slides() -> None:
    assert pose_of(SLIDE, 0.25) == pytest.approx((0, 0.25, 0, 0, 0, 0, 1))


def test_joints_are_sorted_by_what_is_sent_when() -> None:
    frames = JointFrames(ROBOT, 100)
    assert list(frames.moving) == ["turn", "copy", "slide"]
    assert [joint.name for joint in frames.fixed] == ["weld"]
    assert [joint.name for joint in frames.floating] == ["fly"]


def test_a_joint_moves_the_joint_that_mimics_it() -> None:
    due = JointFrames(ROBOT, 100).due(["turn", "unknown"], [0.5, 1.0], 1000)
    assert [joint.name for joint, _ in due] == ["copy", "turn"]
    assert due[0][1] == (0, 0, 0, 0, 0, 0, 1)  # -0.5 + 0.5
    (copied, *_) = JointFrames(ROBOT, 100).due(["turn"], [0.0], 1000)
    assert copied[1] == pytest.approx((0, 0, 0, 0, 0, sin(0.25), cos(0.25)))


def test_the_value_of_a_joint_wins_over_the_joint_that_it_mimics() -> None:
    due = JointFrames(ROBOT, 100).due(["turn", "copy"], [0.5, 0.0], 1000)
    assert due[0][1] == (0, 0, 0, 0, 0, 0, 1)


def test_joints_are_sent_when_the_one_that_waited_longest_is_due() -> None:
    frames = JointFrames(ROBOT, 100)
    assert frames.due(["turn"], [0.0], 1000)
    assert not frames.due(["turn"], [0.0], 1099)
    assert len(frames.due(["turn", "slide"], [0.0, 0.0], 1050)) == 3
    assert not frames.due(["turn", "slide"], [0.0, 0.0], 1149)
    assert frames.due(["turn"], [0.0], 1150)
    assert frames.due([], [], 5000) == []


def test_with_every_message_older_timestamps_are_due_too() -> None:
    frames = JointFrames(ROBOT, 100, every_message=True)
    assert frames.due(["turn"], [0.0], 1000)
    assert frames.due(["turn"], [0.0], 0)


def test_a_clock_jump_backwards_resets_the_times() -> None:
    frames = JointFrames(ROBOT, 100)
    frames.due(["turn"], [0.0], 1000)
    assert not frames.due(["turn"], [0.0], 500)
    frames.forget_times()
    assert frames.due(["turn"], [0.0], 500)


# Joint values


JOINTS = (
    Joint("high", "revolute", "base", "a", limits=(1.0, 2.0)),
    Joint("wheel", "continuous", "a", "b"),
    Joint("weld", "fixed", "b", "c"),
    Joint("slide", "prismatic", "c", "d", limits=(-1.0, 1.0), soft_limits=(-0.5, 0.25)),
    Joint("copy", "revolute", "d", "e", limits=(0.0, 1.0), mimic=Mimic("slide", 2.0, 0.5)),
    Joint("bare", "revolute", "e", "f"),
)


RANGES = Robot("r", ("base", "a", "b", "c", "d", "e", "f"), JOINTS)


NOTHING = JointChoices({}, {})


def test_joints_begin_at_zero_or_in_the_middle_of_their_range() -> None:
    values = JointValues(RANGES, NOTHING)
    assert values.names == ["high", "wheel", "slide", "copy"]
    assert (values.without_limits, values.columns()) == (["bare"], ([1.5, 0, 0, 0.5], [], []))
    assert values.free["slide"] | {"min": -0.5, "max": 0.25} == values.free["slide"]


def test_choices_decide_which_values_are_published() -> None:
    choices = JointChoices(
        {"wheel": 0.75, "high": 0}, {}, mimic_tags=False, smallest_limits=False, velocities=True, efforts=True
    )
    values = JointValues(RANGES, choices)
    assert values.columns() == ([1.5, 0.75, 0, 0], [0.0] * 4, [0.0] * 4)
    assert values.free["slide"]["max"] == 1.0
    assert JointValues(RANGES, JointChoices({}, {}, mimic_tags=False, positions=False)).columns() == (
        [], [], [],
    )  # fmt: skip


def test_sources_report_their_values() -> None:
    values = JointValues(RANGES, NOTHING)
    values.update(["slide", "unknown", "wheel"], position=[0.1, 9.0, 0.2], velocity=[], effort=[3.0])
    assert values.columns() == ([1.5, 0.2, 0.1, 0.7], [], [0.0, 0.0, 3.0, 3.0])


def test_a_chain_of_dependent_joints_is_followed_to_its_root() -> None:
    dependent = {
        "high": {"parent": "wheel", "factor": 2, "offset": 1},
        "slide": {"parent": "high", "factor": -1},
    }
    values = JointValues(RANGES, JointChoices({"wheel": 0.5}, dependent))
    assert values.columns()[0] == [2.0, 0.5, -2.0, -3.5]


@pytest.mark.parametrize("parent", ["high", "slide"])
def test_a_circle_of_dependent_joints_is_refused(parent: str) -> None:
    dependent = {"high": {"parent": "slide"}, "slide": {"parent": parent}}
    with pytest.raises(MimicCircle, match="mimic joints form a cycle"):
        JointValues(RANGES, JointChoices({}, dependent))


def test_a_sweep_goes_there_and_back_or_around() -> None:
    values = JointValues(RANGES, JointChoices({}, {}, mimic_tags=False))
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
