"""The Teleop tab stops its robot also while other browsers keep the server's event loop busy."""

import asyncio
from concurrent.futures import Future
from types import SimpleNamespace
from typing import Any

import pytest

from pipros_page.steering import SILENCE_S, ZERO, Velocity, VelocityCommands
from pipros_page.views.teleop import TeleopViews
from tests.support.waiting import wait_until

SESSION = {"name": "/cmd_vel", "linear": 1.0, "angular": 1.0, "session": "mine"}


class Wheels:
    """A publisher that records velocities."""

    connection_count = 1

    def __init__(self, refuses: bool = False) -> None:
        self.velocities: list[float] = []
        self.refuses = refuses

    def publish(self, message: Any) -> None:
        if self.refuses:
            raise ValueError("the policy refuses this")
        self.velocities.append(message.linear.x)

    def unregister(self) -> None:
        self.refuses = True


def views(wheels: Wheels) -> TeleopViews:
    def start(*_: object, **__: object) -> Future[Any]:
        advertising: Future[Any] = Future()
        advertising.set_result(wheels)
        return advertising

    system: Any = SimpleNamespace(
        questions=SimpleNamespace(start=start), gate=SimpleNamespace(advertise=None)
    )
    return TeleopViews(system)


@pytest.mark.parametrize("is_silent", [True, False])
def test_a_robot_stops_if_its_browser_is_silent_in_a_blocked_loop_or_its_view_ends(is_silent: bool) -> None:
    wheels = Wheels()

    async def scenario() -> None:
        teleop = views(wheels)
        view = teleop.teleop(SESSION)
        await anext(view)
        await teleop.steer({"session": "mine", "linear": 0.5, "angular": 0.0})
        # from here on, nothing else runs in this loop
        assert wait_until(lambda: 0.5 in wheels.velocities)
        assert not is_silent or wait_until(lambda: wheels.velocities[-1:] == [0.0])
        await view.aclose()  # type: ignore[attr-defined]
        assert wheels.velocities[-1] == 0.0

    asyncio.run(scenario())


def test_a_refused_velocity_ends_the_view_with_its_reason() -> None:
    async def scenario() -> None:
        wheels = Wheels(refuses=True)
        teleop = views(wheels)
        view = teleop.teleop(SESSION)
        await anext(view)
        await teleop.steer({"session": "mine", "linear": 0.5, "angular": 0.0})
        with pytest.raises(ValueError, match="the policy refuses this"):
            [value async for value in view]

    asyncio.run(scenario())


# Velocity commands: limits, silence, and the one command that stops the robot.


MOST = Velocity(0.5, 1.0)


def test_a_command_is_repeated_until_the_browser_falls_silent() -> None:
    commands = VelocityCommands(MOST)
    commands.steer(Velocity(0.3, -0.2), 10.0)
    assert commands.due(10.0) == Velocity(0.3, -0.2)
    assert commands.due(10.0 + SILENCE_S - 0.01) == Velocity(0.3, -0.2)
    assert commands.due(10.0 + SILENCE_S) == ZERO
    assert commands.due(10.7) is None


def test_silence_does_not_let_an_old_command_return() -> None:
    commands = VelocityCommands(MOST)
    commands.steer(Velocity(0.3, 0.0), 10.0)
    assert commands.due(10.0) == Velocity(0.3, 0.0)
    assert commands.due(11.0) == ZERO
    assert commands.due(10.1) is None  # even for a clock that went back


def test_letting_go_stops_the_robot_once() -> None:
    commands = VelocityCommands(MOST)
    commands.steer(Velocity(0.3, 0.0), 10.0)
    commands.due(10.0)
    commands.steer(ZERO, 10.1)
    assert commands.due(10.1) == ZERO
    assert commands.due(10.2) is None
    assert commands.end() is None


def test_the_end_stops_a_moving_robot_once() -> None:
    commands = VelocityCommands(MOST)
    assert commands.end() is None
    commands.steer(Velocity(0.3, 0.0), 10.0)
    commands.due(10.0)
    assert commands.end() == ZERO
    assert commands.end() is None


def test_commands_are_reduced_to_the_limits() -> None:
    commands = VelocityCommands(MOST)
    commands.steer(Velocity(9.0, -9.0), 10.0)
    assert commands.due(10.0) == Velocity(0.5, -1.0)
