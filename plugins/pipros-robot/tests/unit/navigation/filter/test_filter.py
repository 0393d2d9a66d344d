"""The filters against derivatives by differences, and estimates in closed form."""

import re
from dataclasses import replace
from math import inf
from typing import Any

import numpy as np
import pytest

from pipros_libraries.nodes.params import InvalidParameter, PrivateParameters
from pipros_libraries.transforms.pose import IDENTITY, Pose, from_roll_pitch_yaw
from pipros_robot.navigation.filter.health import problems
from pipros_robot.navigation.filter.kalman import Control, ExtendedKalmanFilter
from pipros_robot.navigation.filter.measurements import InputSettings, Readings
from pipros_robot.navigation.filter.settings import make_timeline, read_settings
from pipros_robot.navigation.filter.state import (
    OUT_OF_PLANE,
    SIZE,
    Array,
    Flags,
    Measurement,
    VelocityCommand,
    jacobian,
    transition,
    wrapped,
)
from pipros_robot.navigation.filter.timeline import GAP_S, Timeline
from pipros_robot.navigation.filter.unscented import UnscentedKalmanFilter

FILTERS = [ExtendedKalmanFilter, lambda **options: UnscentedKalmanFilter(alpha=1.0, **options)]
NO_NOISE = np.zeros((SIZE, SIZE))


def measured(index: int, value: float, variance: float, threshold: float = np.inf) -> Measurement:
    values, flags = np.zeros(SIZE), np.zeros(SIZE, bool)
    values[index], flags[index] = value, True
    return Measurement("test", 0.0, values, np.eye(SIZE) * variance, flags, threshold)


def moved(state: Array, delta_s: float) -> Array:
    return np.asarray(transition(state[3:6], delta_s) @ state)


@pytest.mark.parametrize("seed", range(5))
def test_the_jacobian_is_the_derivative_of_the_motion(seed: int) -> None:
    numbers = np.random.default_rng(seed)
    state = numbers.uniform(-1, 1, SIZE)
    step = 1e-6
    steps = step * np.eye(SIZE)
    columns = [(moved(state + each, 0.3) - moved(state - each, 0.3)) / (2 * step) for each in steps]

    found = jacobian(state, transition(state[3:6], 0.3), 0.3)

    np.testing.assert_allclose(found, np.array(columns).T, atol=1e-8)


def test_many_small_steps_follow_a_circle() -> None:
    kalman = ExtendedKalmanFilter(process_noise=NO_NOISE)
    kalman.state[6], kalman.state[11] = 1.0, 0.5  # a radius of 2 m
    for index in range(20_000):
        kalman.predict(index * 1e-4, 1e-4)

    assert kalman.state[:2] == pytest.approx([2 * np.sin(1.0), 2 - 2 * np.cos(1.0)], abs=1e-3)
    assert kalman.state[5] == pytest.approx(1.0)


@pytest.mark.parametrize("make", FILTERS)
def test_repeated_measurements_give_their_weighted_mean(make: type[ExtendedKalmanFilter]) -> None:
    kalman = make(covariance=np.eye(SIZE) * 4.0, process_noise=NO_NOISE)
    kalman.predict(0.0, 0.0)
    for value, variance in ((1.0, 1.0), (3.0, 0.5)):
        assert kalman.correct(measured(6, value, variance))
        if make is not ExtendedKalmanFilter:  # its covariance is genuine's, see docs/guides/navigation.md
            assert kalman.state[6] == pytest.approx(4.0 / 5.0)
            return

    weights = np.array([1 / 4.0, 1 / 1.0, 1 / 0.5])
    assert kalman.state[6] == pytest.approx(weights @ [0.0, 1.0, 3.0] / weights.sum())
    assert kalman.covariance[6, 6] == pytest.approx(1 / weights.sum())


def test_angles_are_corrected_the_short_way_round() -> None:
    kalman = ExtendedKalmanFilter(covariance=np.eye(SIZE))
    kalman.state[5] = np.pi - 0.1

    kalman.correct(measured(5, -np.pi + 0.1, 1.0))

    assert abs(kalman.state[5]) == pytest.approx(np.pi)


