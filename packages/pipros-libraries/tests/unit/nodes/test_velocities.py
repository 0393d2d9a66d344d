"""When a base may keep its last velocity."""

import math
import platform
import subprocess
import sys
from typing import Any

import pytest

from pipros.msg import load_message_class
from pipros_libraries.nodes.params import InvalidParameter
from pipros_libraries.nodes.velocities import VelocityRule, check_axis, checked_rate, speeds

TYPES = ["geometry_msgs/Twist", "geometry_msgs/TwistStamped"]


def turning(kind: str, speed: float) -> Any:
    message: Any = load_message_class(kind)()
    getattr(message, "twist", message).angular.z = speed
    return message


@pytest.mark.parametrize("kind", TYPES)
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_velocity_that_is_not_finite_is_refused(kind: str, value: float) -> None:
    rule = VelocityRule()
    assert rule.allows(turning(kind, 0.5), 0.0)
    assert rule.is_moving
    assert not rule.allows(turning(kind, value), 0.0)
    assert not rule.is_moving
    assert len(list(speeds(turning(kind, value)))) == 6


def test_silence_and_a_clock_that_jumps_back_stop_a_moving_base_only() -> None:
    rule = VelocityRule(0.5)
    assert not rule.must_stop(100.0)
    rule.allows(turning(TYPES[0], 0.5), 10.0)
    assert [rule.must_stop(now_s) for now_s in (10.0, 10.4, 10.5, 9.0)] == [False, False, True, True]
    rule.allows(turning(TYPES[0], 0.0), 10.0)
    assert not rule.must_stop(20.0)


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, 0.4, 1001.0, math.nan, math.inf])
def test_a_rate_outside_of_its_range_is_refused_with_its_name(rate_hz: float) -> None:
    with pytest.raises(InvalidParameter, match=r"~frequency must be a rate from 0.5 to 1000 Hz, got"):
        checked_rate("~frequency", rate_hz)


@pytest.mark.parametrize(("limits", "text"), [
    ((math.nan, 1.0, 1.0), "min_vel_x must be a finite number, got nan"),
    ((0.0, math.inf, 1.0), "max_vel_x must be a finite number, got inf"),
    ((0.2, 0.1, 1.0), r"max_vel_x must be >= min_vel_x \(0.2\), got 0.1"),
    ((0.0, 0.5, 0.0), "acc_lim_x must be > 0, got 0: the robot could not brake"),
    ((0.0, 0.5, -2.0), "acc_lim_x must be > 0, got -2"),
])  # fmt: skip
def test_limits_that_contradict_each_other_are_refused(limits: tuple[float, ...], text: str) -> None:
    least, greatest, acceleration = zip(("min_vel_x", "max_vel_x", "acc_lim_x"), limits, strict=True)
    with pytest.raises(InvalidParameter, match=text):
        check_axis(least, greatest, acceleration)


def test_a_robot_must_be_able_to_brake_within_a_minute() -> None:
    check_axis(("least", -0.6), ("greatest", 0.3), ("acceleration", 0.01))
    with pytest.raises(InvalidParameter, match=r"acceleration must be at least 0\.01, got 0\.009"):
        check_axis(("least", -0.6), ("greatest", 0.3), ("acceleration", 0.009))


@pytest.mark.parametrize("limits", [(-0.2, 0.5, 1.0), (-0.1, 0.0, 0.0), (-0.5, -0.1, 1.0)])
def test_backward_velocities_and_an_axis_that_is_off_are_accepted(limits: tuple[float, ...]) -> None:
    check_axis(("least", limits[0]), ("greatest", limits[1]), ("acceleration", limits[2]))


# Nodes that compute with arrays use the memory of earlier ones again.


PAGE_FAULTS = """
import resource
from pipros_libraries.nodes.kept_memory import keep_freed_memory
{}
def faults():
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt
arrays = [b"x" * 1_000_000 for _ in range(4)]
before = faults()
for _ in range(20):
    del arrays
    arrays = [b"x" * 1_000_000 for _ in range(4)]
print(faults() - before)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc is configured")
def test_memory_of_freed_arrays_is_used_again_without_page_faults() -> None:
    def page_faults(call: str) -> int:
        command = [sys.executable, "-c", PAGE_FAULTS.format(call)]
        return int(subprocess.run(command, check=True, capture_output=True, text=True).stdout)

    assert page_faults("keep_freed_memory()") * 10 < page_faults("")
