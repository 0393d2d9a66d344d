"""The world of turtlesim: the numbers, texts and order of events of turtlesim 0.10.2."""

from __future__ import annotations

import logging
import math
import struct
import zlib

import pytest

from pipros.basics import plugin_table
from pipros.msg import load_message_class, load_service_class
from pipros_simulation.launch_sets.expected_robot import expected_robot
from pipros_simulation.turtlesim.draw_square import Square
from pipros_simulation.turtlesim.picture import SIDE, Point, TurtleColor, TurtlePicture
from pipros_simulation.turtlesim.turtle import (
    COMMAND_S,
    PEN_COLOR,
    SIDE_M,
    TICK_S,
    Pen,
    Teleport,
    Turtle,
    TurtleCommand,
)
from pipros_simulation.turtlesim.world import BACKGROUND, LINES_KEPT, TurtleRejected, TurtleWorld
from pipros_tools.launch.xml import load
from tests.support.nodes import listening_log

MIDDLE = 5.544444561004639


class Simulation:
    """A world with its own time and its log."""

    def __init__(self, limit: int = 100) -> None:
        log, self.lines = listening_log()
        log.setLevel(logging.INFO)
        self.log = log
        self.world = TurtleWorld(log, limit=limit, look=lambda: 0)
        self.now_s = 100.0
        self.seen: dict[str, TurtleColor] = {}

    @property
    def turtle(self) -> Turtle:
        return self.world.turtles["turtle1"]

    def tick(self, count: int = 1) -> None:
        for _ in range(count):
            self.seen = {turtle.name: color for turtle, color in self.world.tick(self.now_s)}
            self.now_s += TICK_S

    def command(self, forwards: float = 0.0, left: float = 0.0, angular: float = 0.0) -> None:
        self.turtle.command(TurtleCommand(forwards, left, angular, self.now_s))

    def go_to(self, x: float, y: float, theta: float = 0.0) -> None:
        self.turtle.teleport(Teleport(False, x, y, theta))


@pytest.fixture
def simulation() -> Simulation:
    return Simulation()


def test_the_first_turtle_is_in_the_middle(simulation: Simulation) -> None:
    pose = simulation.turtle.pose
    assert (pose.x, pose.y, pose.theta) == (MIDDLE, MIDDLE, 0.0)
    assert simulation.lines == ["Spawning turtle [turtle1] at x=[5.544445], y=[5.544445], theta=[0.000000]"]
    assert pytest.approx(11.0888889, abs=1e-6) == SIDE_M


def test_a_command_is_valid_for_a_second(simulation: Simulation) -> None:
    simulation.command(forwards=2.0, angular=1.8)
    simulation.tick(int(COMMAND_S / TICK_S))
    assert simulation.turtle.pose.theta == pytest.approx(62 * 0.0288)
    assert simulation.turtle.pose.linear_velocity == 2.0
    simulation.tick(10)
    stopped = simulation.turtle.pose
    assert (stopped.linear_velocity, stopped.angular_velocity) == (0.0, 0.0)
    simulation.tick(10)
    assert simulation.turtle.pose == stopped


def test_the_turtle_turns_before_it_moves(simulation: Simulation) -> None:
    simulation.command(forwards=1.0, angular=math.pi / 2 / TICK_S)
    simulation.tick()
    assert simulation.turtle.pose.x == pytest.approx(MIDDLE)
    assert simulation.turtle.pose.y == pytest.approx(MIDDLE + TICK_S)


def test_linear_y_moves_to_the_left(simulation: Simulation) -> None:
    simulation.command(left=1.0)
    simulation.tick()
    assert simulation.turtle.pose.x == pytest.approx(MIDDLE)
    assert simulation.turtle.pose.y == pytest.approx(MIDDLE + TICK_S)


def test_the_linear_velocity_has_no_sign(simulation: Simulation) -> None:
    simulation.command(forwards=-3.0, left=4.0)
    simulation.tick()
    assert simulation.turtle.pose.linear_velocity == 5.0