@pytest.mark.parametrize("make", FILTERS)
def test_unlikely_and_infinite_measurements_are_rejected(make: type[ExtendedKalmanFilter]) -> None:
    kalman = make(covariance=np.eye(SIZE) * 0.5)
    kalman.predict(0.0, 0.0)
    before = kalman.state.copy()

    assert not kalman.correct(measured(6, 2.0, 0.5, threshold=2.0))  # exactly two standard deviations
    assert not kalman.correct(measured(6, np.nan, 0.5))
    np.testing.assert_array_equal(kalman.state, before)
    assert kalman.correct(measured(6, 1.9, 0.5, threshold=2.0))


def test_negative_and_tiny_variances_are_corrected() -> None:
    noise = measured(0, 1.0, -2.0).noise(np.array([0]))
    tiny = measured(0, 1.0, 0.0).noise(np.array([0]))

    assert (noise[0, 0], tiny[0, 0]) == (2.0, 1e-9)


def test_the_noise_of_the_pose_grows_with_the_squared_speed() -> None:
    kalman = ExtendedKalmanFilter(process_noise=np.eye(SIZE), covariance=NO_NOISE, is_noise_dynamic=True)
    kalman.state[6], kalman.state[7] = 3.0, 4.0

    kalman.predict(0.1, 0.1)

    assert kalman.covariance[0, 0] == pytest.approx(0.1 * 25)
    assert kalman.covariance[8, 8] == pytest.approx(0.1)


def test_an_unmeasured_yaw_shortens_the_way_of_the_unscented_filter() -> None:
    """To second order, the expected cosine of a yaw with the variance v is 1 - v/2."""
    ways = []
    for kalman in (ExtendedKalmanFilter(), UnscentedKalmanFilter()):
        for step in range(300):
            kalman.predict(step / 30, 1 / 30)
            values = np.zeros(SIZE)
            values[6] = 0.3
            flags = np.zeros(SIZE, bool)
            flags[[2, 3, 4, 6, 7, 8, 9, 10, 11, 14]] = True
            kalman.correct(Measurement("wheels", step / 30, values, np.eye(SIZE) * 1e-3, flags))
        ways.append(kalman.state[0])
    shortened = sum(0.3 / 30 * (1 - 0.06 * step / 30 / 2) for step in range(300))
    assert ways == pytest.approx([3.0, shortened], abs=0.03)


def test_an_impossible_covariance_does_not_stop_the_unscented_filter() -> None:
    kalman = UnscentedKalmanFilter(covariance=np.eye(SIZE))
    kalman.covariance[0, 2] = kalman.covariance[2, 0] = 2.0

    kalman.predict(0.1, 0.1)

    assert np.isfinite(kalman.covariance).all()


@pytest.mark.parametrize(("velocity", "command", "age_s", "expected"), [
    (0.0, 1.0, 0.0, 0.5),  # the gain
    (0.0, 10.0, 0.0, 2.0),  # the limit
    (1.0, 0.5, 0.0, -0.25),  # slower: the gain of deceleration is the same, its limit smaller
    (3.0, -3.0, 0.0, -1.0),  # the other direction: the limit of deceleration
    (1.0, 1.0, 9.0, -0.5),  # too old: stop
])  # fmt: skip
def test_commands_accelerate_within_limits(
    velocity: float, command: float, age_s: float, expected: float
) -> None:
    axes = np.ones(6)
    only_x = np.array([True] + [False] * 5)
    control = Control(only_x, 2 * axes, 0.5 * axes, 1 * axes, 0.5 * axes, timeout_s=1.0)
    control.command = VelocityCommand(command * axes, time_s=0.0)

    _, found = control.accelerations(velocity * axes, age_s)

    assert found.tolist() == [expected, 0, 0, 0, 0, 0]


