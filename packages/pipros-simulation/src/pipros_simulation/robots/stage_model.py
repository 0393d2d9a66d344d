"""Models in a Stage world file, and their properties."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from pipros_simulation.robots.drive import Pose
from pipros_simulation.robots.errors import InvalidSettings

Value = float | str | list[float]


@dataclass(slots=True)
class Model:
    """A model, or a definition.

    Attributes:
        kind: name of the built-in kind from which the model is derived, such as `position`.
        values: properties by name.
        parts: the models that it contains.
        count: number of models: itself, and all that it contains directly or indirectly.
    """

    kind: str
    values: dict[str, Value] = field(default_factory=dict)
    parts: list[Model] = field(default_factory=list)
    count: int = 1


def numbers(model: Model, key: str, default: list[float]) -> list[float]:
    """Return the numbers in a property. Missing numbers are taken from the default."""
    value = model.values.get(key, default)
    if not isinstance(value, list):
        raise InvalidSettings(f"{key} of a {model.kind} must be a list of numbers, got {value!r}")
    return [*value, *default[len(value) :]]


def single(model: Model, key: str, default: float) -> float:
    """Return the number in a property."""
    value = model.values.get(key, default)
    if not isinstance(value, float | int):
        raise InvalidSettings(f"{key} of a {model.kind} must be a number, got {value!r}")
    return float(value)


def pose_of(model: Model, key: str = "pose") -> Pose:
    """Return the pose in a property, without its height."""
    x, y, _, turn, *_ = numbers(model, key, [0.0, 0.0, 0.0, 0.0])
    return Pose(x, y, math.radians(math.remainder(turn, 360)))
