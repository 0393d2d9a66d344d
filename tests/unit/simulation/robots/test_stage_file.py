"""World files of Stage: walls from a bitmap, robots with lasers, definitions, includes, and errors."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from pipros.pictures.pgm import write_pgm
from pipros.simulation.robots.drive import Pose
from pipros.simulation.robots.errors import InvalidSettings
from pipros.simulation.robots.settings import RobotSettings
from pipros.simulation.robots.stage_file import read_stage
from pipros.simulation.robots.world import World

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
    return read_stage(str(folder / "my.world"))


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


@pytest.mark.parametrize(
    ("turn", "expected"),
    [
        (90, [[1, 0], [0, 0], [0, 0], [0, 0]]),
        (180, [[0, 0, 0, 1], [0, 0, 0, 0]]),
        (-90, [[0, 0], [0, 0], [0, 0], [0, 1]]),
    ],
)
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


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (ROBOT.replace("rover", "position"), "must contain a model with a bitmap"),
        (WORLD, "must contain a robot"),
        (WORLD + "rover ( size [1 1", "ends in the middle of a model or a property"),
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
        ("a ( " * 30, "nested at most 20 deep"),
        ('include "my.world"', "nested at most 20 deep"),
        ('include "my.world" ' * 3, "nested at most 20 deep"),
        ("a ( ) " * 10_001, "must have at most 10000 models"),
        ('include "missing.inc"', r"cannot read the world .*missing\.inc"),
    ],
)
def test_invalid_worlds_raise(tmp_path: Path, text: str, why: str) -> None:
    with pytest.raises(InvalidSettings, match=why):
        read(tmp_path, text)
