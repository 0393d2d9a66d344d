"""Rotation by dragging a virtual ball, after K. Shoemake, "Arcball rotation control", Graphics Gems IV.

Window points are (x, y) in pixels, with y downwards. Points on the unit sphere have the shape (3,).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from pipros_libraries.transforms.matrices.arrays import EPSILON, Array, unit_vector
from pipros_libraries.transforms.matrices.quaternions import (
    quaternion_from_matrix,
    quaternion_matrix,
    quaternion_multiply,
    quaternion_slerp,
)


class Arcball:
    """A virtual trackball. Call `down` when a mouse button is pressed, and `drag` when the mouse moves.

    Attributes:
        axes: unit vectors (each of shape (3,)), one of which is the rotation axis while `is_constrained` is
            true; None for no axes.
        is_constrained: whether the axes constrain rotations.

    >>> ball = Arcball()
    >>> ball.place((320, 320), 320)
    >>> ball.down((500, 250))
    >>> ball.drag((475, 275))
    >>> round(float(ball.matrix()[0, 0]), 5)
    0.97876
    """

    def __init__(self, initial: ArrayLike | None = None) -> None:
        """Set the initial rotation, a quaternion or a 4x4 matrix.

        Raises ValueError if its shape is invalid.
        """
        self._axis: Array | None = None
        self.axes: Sequence[ArrayLike] | None = None
        self._radius = 1.0
        self._centre = [0.0, 0.0]
        self._grabbed = np.array((0.0, 0.0, 1.0))
        self.is_constrained = False
        if initial is None:
            self._at_grab = np.array((0.0, 0.0, 0.0, 1.0))
        else:
            given = np.array(initial, dtype=np.float64)
            if given.shape == (4, 4):
                self._at_grab = quaternion_from_matrix(given)
            elif given.shape == (4,):
                self._at_grab = given / np.sqrt(given @ given)
            else:
                raise ValueError(f"initial must have shape (4,) or (4, 4), got {given.shape}")
        self._before = self._now = self._at_grab

    def place(self, center: Sequence[float], radius: float) -> None:
        """Set the centre and the radius of the ball in window coordinates."""
        self._radius = float(radius)
        self._centre = [center[0], center[1]]

    def down(self, point: Sequence[float]) -> None:
        """Grab the ball at a window point."""
        self._grabbed = arcball_map_to_sphere(point, self._centre, self._radius)
        self._at_grab = self._before = self._now
        if self.is_constrained and self.axes is not None:
            self._axis = arcball_nearest_axis(self._grabbed, self.axes)
            self._grabbed = arcball_constrain_to_axis(self._grabbed, self._axis)
        else:
            self._axis = None

    def drag(self, point: Sequence[float]) -> None:
        """Rotate the ball so that the grabbed point moves to this window point."""
        reached = arcball_map_to_sphere(point, self._centre, self._radius)
        if self._axis is not None:
            reached = arcball_constrain_to_axis(reached, self._axis)
        self._before = self._now
        across = np.cross(self._grabbed, reached)
        if across @ across < EPSILON:
            self._now = self._at_grab
        else:
            turn = (across[0], across[1], across[2], float(self._grabbed @ reached))
            self._now = quaternion_multiply(turn, self._at_grab)

    def next(self, acceleration: float = 0.0) -> None:
        """Continue the last rotation, at the same speed if `acceleration` is 0."""
        self._before, self._now = self._now, quaternion_slerp(self._before, self._now, 2.0 + acceleration)

    def matrix(self) -> Array:
        """Return the rotation as a 4x4 matrix."""
        return quaternion_matrix(self._now)


def arcball_map_to_sphere(point: Sequence[float], center: Sequence[float], radius: float) -> Array:
    """Return the point on the unit sphere under a window point.

    If the window point is outside the ball, return the nearest point on the ball's rim.
    """
    x = (point[0] - center[0]) / radius
    y = (center[1] - point[1]) / radius
    square = x * x + y * y
    if square > 1.0:
        length = math.sqrt(square)
        return np.array((x / length, y / length, 0.0))
    return np.array((x, y, math.sqrt(1.0 - square)))


def arcball_constrain_to_axis(point: ArrayLike, axis: ArrayLike) -> Array:
    """Project a point onto the plane through the origin perpendicular to `axis`.

    Return the result as a unit vector with z >= 0.
    """
    around = np.array(axis, dtype=np.float64)
    given = np.array(point, dtype=np.float64)
    across: Array = given - around * (around @ given)
    length = math.sqrt(float(across @ across))
    if length > EPSILON:
        return -across / length if across[2] < 0.0 else across / length
    if around[2] == 1.0:
        return np.array((1.0, 0.0, 0.0))
    return np.asarray(unit_vector((-around[1], around[0], 0.0)))


def arcball_nearest_axis(point: ArrayLike, axes: Sequence[ArrayLike]) -> Array:
    """Return the axis for which `arcball_constrain_to_axis` returns the point nearest to `point`."""
    given = np.array(point, dtype=np.float64)
    nearness = [float(arcball_constrain_to_axis(given, axis) @ given) for axis in axes]
    return np.asarray(axes[nearness.index(max(nearness))])
