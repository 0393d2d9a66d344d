from __future__ import annotations

from math import cos, pi, sin

import pytest

from pipros_libraries.robot_model.joint_poses import JointFrames, pose_of
from pipros_libraries.robot_model.urdf import Joint, Mimic, Robot

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