def test_theta_stays_between_minus_pi_and_pi(simulation: Simulation) -> None:
    simulation.turtle.teleport(Teleport(False, 5, 5, 3 * math.pi))
    simulation.tick()
    assert simulation.turtle.theta == pytest.approx(-math.pi)
    simulation.turtle.teleport(Teleport(True, 0, 0, math.pi + 0.5))
    simulation.tick()
    assert simulation.turtle.theta == pytest.approx(0.5)


def test_the_wall_clamps_with_a_warning_in_picture_coordinates(simulation: Simulation) -> None:
    simulation.go_to(20.0, 3.0)
    simulation.tick()
    assert simulation.lines[-1] == "Oh no! I hit the wall! (Clamping from [x=20.000000, y=8.088889])"
    assert (simulation.turtle.pose.x, simulation.turtle.pose.y) == (SIDE_M, 3.0)


def test_the_wall_does_not_stop_the_velocity(simulation: Simulation) -> None:
    simulation.go_to(SIDE_M, 5.0)
    simulation.command(forwards=1.0)
    simulation.tick(3)
    assert simulation.lines[1:] == ["Oh no! I hit the wall! (Clamping from [x=11.104889, y=6.088889])"] * 3
    assert simulation.turtle.pose.linear_velocity == 1.0


def test_an_absolute_teleport_stays_below_the_top_edge_without_a_warning(simulation: Simulation) -> None:
    simulation.go_to(1.0, 50.0, 1.0)
    simulation.tick()
    assert (len(simulation.lines), simulation.turtle.pose.y) == (1, SIDE_M)
    simulation.go_to(1.0, -1.0, 1.0)
    simulation.tick()
    assert simulation.lines[-1] == "Oh no! I hit the wall! (Clamping from [x=1.000000, y=12.088889])"


def test_a_relative_teleport_turns_then_goes_straight(simulation: Simulation) -> None:
    simulation.turtle.teleport(Teleport(True, 2.0, 0.0, math.pi / 2))
    simulation.turtle.teleport(Teleport(True, 1.0, 0.0, math.pi / 2))
    simulation.tick()
    pose = simulation.turtle.pose
    assert (pose.x, pose.y) == (pytest.approx(MIDDLE - 1), pytest.approx(MIDDLE + 2))
    assert simulation.world.lines_drawn == 2


def test_the_sensor_sees_lines_of_earlier_ticks(simulation: Simulation) -> None:
    simulation.tick()
    assert simulation.seen["turtle1"] == BACKGROUND
    simulation.command(forwards=2.0)
    simulation.tick()
    assert simulation.seen["turtle1"] == BACKGROUND  # its line is drawn after the look
    simulation.tick()
    assert simulation.seen["turtle1"] == PEN_COLOR


def test_a_lifted_pen_draws_nothing_and_keeps_its_colour(simulation: Simulation) -> None:
    simulation.turtle.pen = Pen(TurtleColor(9, 8, 7), 5)
    simulation.turtle.lift_pen()
    simulation.go_to(1.0, 1.0)
    simulation.tick()
    assert simulation.world.lines_drawn == 0
    assert simulation.turtle.pen == Pen(TurtleColor(9, 8, 7), 5, is_down=False)


def test_a_turtle_that_stands_draws_nothing(simulation: Simulation) -> None:
    simulation.tick(5)
    assert simulation.world.lines_drawn == 0


def test_new_names_skip_taken_ones_and_those_of_killed_turtles(simulation: Simulation) -> None:
    world = simulation.world
    world.spawn("turtle3", 1, 1, 0)
    assert world.spawn("", 1, 1, 0).name == "turtle2"
    world.kill("turtle2")
    assert world.spawn("", 1, 1, 0).name == "turtle4"
    world.reset()
    assert (list(world.turtles), world.spawn("", 1, 1, 0).name) == (["turtle1"], "turtle2")


def test_names_are_unique_and_only_turtles_die(simulation: Simulation) -> None:
    with pytest.raises(TurtleRejected, match=r"^A turtled named \[turtle1\] already exists$"):
        simulation.world.spawn("turtle1", 1, 1, 0)
    with pytest.raises(TurtleRejected, match=r"^Tried to kill turtle \[x\], which does not exist$"):
        simulation.world.kill("x")


def test_a_world_has_room_for_a_limited_number_of_turtles() -> None:
    world = Simulation(limit=2).world
    world.spawn("", 1, 1, 0)
    with pytest.raises(TurtleRejected, match="too many turtles; the limit is 2"):
        world.spawn("", 1, 1, 0)


