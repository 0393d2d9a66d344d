import pytest

from pipros.basics.errors import PiprosError
from pipros_libraries.teleoperation.velocity_mux import SOURCES, VelocitySource
from pipros_robot.navigation.velocities.cmd_vel_mux import CmdVelMux, read_sources
from pipros_robot.navigation.velocities.safety_controller_node import CENTER, LEFT, RIGHT, escape
from pipros_robot.navigation.velocities.velocity_smoother import Feedback, VelocityLimits, VelocitySmoother

CONFIGURATION = """
subscribers:
  - {name: Navigation, topic: input/navigation, timeout: 0.5, priority: 1, short_desc: plans}
  - {name: Never, topic: input/never, timeout: 0, priority: 9}
  - {name: Odd, topic: "a b", timeout: 1, priority: 9}
  - {name: Safety, topic: /safety, timeout: 1, priority: 10}
"""


def source(name: str, priority: int) -> VelocitySource:
    return VelocitySource(name, name, 0.5, priority)


def test_a_source_keeps_control_until_it_is_silent_or_a_more_important_one_sends() -> None:
    mux, low, same, high = CmdVelMux(), source("low", 0), source("same", 0), source("high", 5)
    mux.replace([same, low, high])
    assert mux.expire(10.0)
    assert mux.active is None
    assert mux.passes(low, 10.0)
    assert not mux.passes(same, 10.1)
    assert mux.passes(high, 10.2)
    assert not mux.passes(low, 10.6)
    assert not mux.expire(10.8)
    assert mux.active is None
    assert mux.passes(same, 10.9)
    assert mux.expire(11.5)


def test_a_source_does_not_stay_active_after_time_has_moved_back() -> None:
    mux, low, high = CmdVelMux(), source("low", 0), source("high", 5)
    mux.replace([low, high])
    assert mux.passes(high, 100.0)
    assert mux.passes(low, 3.0)


def test_an_active_source_stays_active_if_the_new_configuration_has_its_name() -> None:
    mux, old = CmdVelMux(), source("old", 0)
    mux.replace([old])
    assert mux.passes(old, 10.0)
    new, other = source("old", 3), source("other", 2)
    mux.replace([new, other])
    assert mux.active is new
    assert not mux.passes(other, 10.4)
    mux.replace([source("other", 2)])
    assert mux.active is None


def test_a_configuration_names_the_sources_and_the_output() -> None:
    problems: list[str] = []
    sources, output = read_sources(CONFIGURATION, problems.append)
    assert [(each.name, each.topic, each.timeout_s, each.priority) for each in sources] == [
        ("Navigation", "input/navigation", 0.5, 1),
        ("Safety", "/safety", 1.0, 10),
    ]
    assert output == "output"
    assert problems == [
        "subscribers[2]: topic must be the name of a topic, got 'a b'",
        "subscribers: the timeout of 'Never' must be > 0, got 0",
    ]
    assert read_sources(CONFIGURATION + "publisher: cmd", problems.append)[1] == "cmd"


@pytest.mark.parametrize(("text", "problem"), [
    ("- a", "it must be a mapping"), ("{", "<string>:2:1"),
    ("subscribers: 3", "`subscribers` has no valid source"),
    ("publisher: [a]", r"publisher must be the name of a topic, got \['a'\]"),
    ("publisher: a b", "publisher must be the name of a topic, got 'a b'"),
])  # fmt: skip
def test_invalid_configurations_are_errors(text: str, problem: str) -> None:
    with pytest.raises(PiprosError, match=problem):
        read_sources(text, lambda _: None)


def test_a_configuration_with_too_many_sources_is_an_error() -> None:
    problems: list[str] = []
    with pytest.raises(PiprosError, match="no valid source"):
        read_sources(f"subscribers: {[{}] * (SOURCES + 1)}", problems.append)
    assert problems == ["subscribers must have at most 100 sources, got 101"]


def test_a_robot_backs_away_from_its_obstacle_and_stops_at_a_dropped_wheel() -> None:
    assert escape([]) is None
    assert escape([("bumper", RIGHT), ("cliff", LEFT), ("cliff", CENTER)]) == (-0.1, 0.0)
    assert escape([("bumper", RIGHT), ("cliff", LEFT)]) == (-0.1, -0.4)
    assert escape([("bumper", RIGHT)]) == (-0.1, 0.4)
    assert escape([("bumper", RIGHT), ("wheel_drop", LEFT)]) == (0.0, 0.0)


# Cases by hand; tests.golden.navigation.test_velocity_smoother_as_genuine has genuine commands.


LIMITS = VelocityLimits(speed=(1.0, 2.0), acceleration=(1.0, 2.0), deceleration=3.0)


def smoother(feedback: Feedback = Feedback.NONE) -> tuple[VelocitySmoother, list[str]]:
    log: list[str] = []
    return VelocitySmoother(LIMITS, 0.1, feedback, lambda level, text: log.append(text)), log


def test_a_command_is_approached_and_repeated() -> None:
    one, _ = smoother()
    assert one.step(1.0) is None
    one.command((0.25, 0.0), 1.0)
    assert [one.step(1.0) for _ in range(4)] == [(0.1, 0.0), (0.2, 0.0), (0.25, 0.0), (0.25, 0.0)]


def test_commands_are_clamped_and_braking_is_faster() -> None:
    one, _ = smoother()
    one.command((9.0, float("nan")), 1.0)
    for _ in range(10):
        last = one.step(1.0)
    assert last == pytest.approx((1.0, 0.0))
    one.command((0.0, 0.0), 1.1)
    assert one.step(1.1) == pytest.approx((0.7, 0.0))


def test_both_axes_keep_the_direction_of_the_change() -> None:
    one, _ = smoother()
    one.command((1.0, 0.5), 1.0)
    assert one.step(1.0) == pytest.approx((0.1, 0.05))
    two, _ = smoother()
    two.command((0.1, 2.0), 1.0)
    assert two.step(1.0) == pytest.approx((0.01, 0.2))


def test_a_silent_input_stops_the_robot() -> None:
    one, log = smoother()
    one.command((0.1, 0.0), 1.0)
    assert (one.step(1.29), one.step(1.31)) == ((0.1, 0.0), (0.0, 0.0))
    assert log == ["the input is silent, so the robot is stopped (after 0.31 s)"]
    assert one.step(1.4) is None


def test_a_robot_that_slips_is_followed() -> None:
    one, log = smoother(Feedback.COMMANDS)
    one.measured((0.5, 0.0))
    one.command((1.0, 0.0), 1.0)
    assert one.step(1.0) == pytest.approx((0.6, 0.0))
    assert "replaces the last command" in log[0]


def test_a_robot_that_still_reverses_brakes() -> None:
    one, _ = smoother(Feedback.ODOMETRY)
    one.measured((-0.1, 0.0))
    one.command((1.0, 0.0), 1.0)
    assert one.step(1.0) == pytest.approx((0.3, 0.0))
