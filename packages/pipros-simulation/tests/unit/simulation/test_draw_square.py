"""draw_square: four sides and four corners, and the texts of Noetic."""

from __future__ import annotations

import pytest

from pipros_simulation.turtlesim.draw_square import Square
from pipros_simulation.turtlesim.turtle import TICK_S, TurtleCommand
from pipros_simulation.turtlesim.world import TurtleWorld
from tests.support.nodes import listening_log


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
