"""The parameters of the filter nodes."""

from __future__ import annotations

import re
from math import inf
from typing import Any

import numpy as np
import pytest

from pipros_libraries.nodes.params import InvalidParameter, PrivateParameters
from pipros_robot.navigation.filter.health import problems
from pipros_robot.navigation.filter.settings import make_timeline, read_settings
from pipros_robot.navigation.filter.unscented import UnscentedKalmanFilter

ALL = [True] * 15
NONE = [False] * 15


def settings(prefix: str = "", **values: Any) -> Any:
    return read_settings(PrivateParameters(values), prefix)


def test_defaults_and_prefix() -> None:
    found = settings("robot1")

    assert (found.frequency, found.world_frame, found.base_link_frame_output) == (
        30.0,
        "robot1/odom",
        "robot1/base_link",
    )
    assert found.topics == ()


def test_inputs_use_the_variables_of_their_messages() -> None:
    found = settings(
        odom0="a", odom0_config=ALL, pose0="b", pose0_config=ALL, twist0="c", twist0_config=ALL,
        imu0="d", imu0_config=ALL, imu0_relative=True, imu2="not numbered without a gap",
        odom0_differential=True, odom0_relative=True, odom0_pose_rejection_threshold=3,
        twist0_rejection_threshold=2.5,
    )  # fmt: skip
    used = {
        topic.name: [
            np.flatnonzero(own.flags).tolist() for own in (topic.pose, topic.twist, topic.acceleration)
        ]
        for topic in found.topics
    }

    assert used == {
        "odom0": [[0, 1, 2, 3, 4, 5], [6, 7, 8, 9, 10, 11], []],
        "pose0": [[0, 1, 2, 3, 4, 5], [], []],
        "twist0": [[], [6, 7, 8, 9, 10, 11], []],
        "imu0": [[3, 4, 5], [9, 10, 11], [12, 13, 14]],
    }
    odom, pose, twist, imu = found.topics
    assert (odom.pose.is_differential, odom.pose.is_relative, odom.pose.threshold) == (True, False, 3.0)
    assert (pose.pose.threshold, twist.twist.threshold) == (inf, 2.5)
    assert imu.pose.is_relative
    assert imu.acceleration.is_relative


@pytest.mark.parametrize(("values", "text"), [
    ({"frequency": 0}, "~frequency must be > 0 and finite, got 0.0"),
    ({"frequency": float("inf")}, "~frequency must be > 0 and finite, got inf"),
])  # fmt: skip
def test_settings_that_cannot_work_are_explained(values: dict[str, Any], text: str) -> None:
    with pytest.raises(InvalidParameter, match=re.escape(text)):
        settings(**values)


def test_matrices_may_have_integers_but_not_another_length() -> None:
    made = make_timeline(PrivateParameters({"initial_estimate_covariance": [1] * 225, "use_control": True,
                                     "control_config": [True] * 6}), unscented=False)  # fmt: skip

    assert made.kalman.covariance.sum() == 225.0


@pytest.mark.parametrize(("config", "flags"), [
    (None, []), ([True] * 12, list(range(12))), ([True, True, 1, True], [0, 1]), ([1] * 15, []),
    ([True] * 20, list(range(15))), ("true", []),
])  # fmt: skip
def test_a_filter_runs_with_what_a_config_says_and_names_the_mistake(config: Any, flags: list[int]) -> None:
    values = {"odom0": "a", "imu0": "b", "imu0_config": ALL} | (
        {} if config is None else {"odom0_config": config}
    )
    given = PrivateParameters(values)
    odom, imu = read_settings(given, "").topics
    used = odom.pose.flags | odom.twist.flags
    assert np.flatnonzero(used).tolist() == [flag for flag in flags if flag < 12]
    assert imu.is_used
    (problem,) = given.problems
    assert problem.startswith(f"~odom0_config must be a list of 15 booleans, got {config!r}")


def test_a_filter_runs_with_equal_frames_and_names_them() -> None:
    given = PrivateParameters({"map_frame": "odom"})
    assert read_settings(given, "").map_frame == "odom"
    (problem,) = given.problems
    assert "must differ, got odom, odom, base_link" in problem


@pytest.mark.parametrize("name", ["process_noise_covariance", "initial_estimate_covariance", "initial_state"])
@pytest.mark.parametrize("value", [[0.5], [0.5] * 16, "0.5", [[0.5] * 15] * 15])
def test_a_filter_runs_with_defaults_for_lists_of_another_length(name: str, value: Any) -> None:
    given, usual = PrivateParameters({name: value}), PrivateParameters({})
    made, expected = (make_timeline(each, unscented=False).kalman for each in (given, usual))
    assert (made.covariance == expected.covariance).all()
    assert (made.state == expected.state).all()
    (problem,) = given.problems
    assert re.match(rf"~{name} must be a list of \d+ numbers, got .*; the default is used", problem)


def test_the_unscented_filter_is_another_filter() -> None:
    assert isinstance(make_timeline(PrivateParameters({}), unscented=True).kalman, UnscentedKalmanFilter)


def test_parameters_follow_the_rules_of_roscpp() -> None:
    given = PrivateParameters({"width": 2.5, "on": 1, "name": 7, "list": [1, "2"], "nan": float("nan")})

    assert (given.integer("width", 0), given.number("on", 0.0)) == (3, 1.0)
    assert (given.boolean("on", False), given.text("name", "x"), given.integer("nan", 4)) == (False, "x", 4)


def test_problems_of_the_configuration_are_diagnosed() -> None:
    position = [True, True, *NONE[2:]]
    found = problems(
        settings(
            odom0="a",
            odom0_config=position,
            pose0="b",
            pose0_config=position,
            twist0="c",
            twist0_config=NONE,
            two_d_mode=True,
        )
    )

    assert {name: level for name, (level, _) in found.items()} == {"X": 1, "Y": 1, "YAW": 2, "twist0": 1}
