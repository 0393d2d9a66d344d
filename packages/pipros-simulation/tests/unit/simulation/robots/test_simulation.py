"""Robots in a world: paths in closed form, collisions, batteries, noise, and repeated traces."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pipros_libraries.robot_model.urdf import UrdfError
from pipros_simulation.robots.battery import BatterySettings
from pipros_simulation.robots.controllers import Limiter
from pipros_simulation.robots.drive import Pose, combined
from pipros_simulation.robots.errors import InvalidSettings, Rejected
from pipros_simulation.robots.obstacle import Obstacle
from pipros_simulation.robots.robot import SimulatedRobot
from pipros_simulation.robots.settings import Laser, RobotSettings
from pipros_simulation.robots.sim_program import placed_laser
from pipros_simulation.robots.simulation import STEP_S, Simulation
from pipros_simulation.robots.world import World

SECOND = round(1 / STEP_S)
STILL = RobotSettings(start=Pose(5.0, 5.0, 0.0), command_timeout_s=1e9)


def hall() -> World:
    """Return an empty world of 10 x 10 m."""
    return World.from_cells(np.zeros((200, 200), bool), 0.05)


def simulation(*robots: RobotSettings, seed: int = 0) -> Simulation:
    return Simulation(hall(), robots or [STILL], seed=seed)


def drive(simulated: Simulation, linear: float, angular: float, steps: int, name: str = "") -> SimulatedRobot:
    robot = simulated.robots[name]
    robot.command(linear, angular, simulated.time_s)
    for _ in range(steps):
        simulated.step()
    return robot


def test_a_straight_way_is_velocity_times_time() -> None:
    robot = drive(simulation(), 0.5, 0.0, 4 * SECOND)

    assert (robot.pose.x, robot.pose.y, robot.pose.yaw) == pytest.approx((7.0, 5.0, 0.0))
    assert (robot.odometry.x, robot.odometry.y, robot.odometry.yaw) == pytest.approx((2.0, 0.0, 0.0))
    assert robot.wheels == pytest.approx((2.0 / 0.033, 2.0 / 0.033))
    assert (robot.velocity.forwards, robot.velocity.turn) == pytest.approx((0.5, 0.0))


@pytest.mark.parametrize("seconds", [1, 3, 7])
def test_a_curve_is_an_arc_of_the_circle_in_closed_form(seconds: int) -> None:
    linear, angular = 0.4, 0.8
    robot = drive(simulation(), linear, angular, seconds * SECOND)

    radius, yaw = linear / angular, angular * seconds
    assert robot.odometry.x == pytest.approx(radius * math.sin(yaw), abs=1e-9)
    assert robot.odometry.y == pytest.approx(radius * (1 - math.cos(yaw)), abs=1e-9)
    assert math.remainder(robot.odometry.yaw - yaw, math.tau) == pytest.approx(0, abs=1e-9)
    half = angular * 0.24 / 2
    assert robot.wheel_speeds == pytest.approx(((linear - half) / 0.033, (linear + half) / 0.033))


def test_velocities_are_limited_and_end_without_commands() -> None:
    simulated = simulation(replace(STILL, command_timeout_s=1.0))

    robot = drive(simulated, 100.0, -100.0, 1)
    assert (robot.velocity.forwards, robot.velocity.turn) == pytest.approx((0.5, -2.5))
    for _ in range(SECOND):
        simulated.step()
    assert (robot.velocity.forwards, robot.velocity.turn) == (0.0, 0.0)


def test_a_wall_stops_the_robot_and_its_wheels_and_the_bumper_reports_it() -> None:
    simulated = simulation(replace(STILL, start=Pose(9.5, 5.0, 0.0)))

    robot = drive(simulated, 0.5, 0.0, 3 * SECOND)
    assert 9.8 < robot.pose.x <= 9.85
    assert robot.is_bumped
    assert (robot.odometry.x, robot.wheel_speeds) == (pytest.approx(robot.pose.x - 9.5), (0.0, 0.0))
    drive(simulated, -0.5, 0.0, SECOND)
    assert not robot.is_bumped
    assert robot.pose.x < 9.4


def test_robots_block_each_other_and_are_seen_by_lasers() -> None:
    quiet = replace(STILL, laser=Laser(noise=0.0))
    first = replace(quiet, name="a", start=Pose(4.0, 5.0, 0.0))
    simulated = simulation(first, replace(quiet, name="b", start=Pose(5.0, 5.0, 0.0)))

    assert simulated.scans(["a"])["a"][0] == pytest.approx(0.85)
    robot = drive(simulated, 0.5, 0.0, 3 * SECOND, "a")
    assert 4.68 < robot.pose.x <= 4.7
    assert robot.is_bumped
    drive(simulated, -0.5, 0.0, SECOND, "a")
    assert robot.pose.x < 4.3


def test_noise_has_the_set_deviation() -> None:
    laser = Laser(noise=0.05, rays=5000)
    walls = np.zeros((200, 200), bool)
    walls[[0, -1]] = walls[:, [0, -1]] = True
    noisy, exact = (
        Simulation(World.from_cells(walls, 0.05), [replace(STILL, laser=each)]).scans([""])[""]
        for each in (laser, replace(laser, noise=0.0))
    )

    assert np.std(noisy - exact) == pytest.approx(0.05, rel=0.05)
    assert abs(np.mean(noisy - exact)) < 0.005


def test_odometry_drifts_with_noise_only() -> None:
    robot = drive(simulation(replace(STILL, odometry_noise=0.2)), 0.3, 0.5, 5 * SECOND)

    measured = combined(Pose(5.0, 5.0, 0.0), robot.odometry)
    assert 0.001 < math.hypot(measured.x - robot.pose.x, measured.y - robot.pose.y) < 0.5


def trace(seed: int) -> list[object]:
    simulated = simulation(
        RobotSettings("a", odometry_noise=0.1), RobotSettings("b", odometry_noise=0.1), seed=seed
    )
    seen: list[object] = []
    for step in range(100):
        for name, robot in simulated.robots.items():
            robot.command(0.3, math.sin(step / 10), simulated.time_s)
            seen.append((name, robot.pose, robot.odometry, robot.battery.charge_ah))
        simulated.step()
        if step % 10 == 0:
            seen += [ranges.tolist() for ranges in simulated.scans(list(simulated.robots)).values()]
    return seen


def test_the_same_seed_gives_the_same_trace() -> None:
    assert trace(1) == trace(1)
    assert trace(1) != trace(2)


def test_after_a_reset_the_trace_repeats() -> None:
    simulated = simulation(replace(STILL, odometry_noise=0.1))
    first = [drive(simulated, 0.3, 0.1, 50).odometry, simulated.scans([""])[""].tolist()]

    simulated.reset()

    assert simulated.robots[""].pose == Pose(5.0, 5.0, 0.0)
    assert simulated.robots[""].battery.percentage == 1.0
    assert [drive(simulated, 0.3, 0.1, 50).odometry, simulated.scans([""])[""].tolist()] == first
    assert simulated.steps == 100


def test_a_battery_empties_and_the_robot_stops_until_it_is_charged() -> None:
    battery = BatterySettings(capacity_ah=0.001, idle_a=0.6, drive_a=3.0)
    simulated = simulation(replace(STILL, battery=battery))
    robot = simulated.robots[""]
    full = robot.battery.voltage

    simulated.step()
    assert robot.battery.current_a == pytest.approx(-0.6)
    assert robot.battery.charge_ah == pytest.approx(0.001 - 0.6 * STEP_S / 3600)
    drive(simulated, 0.5, 0.0, 10 * SECOND)
    assert (robot.battery.percentage, robot.battery.voltage) == (0.0, 10.5)
    assert (full, robot.velocity.forwards) == (12.6, 0.0)
    robot.battery.is_charging = True
    drive(simulated, 0.5, 0.0, 5)
    assert robot.velocity.forwards == 0.5
    assert robot.battery.percentage > 0.0


def test_robots_without_a_start_get_different_free_places() -> None:
    simulated = simulation(STILL, *(RobotSettings(f"r{number}") for number in range(20)))

    poses = [robot.pose for robot in simulated.robots.values()]
    gaps = [math.hypot(a.x - b.x, a.y - b.y) for a in poses for b in poses if a is not b]
    assert min(gaps) > 0.3
    assert all(simulated.world.is_free(pose.x, pose.y, 0.15) for pose in poses)


def test_invalid_robots_raise() -> None:
    with pytest.raises(InvalidSettings, match=r"robot names must be unique, got \[a\] twice"):
        simulation(RobotSettings("a"), RobotSettings("a"))
    with pytest.raises(InvalidSettings, match=r"robot \[a\] cannot start at .*: too close to a wall"):
        simulation(RobotSettings("a", start=Pose(0.0, 0.0, 0.0)))
    with pytest.raises(InvalidSettings, match=r"robot \[a\] cannot start at .*or to the map's edge"):
        simulation(RobotSettings("a", start=Pose(1000.0, 0.0, 0.0)))
    with pytest.raises(InvalidSettings, match=r"no free place found for robot \[a\] \(radius 6 m\)"):
        simulation(RobotSettings("a", radius=6))


def test_a_robot_can_only_be_placed_where_it_fits() -> None:
    simulated = simulation(replace(STILL, name="a"), replace(STILL, name="b", start=Pose(2.0, 2.0, 0.0)))

    drive(simulated, 0.5, 0.0, 10, "a")
    simulated.place("a", Pose(3.0, 4.0, 1.0))
    assert simulated.robots["a"].pose == Pose(3.0, 4.0, 1.0)
    assert drive(simulated, 0.0, 0.0, 1, "a").pose == Pose(3.0, 4.0, 1.0)
    assert simulated.robots["a"].odometry.x == pytest.approx(0.1)
    for name, pose, why in (
        ("c", Pose(), r"robot \[c\] does not exist; the robots are a, b"),
        ("a", Pose(0.0, 0.0, 0.0), r"a wall or the map's edge is too close to x=0\.00, y=0\.00"),
        ("a", Pose(2.1, 2.0, 0.0), r"robot \[b\] is too close to x=2\.10, y=2\.00"),
        ("a", Pose(math.nan, 2.0, 0.0), "only finite numbers"),
    ):
        with pytest.raises(Rejected, match=why):
            simulated.place(name, pose)


def test_the_pose_of_the_laser_moves_its_measurements() -> None:
    laser = Laser(noise=0.0, x=0.1, yaw=math.pi / 2, no_echo=0.0, range_max=6.0)
    target = RobotSettings("b", start=Pose(5.0, 7.0, 0.0))
    simulated = simulation(replace(STILL, name="a", laser=laser), target)

    ranges = simulated.scans(["a", "b"])["a"]
    assert combined(Pose(5.0, 5.0, 0.0), laser.pose).x == pytest.approx(5.1)
    assert (ranges[0], ranges[180]) == (pytest.approx(2.0 - math.sqrt(0.15**2 - 0.1**2)), 0.0)


def test_a_laser_upside_down_measures_clockwise() -> None:
    laser = Laser(noise=0.0, rays=4, is_upside_down=True)
    on_the_left = RobotSettings("b", start=Pose(5.0, 7.0, 0.0))

    ranges = simulation(replace(STILL, name="a", laser=laser), on_the_left).scans(["a"])["a"]

    assert ranges.tolist() == pytest.approx([math.inf, math.inf, math.inf, 1.85])


def test_echoes_are_points_where_rays_end() -> None:
    quiet = replace(STILL, laser=Laser(noise=0.0))
    first = replace(quiet, name="a", start=Pose(4.0, 5.0, 0.0))
    simulated = simulation(
        first,
        replace(quiet, name="b", start=Pose(5.0, 5.0, 0.0)),
        replace(quiet, name="blind", start=Pose(8.0, 8.0, 0.0), laser=None),
    )

    points = simulated.echoes("a", 400)

    assert min(np.hypot(x - 4.0, y - 5.0) for x, y in points) == pytest.approx(0.85)
    assert len(simulated.echoes("a", 10)) <= 10
    assert len(simulated.echoes("blind", 10)) == 0


def test_slipping_wheels_move_the_robot_less_than_the_odometry_says() -> None:
    robot = drive(simulation(replace(STILL, wheel_slip=0.2)), 0.3, 0.0, 10 * SECOND)

    assert robot.odometry.x == pytest.approx(3.0)
    assert 1.8 < math.hypot(robot.pose.x - 5.0, robot.pose.y - 5.0) < 2.9
    assert robot.pose.yaw != 0.0


def test_an_obstacle_walks_its_way_is_seen_and_waits_for_robots() -> None:
    obstacle = Obstacle([(7.0, 5.0), (7.0, 6.0)], 0.2, 0.5)
    simulated = Simulation(hall(), [replace(STILL, laser=Laser(noise=0.0))], obstacles=[obstacle])

    assert simulated.scans([""])[""][0] == pytest.approx(1.8)
    drive(simulated, 0.0, 0.0, 2 * SECOND)
    assert (obstacle.x, obstacle.y) == pytest.approx((7.0, 6.0))
    drive(simulated, 0.0, 0.0, 2 * SECOND + 1)
    assert (obstacle.x, obstacle.y) == pytest.approx((7.0, 5.0), abs=0.02)
    with pytest.raises(Rejected, match="a moving obstacle is too close"):
        simulated.place("", Pose(7.0, 5.0, 0.0))

    simulated.place("", Pose(7.0, 5.7, 0.0))
    drive(simulated, 0.0, 0.0, 5 * SECOND)
    assert 5.7 - 0.15 - 0.2 - 0.15 < obstacle.y < 5.7 - 0.15 - 0.2
    assert drive(simulated, 0.5, 0.0, SECOND).pose.x > 7.4, "the way ahead is free"


def test_an_obstacle_moves_away_from_a_robot_that_comes_close() -> None:
    obstacle = Obstacle([(6.0, 5.0), (5.0, 5.0), (8.0, 5.0)], 0.2, 0.5)
    simulated = Simulation(hall(), [STILL], obstacles=[obstacle])
    simulated.place("", Pose(6.0 - 0.2 - 0.15 - 0.05, 5.0, 0.0))
    drive(simulated, 0.0, 0.0, 2 * SECOND)
    assert (obstacle.x, obstacle.y) == (6.0, 5.0)
    drive(simulated, 0.0, 0.0, 3 * SECOND)
    assert obstacle.x > 6.5


def test_a_robot_stops_at_an_obstacle() -> None:
    simulated = Simulation(hall(), [STILL], obstacles=[Obstacle([(6.0, 5.0)], 0.2, 0.0)])
    robot = drive(simulated, 0.5, 0.0, 3 * SECOND)
    assert robot.pose.x == pytest.approx(6.0 - 0.2 - 0.15, abs=0.011)
    assert robot.is_bumped


@pytest.mark.parametrize("given", [([], 0.2, 0.4), ([(0.0, 0.0)], 0.0, 0.4), ([(0.0, 0.0)], 0.2, -1.0)])
def test_impossible_obstacles_are_refused(given: tuple[list[tuple[float, float]], float, float]) -> None:
    with pytest.raises(InvalidSettings, match="an obstacle needs at least one point"):
        Obstacle(*given)


def test_an_omnidirectional_base_drives_a_circle_around_a_point_on_its_left() -> None:
    simulated = simulation(replace(STILL, drive="omni", max_linear=1.0))
    robot = simulated.robots[""]
    robot.command(0.3, 0.5, 0.0, 0.4)  # around a point 1 m away, at an angle of atan2(0.3, -0.4)
    for _ in range(round(math.pi / 0.5 / STEP_S)):
        simulated.step()
    half = STEP_S * round(math.pi / 0.5 / STEP_S) * 0.5
    centre = Pose(5.0 - 0.4 / 0.5, 5.0 + 0.3 / 0.5)
    x, y = 5.0 - centre.x, 5.0 - centre.y
    turned = math.cos(half) * x - math.sin(half) * y, math.sin(half) * x + math.cos(half) * y
    assert (robot.pose.x, robot.pose.y) == pytest.approx((centre.x + turned[0], centre.y + turned[1]))
    assert (robot.velocity.forwards, robot.velocity.sideways) == pytest.approx((0.3, 0.4))
    assert math.hypot(*robot.acceleration) == pytest.approx(0.5 * 0.5)


@pytest.mark.parametrize("drive_of", ["diff", "ackermann", "car"])
def test_only_an_omnidirectional_base_drives_sideways(drive_of: str) -> None:
    simulated = simulation(replace(STILL, drive=drive_of))
    simulated.robots[""].command(0.0, 0.0, 0.0, 0.4)
    simulated.step()
    assert simulated.robots[""].pose == STILL.start


@pytest.mark.parametrize(("settings", "linear", "angular", "rate"), [
    ({"drive": "ackermann", "min_turning_radius": 1.0}, 0.4, 2.0, 0.4),
    ({"drive": "ackermann", "min_turning_radius": 1.0}, -0.4, 0.2, 0.2),
    ({"drive": "ackermann", "min_turning_radius": 1.0}, 0.0, 2.0, 0.0),
    ({"drive": "ackermann", "wheelbase": 0.4}, 0.4, 2.0, math.tan(0.6)),
    ({"drive": "car", "wheelbase": 0.5}, 0.4, 0.3, 0.8 * math.sin(0.3)),
    ({"drive": "car", "wheelbase": 0.5}, 0.0, 0.3, 0.0),
])  # fmt: skip
def test_a_car_turns_as_far_as_it_can(
    settings: dict[str, float], linear: float, angular: float, rate: float
) -> None:
    robot = drive(simulation(replace(STILL, **settings)), linear, angular, 10)  # type: ignore[arg-type]
    assert robot.velocity.turn == pytest.approx(rate)


@pytest.mark.parametrize(("drive_of", "speed", "angle", "turn"), [
    ("ackermann", 0.4, 0.3, 0.4 * math.tan(0.3) / 0.3), ("car", 0.4, 0.3, 0.4 * math.tan(0.3) / 0.3),
    ("ackermann", -99.0, 0.3, -0.5 * math.tan(0.3) / 0.3), ("ackermann", 0.3, 3.0, math.tan(0.6)),
    ("car", 0.0, 0.3, 0.0), ("car", 0.1, 3.0, 2.5),
])  # fmt: skip
def test_a_steering_angle_is_that_of_the_front_wheels_and_the_speed_that_of_the_rear_axle(
    drive_of: str, speed: float, angle: float, turn: float
) -> None:
    simulated = simulation(replace(STILL, drive=drive_of))
    robot = simulated.robots[""]
    robot.steer(speed, angle, 0.0)
    simulated.step()
    assert (robot.velocity.forwards, robot.velocity.turn) == pytest.approx((max(speed, -0.5), turn))


def test_a_car_that_is_blocked_does_not_turn_on_the_spot() -> None:
    at_the_wall = replace(STILL, start=Pose(9.8, 5.0, 0.0), drive="ackermann", min_turning_radius=0.5)
    robot = drive(simulation(at_the_wall), 0.5, 0.5, SECOND)
    assert robot.is_bumped
    assert robot.velocity.turn == 0.0


# Limits of a simulated diff_drive_controller.


def test_velocities_and_accelerations_are_limited_only_if_that_is_switched_on() -> None:
    values = {"max_velocity": 1.0, "max_acceleration": 5.0, "min_acceleration": -10.0}
    on = {"has_velocity_limits": True, "has_acceleration_limits": True}

    assert Limiter.of(values, "linear/x").limited(9.0, 0.0) == 9.0
    limits = Limiter.of(values | on, "linear/x")
    assert limits.limited(9.0, 0.0) == pytest.approx(0.1)  # 5 m/s² for 0.02 s
    assert (limits.limited(9.0, 0.95), limits.limited(-9.0, -1.0)) == (1.0, -1.0)
    assert limits.limited(0.0, 0.5) == pytest.approx(0.3)


def test_a_limit_that_is_missing_is_named() -> None:
    with pytest.raises(InvalidSettings, match=r"linear/x/max_velocity must be a finite number"):
        Limiter.of({"has_velocity_limits": True}, "linear/x")


@pytest.mark.parametrize(("quantity", "low", "high"), [
    ("velocity", 0.2, 0.5), ("velocity", 1.0, -1.0), ("acceleration", 0.0, 1.0), ("acceleration", 1.0, -1.0),
])  # fmt: skip
def test_limits_with_which_a_robot_cannot_stop_are_refused(quantity: str, low: float, high: float) -> None:
    given = {f"has_{quantity}_limits": True, f"min_{quantity}": low, f"max_{quantity}": high}
    with pytest.raises(InvalidSettings, match=f"x/min_{quantity} must be <= 0, and max_{quantity} >= 0"):
        Limiter.of(given, "linear/x")


# Poses of lasers in robot descriptions.


ROBOT = """
<robot name="r">
  <link name="base"/><link name="base_link"/><link name="mast"/><link name="laser"/>
  <joint name="a" type="fixed"><parent link="base"/><child link="base_link"/><origin xyz="0 0 9"/></joint>
  <joint name="b" type="revolute"><parent link="base_link"/><child link="mast"/><axis xyz="0 0 1"/>
    <origin xyz="0.1 0 0.2" rpy="0 0 1.5707963267948966"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="c" type="fixed"><parent link="mast"/><child link="laser"/>
    <origin xyz="0.3 0 0" rpy="ROLL 0 0"/></joint>
</robot>
"""


def test_a_laser_is_relative_to_the_closest_base() -> None:
    laser = placed_laser(Laser(rays=9), ROBOT.replace("ROLL", "0"), "laser", ("base", "base_link"))

    assert (laser.x, laser.y, laser.z) == pytest.approx((0.1, 0.3, 0.2))
    assert (laser.rays, laser.yaw, laser.is_upside_down) == (9, pytest.approx(math.pi / 2), False)


def test_a_laser_can_be_upside_down() -> None:
    laser = placed_laser(Laser(), ROBOT.replace("ROLL", "3.141592653589793"), "laser", ("base_link",))

    assert (abs(laser.yaw), laser.is_upside_down) == (pytest.approx(math.pi / 2), True)


def test_a_laser_that_is_not_described_stays_where_it_is() -> None:
    assert placed_laser(Laser(), ROBOT.replace("ROLL", "0"), "scan", ("base",)) == Laser()
    with pytest.raises(UrdfError):
        placed_laser(Laser(), "<robot", "laser", ("base",))