def test_angles_are_wrapped() -> None:
    angles = np.array([0.5, np.pi, -np.pi, 4.0, -4.0, 20.0])

    expected = [0.5, np.pi, -np.pi, 4 - 2 * np.pi, 2 * np.pi - 4, 20 - 6 * np.pi]
    np.testing.assert_allclose(wrapped(angles), expected)


# The order in which measurements reach the filter.


def at(time_s: float, value: float, index: int = 6) -> Measurement:
    return replace(measured(index, value, 0.1), time_s=time_s)


def timeline(**options: float) -> Timeline:
    return Timeline(ExtendedKalmanFilter(), sensor_timeout_s=0.5, **options)


def test_the_first_measurement_is_taken_over() -> None:
    time = timeline()
    assert not time.has_started

    time.add(at(1.0, 2.0))
    time.advance(1.0)

    assert (time.time_s, time.kalman.state[6]) == (1.0, 2.0)
    assert time.kalman.covariance[6, 6] == 0.1


def test_measurements_of_the_future_wait() -> None:
    time = timeline()
    time.add(at(3.0, 2.0))
    time.add(at(1.0, 1.0))
    time.advance(2.0)
    assert time.time_s == 1.0

    time.advance(3.0)

    assert time.time_s == 3.0


def test_late_measurements_have_the_same_effect_as_in_time() -> None:
    in_time, late = timeline(), timeline(history_s=10.0)
    for measurement in (at(1.0, 1.0), at(1.4, 1.5, 0), at(1.5, 2.0), at(1.7, 0.3, 5), at(2.0, 2.5)):
        in_time.add(measurement)
    in_time.advance(2.0)
    for measurement in (at(1.0, 1.0), at(1.5, 2.0), at(2.0, 2.5), at(1.7, 0.3, 5), at(1.4, 1.5, 0)):
        late.add(measurement)
        late.advance(2.0)

    np.testing.assert_allclose(late.kalman.state, in_time.kalman.state, atol=1e-12)
    np.testing.assert_allclose(late.kalman.covariance, in_time.kalman.covariance, atol=1e-12)
    assert not late.is_history_too_short


def test_measurements_that_are_applied_again_are_predicted_with_their_commands() -> None:
    axes = np.ones(6)
    in_time, late = timeline(history_s=10.0), timeline(history_s=10.0)
    orders = (
        (in_time, (at(1.0, 0.5), at(1.4, 0.0, 5), at(1.5, 0.7), at(2.0, 1.5))),
        (late, (at(1.0, 0.5), at(1.5, 0.7), at(2.0, 1.5), at(1.4, 0.0, 5))),
    )
    for time, measurements in orders:
        time.kalman.control = Control(np.ones(6, bool), axes, axes, axes, axes, timeout_s=5.0)
        for measurement in measurements:
            time.add(measurement)
            time.advance(2.0)
            time.kalman.control.command = VelocityCommand(2.0 * axes, time_s=1.0)

    np.testing.assert_allclose(late.kalman.state, in_time.kalman.state, atol=1e-12)
    assert late.kalman.control is not None
    assert late.kalman.control.command is not None


def test_a_history_that_is_too_short_is_reported() -> None:
    time = timeline(history_s=0.1)
    for measurement in (at(1.0, 1.0), at(1.5, 2.0), at(1.2, 2.0)):
        time.add(measurement)
        time.advance(2.0 if measurement.time_s > 1 else 1.0)

    assert time.is_history_too_short
    assert time.time_s == 1.5


def test_without_a_history_late_measurements_correct_the_newest_state() -> None:
    time = timeline()
    for measurement in (at(1.0, 1.0), at(2.0, 1.0), at(1.5, 3.0)):
        time.add(measurement)
        time.advance(2.0)

    assert time.time_s == 2.0
    assert time.kalman.state[6] > 1.0


def test_the_state_is_predicted_after_the_timeout() -> None:
    time = timeline()
    time.add(at(1.0, 2.0))
    time.advance(1.0)
    time.advance(1.4)
    assert time.time_s == 1.0

    time.advance(1.5)

    assert (time.time_s, time.kalman.state[0]) == (1.5, pytest.approx(1.0))


