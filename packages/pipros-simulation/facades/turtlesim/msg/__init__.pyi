"""Messages of turtlesim, made from their definitions by `pipros stubs`."""

from pipros.msg import base as _base

class Color(_base.Message):
    """The colour of the picture under a turtle: background or lines, not turtles."""
    r: int
    """red"""
    g: int
    """green"""
    b: int
    """blue"""
    def __init__(self, r: int | None = ..., g: int | None = ..., b: int | None = ...) -> None: ...

class Pose(_base.Message):
    """Pose and velocity of a turtle, published in every tick."""
    x: float
    """m, from the left edge"""
    y: float
    """m, from the lower edge"""
    theta: float
    """rad, from the x axis, counter-clockwise, in [-pi, pi)"""
    linear_velocity: float
    """m/s, never negative"""
    angular_velocity: float
    """rad/s, counter-clockwise"""
    def __init__(self, x: float | None = ..., y: float | None = ..., theta: float | None = ..., linear_velocity: float | None = ..., angular_velocity: float | None = ...) -> None: ...
