"""Motion models: move particles by the robot's odometry, with noise.

One model is `sample_motion_model_odometry` of Probabilistic Robotics, table 5.6, for robots that turn and
drive; the other is for robots that also move sideways. The alphas are the parameters `odom_alpha1` to
`odom_alpha5`. The models without `-corrected` use the book's variances as standard deviations, because the
alphas of existing robots are tuned for these models.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from pipros.navigation.plane import Poses, Triple

SHORTEST_M: Final = 0.01
"""The direction of a shorter motion is unknown, so the model assumes no turn before it."""


def moved(
    model: str,
    particles: Poses,
    before: Triple,
    after: Triple,
    alphas: Sequence[float],
    rng: np.random.Generator,
) -> Poses:
    """Return the particles after a motion from one odometry pose to another.

    Args:
        model: `diff`, `omni`, `diff-corrected` or `omni-corrected`.
        particles: poses, shape (n, 3). The resulting yaws are not wrapped.
        before, after: poses of the robot in the odometry frame.
        alphas: five noise parameters.
    """
    is_corrected = model.endswith("-corrected")

    def draw(spread: float) -> Any:
        return rng.normal(0.0, math.sqrt(spread) if is_corrected else spread, len(particles))

    dx, dy = after[0] - before[0], after[1] - before[1]
    distance, turn = math.hypot(dx, dy), _wrapped(after[2] - before[2])
    bearing = _wrapped(math.atan2(dy, dx) - before[2])
    a1, a2, a3, a4, a5 = alphas
    x, y, yaw = particles.T
    if model.startswith("diff"):
        turn1 = 0.0 if distance < SHORTEST_M else bearing
        turn2 = _wrapped(turn - turn1)
        noisy1, noisy2 = _from_straight(turn1), _from_straight(turn2)
        direction = yaw + turn1 - draw(a1 * noisy1**2 + a2 * distance**2)
        along = distance - draw(a3 * distance**2 + a4 * (noisy1**2 + noisy2**2))
        turned = direction + turn2 - draw(a1 * noisy2**2 + a2 * distance**2)
        across: Any = 0.0
    else:
        if not is_corrected:  # this model swaps the meanings of these two alphas
            a1, a4 = a4, a1
        direction = yaw + bearing
        along = distance + draw(a3 * distance**2 + a4 * turn**2)
        turned = yaw + turn + draw(a1 * turn**2 + a2 * distance**2)
        across = draw(a4 * turn**2 + a5 * distance**2)
    cosine, sine = np.cos(direction), np.sin(direction)
    return np.stack((x + along * cosine + across * sine, y + along * sine - across * cosine, turned), axis=1)


def _wrapped(angle: float) -> float:
    return math.remainder(angle, math.tau)


def _from_straight(turn: float) -> float:
    """Return the angle from straight ahead or straight back, whichever is nearer.

    Thus, driving straight back adds no rotational noise.
    """
    return min(abs(_wrapped(turn)), abs(_wrapped(turn - math.pi)))
