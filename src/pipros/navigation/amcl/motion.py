"""Motion models: move particles by the robot's odometry, with noise.

The models are `sample_motion_model_odometry` of Probabilistic Robotics, table 5.6, for robots that turn and
drive, and one for robots that also move sideways. The alphas are the parameters `odom_alpha1` to
`odom_alpha5`. The models without `-corrected` use an expression as a standard deviation that the book uses as
a variance, because the alphas of existing robots are tuned for it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Pose2 = tuple[float, float, float]
"""x and y in metres, yaw in radians."""

SHORTEST_M: Final = 0.01
"""The direction of a shorter motion is not known: it counts as no turn before the motion."""


def angle_between(one: float, other: float) -> float:
    """Return `one - other`, wrapped to [-pi, pi]."""
    return math.remainder(one - other, math.tau)


def moved(
    model: str,
    particles: Array,
    before: Pose2,
    after: Pose2,
    alphas: Sequence[float],
    rng: np.random.Generator,
) -> Array:
    """Return the particles after the motion from one odometry pose to another.

    Args:
        model: `diff`, `omni`, `diff-corrected` or `omni-corrected`.
        particles: poses, shape (n, 3). The yaw of a result is not wrapped.
        before, after: poses of the robot in the odometry frame.
        alphas: five noise parameters.
    """
    move = _omni if model.startswith("omni") else _diff
    return move(particles, before, after, alphas, rng, model.endswith("-corrected"))


def _diff(
    particles: Array,
    before: Pose2,
    after: Pose2,
    alphas: Sequence[float],
    rng: np.random.Generator,
    is_corrected: bool,
) -> Array:
    a1, a2, a3, a4 = alphas[:4]
    dx, dy = after[0] - before[0], after[1] - before[1]
    distance = math.hypot(dx, dy)
    turn1 = 0.0 if distance < SHORTEST_M else angle_between(math.atan2(dy, dx), before[2])
    turn2 = angle_between(angle_between(after[2], before[2]), turn1)
    noisy1, noisy2 = _from_straight(turn1), _from_straight(turn2)
    draw = _drawer(len(particles), rng, is_corrected)
    first = turn1 - draw(a1 * noisy1**2 + a2 * distance**2)
    along = distance - draw(a3 * distance**2 + a4 * (noisy1**2 + noisy2**2))
    second = turn2 - draw(a1 * noisy2**2 + a2 * distance**2)
    x, y, yaw = particles.T
    return np.stack(
        (x + along * np.cos(yaw + first), y + along * np.sin(yaw + first), yaw + first + second), axis=1
    )


def _omni(
    particles: Array,
    before: Pose2,
    after: Pose2,
    alphas: Sequence[float],
    rng: np.random.Generator,
    is_corrected: bool,
) -> Array:
    a1, a2, a3, a4, a5 = alphas
    if not is_corrected:  # this model exchanges the meanings of the two
        a1, a4 = a4, a1
    dx, dy = after[0] - before[0], after[1] - before[1]
    distance, turn = math.hypot(dx, dy), angle_between(after[2], before[2])
    draw = _drawer(len(particles), rng, is_corrected)
    along = distance + draw(a3 * distance**2 + a4 * turn**2)
    turned = turn + draw(a1 * turn**2 + a2 * distance**2)
    across = draw(a4 * turn**2 + a5 * distance**2)
    x, y, yaw = particles.T
    bearing = yaw + angle_between(math.atan2(dy, dx), before[2])
    cosine, sine = np.cos(bearing), np.sin(bearing)
    return np.stack(
        (x + along * cosine + across * sine, y + along * sine - across * cosine, yaw + turned), axis=1
    )


def _from_straight(turn: float) -> float:
    """Return the angle to the nearer of ahead and behind, so that driving backwards adds no noise."""
    return min(abs(angle_between(turn, 0.0)), abs(angle_between(turn, math.pi)))


def _drawer(count: int, rng: np.random.Generator, is_corrected: bool) -> Callable[[float], Array]:
    def draw(spread: float) -> Array:
        return rng.normal(0.0, math.sqrt(spread) if is_corrected else spread, count)

    return draw
