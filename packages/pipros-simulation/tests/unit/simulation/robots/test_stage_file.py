"""World files of Stage: walls from a bitmap, robots with lasers, definitions, includes, and errors."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from pipros_libraries.pictures.pgm import write_pgm
from pipros_simulation.robots.drive import Pose
from pipros_simulation.robots.errors import InvalidSettings
from pipros_simulation.robots.settings import Imu, Laser, RobotSettings, boolean, changed
from pipros_simulation.robots.simulation import Simulation
from pipros_simulation.robots.stage_file import Stage, read_stage
from pipros_simulation.robots.world import World

# The bitmap is 4 x 2 pixels; only its upper left one is dark.
BITMAP = write_pgm(4, 2, bytes([0, 200, 200, 200, 200, 200, 200, 200]), "a test")
INCLUDED = """
define wide ranger (
  sensor ( range [0.5 20.0] fov 90 samples 91 )
  color "black"
)
define rover position (
  size [0.4 0.3 0.25]
  block ( points 3 point[0] [0 0] point[1] [1 0] point[2] [1 1] z [0 1] )
  drive "diff"
  wide ( pose [0.1 0 0 180] )  # at the back
)
"""
PLAN = 'plan ( name "lab" bitmap "lab.pgm" size [8 4 1] pose [10 20 0 0] )\n'
WORLD = f"""# a world
include "rover.inc"
define plan model ( gui_nose 0 color "gray30" )
resolution 0.02
interval_sim 100
window ( size [600 700] rotate [0 0] scale 20 )
{PLAN}
"""
ROBOT = 'rover ( name "r" pose [8 19 0 90] )\n'


def read(folder: Path, text: str) -> tuple[World, list[RobotSettings]]:
    (folder / "lab.pgm").write_bytes(BITMAP)
    (folder / "rover.inc").write_text(INCLUDED)
    (folder / "my.world").write_text(text)
    return read_stage(str(folder / "my.world"))[:2]


def test_a_bitmap_is_scaled_and_centred(tmp_path: Path) -> None:
    world, robots = read(tmp_path, WORLD + ROBOT)

    assert (world.resolution, world.left, world.bottom, world.size) == (2.0, 6.0, 18.0, (8.0, 4.0))
    assert world.walls.tolist() == [[False] * 4, [True, False, False, False]]
    (robot,) = robots
    assert (robot.name, robot.radius) == ("", 0.2)
    assert robot.start == Pose(8.0, 19.0, math.pi / 2)
    laser = robot.laser
    assert laser is not None
    assert (laser.rays, laser.range_min, laser.range_max, laser.no_echo) == (91, 0.5, 20.0, 20.0)
    assert (laser.min_angle, laser.field_of_view) == pytest.approx((-math.pi / 4, math.pi / 2))
    assert (laser.x, laser.yaw) == pytest.approx((0.1, math.pi))
    assert laser.increment == pytest.approx(math.radians(1))


SPIKES = (
    f"block ( points 1000 {' '.join(f'point[{n}] [{n * 7 % 1000} {n * 31 % 1000}]' for n in range(1000))} )"
)


@pytest.mark.parametrize(("turn", "expected"), [
    (90, [[1, 0], [0, 0], [0, 0], [0, 0]]), (180, [[0, 0, 0, 1], [0, 0, 0, 0]]),
    (-90, [[0, 0], [0, 0], [0, 0], [0, 1]]),
])  # fmt: skip
def test_a_bitmap_turns_counter_clockwise(tmp_path: Path, turn: int, expected: list[list[int]]) -> None:
    world, _ = read(tmp_path, WORLD.replace("pose [10 20 0 0]", f"pose [10 20 0 {turn}]") + ROBOT)

    assert np.array_equal(world.walls, np.array(expected, bool))
    assert (world.left + world.size[0] / 2, world.bottom + world.size[1] / 2) == (10.0, 20.0)


def test_several_robots_are_numbered(tmp_path: Path) -> None:
    second = "position ( laser ( range_max 5 fov 180 samples 361 ) pose [1 2 0 0] )"

    _, robots = read(tmp_path, WORLD + ROBOT + second + " position ( size [1 1 1] )")

    assert [robot.name for robot in robots] == ["robot_0", "robot_1", "robot_2"]
    laser = robots[1].laser
    assert laser is not None
    assert (laser.rays, laser.range_max) == (361, 5.0)
    assert robots[2].laser is None


@pytest.mark.parametrize(("text", "why"), [
    (ROBOT.replace("rover", "position"), "needs walls: a model with a bitmap or blocks"),
    (WORLD, "must contain a robot"),
    (WORLD + "rover ( size [1 1", "ends in the middle of a model or a property"),
    (
        WORLD + 'rover ( drive "hover" )',
        "drive must be diff, omni or car, and wheelbase > 0, got 'hover'",
    ),
    (WORLD + "rover ( drive 1", r"a closing bracket '\)' is missing"),
    (WORLD + 'rover ( name "r )\n', r"my\.world:\d+: a closing quote is missing"),
    (WORLD + "define a b c", r"b must be followed by '\('"),
    (WORLD + "rover ( size 3 )", r"size of a position must be a list of numbers, got 3\.0"),
    (WORLD + 'position ( laser ( fov "wide" ) )', "fov of a laser must be a number, got 'wide'"),
    (WORLD + "position ( laser ( samples 0 ) )", "a scanner needs a fov"),
    (WORLD + "position ( size [0 0 0] )", "a robot's size must be > 0"),
    (WORLD.replace("20 0 0]", "20 0 30]") + ROBOT, "rotated by multiples of 90 degrees, got 30"),
    (
        WORLD.replace("[8 4 1]", "[8 8 1]") + ROBOT,
        "size must be > 0 and match the aspect ratio of the bitmap",
    ),
    ("model ( block ( points 2 ) ) position ( )", "a block must have 3 to 1000 points, got 2"),
    ("model ( pose [9e6 0 0 0] ) position ( )", "the world must have at most 25000000 cells"),
    (WORLD + ROBOT + 'rover ( localization "laser" )', "localization must be gps or odom, got 'laser'"),
    ("a ( " * 30, "nested at most 20 deep"), ('include "my.world"', "nested at most 20 deep"),
    ('include "my.world" ' * 3, "nested at most 20 deep"),
    ("a ( ) " * 10_001, "must have at most 10000 models"),
    (
        "define a0 model ( ) "
        + "".join(f"define a{n + 1} model ( a{n} ( ) a{n} ( ) ) " for n in range(30)),
        "must have at most 10000 models",
    ),
    (f"model ( size [200 200 1] {SPIKES} ) position ( )", "have too many corners, or are too large"),
    ('include "missing.inc"', r"cannot read the world .*missing\.inc"),
])  # fmt: skip
def test_invalid_worlds_raise(tmp_path: Path, text: str, why: str) -> None:
    with pytest.raises(InvalidSettings, match=why):
        read(tmp_path, text)


def stage(folder: Path, text: str) -> Stage:
    read(folder, text)
    return read_stage(str(folder / "my.world"))


def test_a_scanner_stands_on_the_robot(tmp_path: Path) -> None:
    low = "position ( size [0.4 0.4 0.40] ranger ( pose [0 0 -0.11 0] sensor ( samples 9 ) ) )"

    _, robots = read(tmp_path, WORLD + ROBOT + low)

    assert [robot.laser.z for robot in robots if robot.laser] == pytest.approx([0.25, 0.29])


def test_the_origin_of_a_floor_plan_moves_its_centre(tmp_path: Path) -> None:
    world, _ = read(
        tmp_path, WORLD.replace("pose [10 20 0 0]", "pose [10 20 0 0] origin [7.8 3.7 0 0]") + ROBOT
    )

    assert (world.left, world.bottom) == pytest.approx((6.0 + 7.8, 18.0 + 3.7))


def test_a_boundary_is_a_wall(tmp_path: Path) -> None:
    world, _ = read(tmp_path, WORLD.replace("pose [10", "boundary 1 pose [10") + ROBOT)

    assert world.walls.all()


@pytest.mark.parametrize(("properties", "start", "end"), [
    ('localization "gps" localization_origin [0 0 0 0]', (8.0, 19.0), (8.0, 19.5)),
    ('localization "gps"', (0.0, 0.0), (0.5, 0.0)),
    ('localization "odom" odom_error [0 0 0 0]', (0.0, 0.0), (0.5, 0.0)),
    ('localization "odom" odom_error [0 0 0 0] localization_origin [0 0 0 0]', (8.0, 19.0), (8.0, 19.5)),
])  # fmt: skip
def test_the_odometry_begins_where_the_file_says(
    tmp_path: Path, properties: str, start: tuple[float, float], end: tuple[float, float]
) -> None:
    world, robots, _ = stage(tmp_path, WORLD + ROBOT.replace("rover (", f"rover ( {properties}"))
    simulation = Simulation(world, robots)
    (robot,) = simulation.robots.values()

    assert (robot.odometry.x, robot.odometry.y) == pytest.approx(start)
    for _ in range(5):
        robot.command(5.0, 0.0, simulation.time_s)
        simulation.step()
    assert (robot.odometry.x, robot.odometry.y) == pytest.approx(end)
    assert robot.pose.y == pytest.approx(19.5)


def test_a_wrong_odometry_has_one_error_for_the_whole_run(tmp_path: Path) -> None:
    wrong = 'rover ( localization "odom" odom_error [0.4 0 0 0]'
    world, robots, _ = stage(tmp_path, WORLD + ROBOT.replace("rover (", wrong))

    def reported(seed: int) -> list[float]:
        simulation = Simulation(world, robots, seed=seed)
        (robot,) = simulation.robots.values()
        places = [0.0]
        for _ in range(5):
            robot.command(1.0, 0.0, simulation.time_s)
            simulation.step()
            places.append(robot.odometry.x)
        return [after - before for before, after in itertools.pairwise(places)]

    steps = reported(1)
    assert steps == pytest.approx([steps[0]] * 5)
    assert 0 < abs(steps[0] - 0.02) <= 0.2 * 0.02
    assert reported(2)[0] != steps[0]


def test_models_are_walls_where_their_blocks_are(tmp_path: Path) -> None:
    # A triangle, scaled to 4 x 2 m around (10, 20), and a box of 2 x 0.2 m that is turned by 90 degrees.
    models = (
        "model ( pose [10 20 0 0] size [4 2 1] block ( points 3 point[0] [0 0] point[1] [8 0] point[2] [8 6]"
        " z [0 1] ) ) model ( pose [14 20 0 90] size [2 0.2 1] )"
        " model ( pose [10 23 0 0] obstacle_return 0 )"
    )

    world, _ = read(tmp_path, models + " position ( pose [10 24 0 0] )")

    def is_wall(x: float, y: float) -> bool:
        return bool(world.walls[int((y - world.bottom) / 0.05), int((x - world.left) / 0.05)])

    assert [is_wall(11.5, 19.5), is_wall(8.5, 20.5), is_wall(8.2, 19.03)] == [True, False, True]
    assert [is_wall(14.0, 20.9), is_wall(14.0, 19.1), is_wall(14.9, 20.0)] == [True, True, False]
    assert not is_wall(10.0, 23.0)
    assert world.is_free(10.0, 24.0, 0.2)


def test_models_stand_on_a_floor_plan_and_bitmaps_may_be_turned(tmp_path: Path) -> None:
    # Of the second bitmap, 4 x 2 m and turned by 180 degrees, only the lower right quarter is dark.
    second = ' plan ( bitmap "lab.pgm" size [4 2 1] pose [12 20 0 180] )'

    world, _ = read(tmp_path, WORLD + second + ROBOT)

    assert world.walls.tolist() == [[False, False, False, True], [True, False, False, False]]


def test_a_car_has_its_wheelbase(tmp_path: Path) -> None:
    _, (robot,) = read(tmp_path, WORLD + 'position ( drive "car" wheelbase 0.4 )')
    assert (robot.drive, robot.wheelbase) == ("car", 0.4)


def test_each_property_without_effect_is_named_once(tmp_path: Path) -> None:
    robot = (
        'position ( drive "omni" wheelbase 0.4 velocity_bounds [0 1] color "red" camera ( ) sonar ( )'
        " laser ( ) ranger ( ) )"
    )

    found = stage(tmp_path, WORLD + robot + robot)

    assert found.unused == [
        "interval_sim of the world has no effect",
        "velocity_bounds of a position has no effect",
        "a camera of a position is not simulated",
        "a sonar of a position is not simulated",
        "only the first scanner of a position is simulated",
    ]


# Settings of robots from parameters.


def test_given_numbers_replace_the_defaults() -> None:
    laser = changed(Laser(), {"rays": 181, "min_angle": -1.57, "noise": 0}, "laser")

    assert (laser.rays, laser.min_angle, laser.noise, laser.range_max) == (181, -1.57, 0.0, 10.0)
    assert changed(Laser(), {"no_echo": math.inf}, "laser").no_echo == math.inf


def test_a_full_turn_has_as_many_gaps_as_rays() -> None:
    assert Laser(rays=360).increment == pytest.approx(math.radians(1))
    assert Laser(rays=181, field_of_view=math.pi).increment == pytest.approx(math.radians(1))
    assert Laser(rays=1, field_of_view=1.0).increment == 1.0


@pytest.mark.parametrize(("values", "why"), [
    (7, "robot must be a mapping, got 7"),
    ({"speed": 1}, "robot has no setting 'speed'; the settings are radius, drive, wheelbase, "),
    ({"name": "a"}, "robot has no setting 'name'"), ({"radius": 0}, "robot/radius must be > 0, got 0"),
    ({"max_linear": -1}, "robot/max_linear must be >= 0, got -1"),
    ({"drive": "car!"}, "robot/drive must be one of diff, omni, ackermann, car, got 'car!'"),
    ({"radius": True}, "robot/radius must be a finite number, got True"),
    ({"radius": math.nan}, "robot/radius must be a finite number, got nan"),
])  # fmt: skip
def test_invalid_settings_raise(values: object, why: str) -> None:
    with pytest.raises(InvalidSettings, match=why):
        changed(RobotSettings(), values, "robot")


@pytest.mark.parametrize("rays", [0, -3, 10_001])
def test_the_number_of_rays_is_limited(rays: int) -> None:
    with pytest.raises(InvalidSettings, match=r"rays must be"):
        changed(Laser(), {"rays": rays}, "laser")


def test_a_boolean_is_true_or_false() -> None:
    assert boolean(False, "publish_tf") is False
    with pytest.raises(InvalidSettings, match="publish_tf must be true or false, got 'no'"):
        boolean("no", "publish_tf")


def test_an_imu_may_be_without_noise() -> None:
    assert changed(Imu(), {"gyro_noise": 0, "z": -0.1}, "imu") == Imu(gyro_noise=0.0, z=-0.1)
    with pytest.raises(InvalidSettings, match="imu/yaw_noise must be >= 0"):
        changed(Imu(), {"yaw_noise": -1}, "imu")
    with pytest.raises(InvalidSettings, match="laser has no setting 'is_upside_down'"):
        changed(Laser(), {"is_upside_down": True}, "laser")