def test_lines_outlive_their_turtle_but_not_clear(simulation: Simulation) -> None:
    simulation.go_to(1.0, 1.0)
    simulation.tick()
    place = simulation.turtle.pixel
    simulation.world.kill("turtle1")
    assert simulation.world.picture.color_at(place) == PEN_COLOR
    simulation.world.clear(TurtleColor(150, 86, 255))
    assert simulation.world.picture.color_at(place) == TurtleColor(150, 86, 255)
    assert simulation.lines[-1] == "Clearing turtlesim."


def test_reset_starts_again(simulation: Simulation) -> None:
    simulation.go_to(1.0, 1.0)
    simulation.tick()
    first = simulation.world.reset()
    assert (first.pose.x, simulation.world.lines_drawn) == (MIDDLE, 0)
    assert simulation.lines[1:] == [
        "Resetting turtlesim.",
        "Spawning turtle [turtle1] at x=[5.544445], y=[5.544445], theta=[0.000000]",
    ]


def test_debug_shows_each_tick(simulation: Simulation) -> None:
    simulation.log.setLevel(logging.DEBUG)
    simulation.tick()
    assert simulation.lines[-1] == "[/turtle1]: pos_x: 5.544445 pos_y: 5.544445 theta: 0.000000"


def test_extreme_values_leave_the_turtle_in_the_world(simulation: Simulation) -> None:
    for value in (1.7e308, -1.7e308):
        simulation.command(value, value, value)
        simulation.turtle.teleport(Teleport(True, value / 1e270, 0.0, 1.0))  # a float32 of a service
        simulation.tick(3)
        pose = simulation.turtle.pose
        assert 0 <= pose.x <= SIDE_M
        assert 0 <= pose.y <= SIDE_M
        assert pose.linear_velocity == math.inf


def test_lines_for_pages_are_limited(simulation: Simulation) -> None:
    for _ in range(LINES_KEPT):
        simulation.turtle.teleport(Teleport(True, 0.1, 0.0, 1.0))
    simulation.command(forwards=1.0)
    simulation.tick(2)
    assert simulation.world.lines_drawn == LINES_KEPT + 2
    assert len(simulation.world.lines) == LINES_KEPT


@pytest.mark.parametrize(
    ("kind", "digest"),
    [("Pose", "863b248d5016ca62ea2e895ae5265cf9"), ("Color", "353891e354491c51aabe32df673fb446")],
)
def test_messages_have_the_genuine_digests(kind: str, digest: str) -> None:
    assert load_message_class(f"turtlesim/{kind}")._md5sum == digest


@pytest.mark.parametrize(("kind", "digest"), [
    ("Spawn", "0b2d2e872a8e2887d5ed626f2bf2c561"), ("Kill", "c1f3d28f1b044c871e6eff2e9fc3c667"),
    ("SetPen", "9f452acce566bf0c0954594f69a8e41b"), ("TeleportAbsolute", "a130bc60ee6513855dc62ea83fcc5b20"),
    ("TeleportRelative", "9d5c2dcd348ac8f76ce2a4307bd63a13"),
])  # fmt: skip
def test_services_have_the_genuine_digests(kind: str, digest: str) -> None:
    assert load_service_class(f"turtlesim/{kind}")._md5sum == digest


# The picture of turtlesim: lines, colours, PNG.


BLUE, RED = TurtleColor(1, 2, 200), TurtleColor(200, 3, 4)


def drawn(*lines: tuple[Point, Point, int]) -> TurtlePicture:
    picture = TurtlePicture(BLUE)
    for start, end, width in lines:
        picture.draw_line(start, end, RED, width)
    return picture


def red_pixels(picture: TurtlePicture) -> set[tuple[int, int]]:
    return {(x, y) for y in range(SIDE) for x in range(SIDE) if picture.color_at((x, y)) == RED}


def test_a_new_picture_has_the_background_everywhere() -> None:
    picture = TurtlePicture(BLUE)
    assert {picture.color_at(place) for place in ((0, 0), (499, 0), (0, 499), (499, 499))} == {BLUE}