def test_a_change_of_clocks_is_not_predicted() -> None:
    time = timeline()
    for stamp_s in (1.0, 2.0 + GAP_S):
        time.add(at(stamp_s, 2.0))
        time.advance(stamp_s)

    assert time.time_s == 2.0 + GAP_S
    assert time.kalman.state[0] == pytest.approx(0.02, abs=1e-3)


def test_a_reset_returns_to_the_first_estimate() -> None:
    time = timeline()
    time.add(at(1.0, 2.0))
    time.advance(1.0)

    time.reset()

    assert not time.has_started
    assert not time.kalman.state.any()


# Measurements from data in other frames, and from differences of poses.


FRAMES: dict[tuple[str, str], Pose] = {
    ("odom", "start"): (1.0, 2.0, 0.0, *from_roll_pitch_yaw(0, 0, np.pi / 2)),
    ("base_link", "imu"): (0.5, 0.0, 0.0, *from_roll_pitch_yaw(0, 0, np.pi / 2)),
    ("base_link", "under"): (0.0, 0.0, 0.0, *from_roll_pitch_yaw(np.pi, 0, 0)),
}
SIX = np.diag([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])


def readings(**options: bool) -> Readings:
    given = {"in_plane": False, **options}
    return Readings("odom", "base_link", lambda *frames: FRAMES.get(frames[:2]), gravity=9.8, **given)


def flags(*indices: int) -> Flags:
    found = np.zeros(SIZE, bool)
    found[list(indices)] = True
    return found


def test_a_pose_is_converted_with_its_flags_and_covariance() -> None:
    forward = (1.0, 0.0, 0.0, *IDENTITY[3:])
    found = readings().pose(InputSettings("a", flags(0, 5)), "start", 10**9, forward, SIX)

    assert found is not None
    assert found.values[:6] == pytest.approx([1.0, 3.0, 0.0, 0.0, 0.0, np.pi / 2])
    assert np.flatnonzero(found.flags).tolist() == [1, 5]
    np.testing.assert_allclose(found.covariance.diagonal()[:6], [2, 1, 3, 5, 4, 6])
    assert found.time_s == 1.0


def test_an_unknown_frame_gives_nothing_but_the_target_itself_is_known() -> None:
    made = readings()

    assert made.pose(InputSettings("a", flags(0)), "mars", 0, IDENTITY, SIX) is None
    assert made.pose(InputSettings("a", flags(0)), "odom", 0, IDENTITY, SIX) is not None
    assert made.pose(InputSettings("a", flags(0)), "", 0, IDENTITY, SIX) is not None


def test_a_differential_pose_measures_velocity_from_the_second_on() -> None:
    made, own = readings(), InputSettings("a", flags(0, 1, 5), is_differential=True)
    turned = from_roll_pitch_yaw(0, 0, np.pi / 2)
    assert made.pose(own, "odom", 10**9, (1.0, 1.0, 0.0, *turned), SIX) is None

    found = made.pose(own, "odom", 3 * 10**9, (1.0, 2.0, 0.0, *turned), SIX)

    assert found is not None
    assert found.values[6:12] == pytest.approx([0.5, 0, 0, 0, 0, 0])  # forward, though along y of the world
    assert np.flatnonzero(found.flags).tolist() == [6, 7, 11]
    assert found.covariance[6, 6] == pytest.approx((1.0 + 1.0) * 2.0)
    assert made.pose(own, "odom", 3 * 10**9, IDENTITY, SIX) is None  # no time has passed


def test_a_relative_pose_begins_at_zero() -> None:
    made, own = readings(), InputSettings("a", flags(0, 1, 5), is_relative=True)
    start: Pose = (4.0, 5.0, 0.0, *from_roll_pitch_yaw(0, 0, np.pi))
    made.pose(own, "odom", 0, start, SIX)

    found = made.pose(own, "odom", 10**9, (3.0, 5.0, 0.0, *start[3:]), SIX)

    assert found is not None
    assert found.values[:3] == pytest.approx([1.0, 0.0, 0.0])


