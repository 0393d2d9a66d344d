"""One simulated robot: its true pose and its sensors. This module reads no clock and performs no I/O."""

from __future__ import annotations

import math

import numpy as np

from pipros_simulation.robots.battery import Battery
from pipros_simulation.robots.drive import Motion, Pose, moved, relative
from pipros_simulation.robots.settings import RobotSettings

SLIP_S = 1.0
"""Time after which the slip of the wheels changes."""
_STEEPEST = 1.5
"""Greatest angle of front wheels in radians, less than a right angle."""


class SimulatedRobot:
    """State of a robot. Not thread-safe.

    Attributes:
        settings: the settings of the robot.
        pose: the true pose in the map frame.
        odometry: the pose estimated from the wheels, (0, 0, 0) at the start unless the settings say
            otherwise.
        velocity: the motion per second during the last step, computed from the wheels.
        acceleration: acceleration forwards and to the left during the last step, in m/s².
        wheels: angles of the left and the right wheel, in radians.
        wheel_speeds: speeds of the two wheels during the last step, in rad/s.
        is_bumped: whether something blocked the last step.
        battery: the battery.
        random: source of the odometry noise and the wheel slip; separate for each robot.
    """

    def __init__(self, settings: RobotSettings, start: Pose, seed: np.random.SeedSequence) -> None:
        self.settings = settings
        self._start = start
        self._seed = seed
        self._origin = settings.odometry_origin or start
        self.reset()

    def reset(self) -> None:
        """Move back to the starting pose, reset the odometry and battery, and restart the noise sequence."""
        self.battery = Battery(self.settings.battery)
        self.random = np.random.default_rng(self._seed)
        self.odometry = relative(self._origin, self._start)
        forwards, turn = self.settings.odometry_error
        first, second = self.random.uniform(-0.5, 0.5, 2) if forwards or turn else (0.0, 0.0)
        self._error = float(first) * forwards, float(second) * turn
        self.wheels = (0.0, 0.0)
        self._slip_until_s, self._slip = 0.0, np.zeros(2)
        self.place(self._start)

    def noise(self, steps: int, *sensor: int) -> np.random.Generator:
        """Return the noise source for one measurement, which does not depend on earlier measurements."""
        key = (*self._seed.spawn_key, steps, *sensor)
        return np.random.default_rng(np.random.SeedSequence(self._seed.entropy, spawn_key=key))

    def place(self, pose: Pose) -> None:
        """Move the robot to a pose and stop it. The odometry does not change, unless it is exact."""
        self.pose = pose
        if self.settings.is_odometry_exact:
            self.odometry = relative(self._origin, pose)
        self.velocity = Motion()
        self.acceleration = (0.0, 0.0)
        self.wheel_speeds = (0.0, 0.0)
        self.is_bumped = False
        self._command = Motion()
        self._command_s = -math.inf

    def command(self, linear: float, angular: float, now_s: float, sideways: float = 0.0) -> None:
        """Set the velocities (m/s, rad/s), as far as the robot can drive so, at the simulated time `now_s`.

        `angular` is the angle of the steering in radians for the drive `car`. `sideways` only counts for the
        drive `omni`.
        """
        settings = self.settings
        if settings.drive == "car":
            linear, angular = linear * math.cos(angular), linear * math.sin(angular) / settings.wheelbase
        linear = _clipped(linear, settings.max_linear)
        angular = _clipped(angular, settings.max_angular)
        if settings.is_car and settings.least_radius:
            angular = _clipped(angular, abs(linear) / settings.least_radius)
        sideways = _clipped(sideways, settings.max_linear) if settings.drive == "omni" else 0.0
        self._command, self._command_s = Motion(linear, angular, sideways), now_s

    def steer(self, speed: float, angle: float, now_s: float) -> None:
        """Set the speed of a car's rear axle (m/s) and the angle of its front wheels (rad), within limits."""
        speed, angle = _clipped(speed, self.settings.max_linear), _clipped(angle, _STEEPEST)
        if self.settings.drive == "car":
            self.command(speed / math.cos(angle), angle, now_s)
        else:
            self.command(speed, speed * math.tan(angle) / self.settings.wheelbase, now_s)

    def planned(self, now_s: float, duration_s: float) -> Motion:
        """Return the motion of the wheels in the next step, provided that the robot is not blocked."""
        if now_s - self._command_s > self.settings.command_timeout_s or self.battery.is_empty:
            return Motion()
        return self._command.times(duration_s)

    def on_ground(self, motion: Motion, now_s: float) -> Motion:
        """Return the robot's motion over ground for a motion of its wheels: smaller if the wheels slip."""
        if not self.settings.wheel_slip or motion == Motion():
            return motion
        if now_s >= self._slip_until_s:
            self._slip_until_s = now_s + SLIP_S
            self._slip = np.minimum(2 * self.settings.wheel_slip * self.random.random(2), 1.0)
        half = motion.turn * self.settings.wheel_separation / 2
        left, right = (1.0 - self._slip) * (motion.forwards - half, motion.forwards + half)
        turn = float(right - left) / self.settings.wheel_separation
        return Motion(float(left + right) / 2, turn, motion.sideways * float(1.0 - self._slip.mean()))

    def step(self, motion: Motion, ground: Motion, duration_s: float, *, is_blocked: bool) -> None:
        """Perform a motion of the wheels, and the resulting motion over ground.

        If `is_blocked` is true, the robot only turns on the spot, and its wheels turn accordingly; a car
        stands.
        """
        self.is_bumped, settings = is_blocked, self.settings
        if is_blocked:
            turns = 0.0 if settings.is_car else 1.0
            motion, ground = Motion(0.0, turns * motion.turn), Motion(0.0, turns * ground.turn)
        self.pose = moved(self.pose, ground)
        if settings.is_odometry_exact:
            self.odometry = relative(self._origin, self.pose)
        else:
            self.odometry = moved(self.odometry, self._measured(motion))
        before, self.velocity = self.velocity, motion.times(1 / duration_s)
        now = self.velocity
        self.acceleration = (
            (now.forwards - before.forwards) / duration_s - now.sideways * now.turn,
            (now.sideways - before.sideways) / duration_s + now.forwards * now.turn,
        )
        turned = motion.wheels(settings.wheel_separation, settings.wheel_radius)
        self.wheels = self.wheels[0] + turned[0], self.wheels[1] + turned[1]
        self.wheel_speeds = turned[0] / duration_s, turned[1] / duration_s
        highest = settings.max_linear + settings.max_angular * settings.wheel_separation / 2
        speed = max(map(abs, self.wheel_speeds)) * settings.wheel_radius
        self.battery.step(min(speed / highest, 1.0) if highest else 0.0, duration_s)

    def _measured(self, motion: Motion) -> Motion:
        """Return the motion as measured by the odometry."""
        noise = self.settings.odometry_noise
        forwards, turn = 1.0 + self._error[0], 1.0 + self._error[1]
        if noise:
            first, second = noise * self.random.standard_normal(2)
            forwards, turn = forwards + float(first), turn + float(second)
        return Motion(motion.forwards * forwards, motion.turn * turn, motion.sideways * forwards)


def _clipped(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)