def test_a_level_line_is_as_wide_as_its_pen_and_has_square_ends() -> None:
    assert red_pixels(drawn(((10, 20), (14, 20), 3))) == {(x, y) for x in range(9, 16) for y in range(19, 22)}


def test_an_upright_line_has_the_same_shape() -> None:
    assert red_pixels(drawn(((20, 14), (20, 10), 3))) == {(x, y) for x in range(19, 22) for y in range(9, 16)}


def test_width_0_is_one_pixel_wide() -> None:
    assert red_pixels(drawn(((10, 10), (13, 10), 0))) == {(x, 10) for x in range(10, 14)}


def test_a_diagonal_line_has_no_gaps() -> None:
    picture = drawn(((10, 10), (110, 70), 3))
    for step in range(101):
        assert picture.color_at((10 + step, 10 + step * 0.6)) == RED


def test_parts_outside_are_left_out() -> None:
    picture = drawn(((-100, 250), (1e9, 250), 5), ((1e30, -1e30), (2e30, -3e30), 255))
    assert len(red_pixels(picture)) == SIDE * 5
    assert picture.color_at((-5, 250)) == TurtleColor(0, 0, 0)


def test_colors_are_those_of_the_nearest_pixel() -> None:
    picture = drawn(((10, 10), (10, 10), 1))
    assert (picture.color_at((10.4, 9.6)), picture.color_at((10.6, 10))) == (RED, BLUE)


def test_filling_removes_lines() -> None:
    picture = drawn(((10, 10), (400, 300), 9))
    picture.fill(BLUE)
    assert not red_pixels(picture)


def test_the_png_has_the_pixels() -> None:
    png = drawn(((3, 7), (3, 7), 1)).to_png()
    assert (png[:8], struct.unpack(">II", png[16:24])) == (b"\x89PNG\r\n\x1a\n", (SIDE, SIDE))
    length = struct.unpack(">I", png[33:37])[0]
    rows = zlib.decompress(png[41 : 41 + length])
    start = 7 * (1 + SIDE * 3) + 1 + 3 * 3
    assert rows[start : start + 6] == bytes((RED.r, RED.g, RED.b, BLUE.r, BLUE.g, BLUE.b))


# draw_square: four sides and four corners, and the texts of Noetic.


def test_the_turtle_comes_back_to_where_it_began() -> None:
    log, lines = listening_log()
    log.setLevel(1)
    world = TurtleWorld(listening_log()[0])
    turtle = world.turtles["turtle1"]
    square, now_s = Square(log), 0.0
    while len(lines) < 1 + 8 * 2:
        linear, angular = square.velocities(turtle.pose)
        turtle.command(TurtleCommand(linear, 0.0, angular, now_s))
        world.tick(now_s)
        now_s += TICK_S
    assert lines[0] == "New goal [7.544445 5.544445, 0.000000]"
    assert lines[1::2] == ["Reached goal"] * 8
    assert (turtle.x, turtle.y) == (pytest.approx(5.544, abs=0.2), pytest.approx(5.544, abs=0.2))
    assert now_s == pytest.approx(4 * (1.9 + 3.9), abs=2)


# The topics that packages of the core declare; those of navigation need its plugin.


LAUNCH = """<launch>
  <node pkg="twist_mux" type="twist_mux" name="mux"><remap from="cmd_vel_out" to="base/cmd_vel"/></node>
  <node pkg="fake_localization" type="fake_localization" name="fake" ns="r"/>
  <node pkg="urg_node" type="urg_node" name="laser"/>
</launch>"""


def test_the_topics_of_programs_are_those_that_their_packages_declare() -> None:
    found = expected_robot(load([], texts=[LAUNCH]))

    assert found.topics == {"cmd_vel": "/base/cmd_vel", "base_pose_ground_truth": "/r/base_pose_ground_truth"}
    assert "topics of /laser (urg_node/urg_node); if one drives hardware, leave it out" in found.unknown


def test_programs_of_a_plugin_that_is_not_installed_are_named_with_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(plugin_table, "plugin_folders", dict)

    text = "\n".join(expected_robot(load([], texts=[LAUNCH])).unknown)

    assert "topics of a node: urg_node" in text
    assert "pipros-robot" in text