def test_a_sensor_off_the_center_moves_when_the_robot_turns() -> None:
    made = readings()
    made.state = np.zeros(SIZE)
    made.state[11] = 2.0

    twist = made.twist(InputSettings("a", flags(6)), "imu", 0, np.zeros(6), SIX)
    push = made.acceleration(InputSettings("a", flags(12)), "imu", 0, np.zeros(3), np.eye(3), None)

    assert twist is not None
    assert push is not None
    # the sensor stands still, so the center moves
    assert twist.values[6:9] == pytest.approx([0.0, -1.0, 0.0])
    # ω² r: the center is pulled around the sensor
    assert push.values[12:15] == pytest.approx([2.0, 0.0, 0.0])


def test_gravity_is_removed_with_the_attitude() -> None:
    made, own = readings(), InputSettings("a", flags(12, 14), removes_gravity=True)
    tilted: Pose = (0.0, 0.0, 0.0, *from_roll_pitch_yaw(0.3, 0.2, 1.0))
    upside: Pose = (0.0, 0.0, 0.0, *from_roll_pitch_yaw(np.pi, 0.0, 0.0))
    down = [-np.sin(0.2), np.cos(0.2) * np.sin(0.3), np.cos(0.2) * np.cos(0.3)]
    measured = 9.8 * np.array(down)

    level = made.acceleration(own, "base_link", 0, measured, np.eye(3), tilted)
    under = made.acceleration(own, "under", 0, np.array([0.0, 0.0, -9.8]), np.eye(3), upside)
    unknown = made.acceleration(own, "under", 0, np.array([0.0, 0.0, -9.8]), np.eye(3), None)

    for found in (level, under, unknown):
        assert found is not None
        assert found.values[12:15] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)


def test_in_the_plane_everything_else_is_zero_with_certainty() -> None:
    found = readings(in_plane=True).twist(InputSettings("a", flags(6)), "", 0, np.ones(6), SIX)

    assert found is not None
    assert found.flags[OUT_OF_PLANE].all()
    assert not found.values[OUT_OF_PLANE].any()
    np.testing.assert_allclose(found.covariance.diagonal()[OUT_OF_PLANE], 1e-6)


# The parameters of the filter nodes.


ALL = [True] * 15
NONE = [False] * 15


def settings(prefix: str = "", **values: Any) -> Any:
    return read_settings(PrivateParameters(values), prefix)


def test_defaults_and_prefix() -> None:
    found = settings("robot1")

    assert (found.frequency, found.world_frame, found.base_link_frame_output) == (
        30.0, "robot1/odom", "robot1/base_link"
    )  # fmt: skip
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
        "odom0": [[0, 1, 2, 3, 4, 5], [6, 7, 8, 9, 10, 11], []], "pose0": [[0, 1, 2, 3, 4, 5], [], []],
        "twist0": [[], [6, 7, 8, 9, 10, 11], []], "imu0": [[3, 4, 5], [9, 10, 11], [12, 13, 14]],
    }  # fmt: skip
    odom, pose, twist, imu = found.topics
    assert (odom.pose.is_differential, odom.pose.is_relative, odom.pose.threshold) == (True, False, 3.0)
    assert (pose.pose.threshold, twist.twist.threshold) == (inf, 2.5)
    assert imu.pose.is_relative
    assert imu.acceleration.is_relative


@pytest.mark.parametrize(("values", "text"), [
    ({"frequency": 0}, "~frequency must be > 0 and finite, got 0.0"),
    ({"frequency": float("inf")}, "~frequency must be a finite number, got inf"),
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
        settings(odom0="a", odom0_config=position, pose0="b", pose0_config=position, twist0="c",
            twist0_config=NONE, two_d_mode=True),
    )  # fmt: skip

    assert {name: level for name, (level, _) in found.items()} == {"X": 1, "Y": 1, "YAW": 2, "twist0": 1}
