"""Read Stage world files whose walls are defined by a bitmap: https://player-stage-manual.readthedocs.io.

A file has properties (`resolution 0.02`), models (`floorplan ( bitmap "map.png" size [16 16 1] )`), models
inside models, definitions of new model types (`define floorplan model ( … )`), and includes.
`read_stage` returns the first model with a bitmap, and the robots: top-level models of the kind `position`.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_text
from pipros.libraries.maps.picture import read_picture
from pipros.simulation.robots.drive import Pose
from pipros.simulation.robots.errors import InvalidSettings
from pipros.simulation.robots.settings import MAX_RAYS, Laser, RobotSettings
from pipros.simulation.robots.world import World

MAX_MODELS: Final = 10_000
"""Maximum number of models and includes. A model in a definition counts each time the definition is used."""
MAX_DEPTH: Final = 20
"""Maximum nesting depth; models and includes both count."""
DARK_BELOW: Final = 127
"""Pixels with a grey value below this are walls."""

_TOKEN = re.compile(r'\s+|#[^\n]*|(?P<token>"[^"\n]*"|[()\[\]]|[^\s()\[\]"#]+(?:\[\d+\])?)')

Value = float | str | list[float]


@dataclass(slots=True)
class Model:
    """A model, or a definition.

    Attributes:
        kind: name of the built-in kind from which the model is derived, such as `position`.
        values: properties by name.
        parts: the models that it contains.
    """

    kind: str
    values: dict[str, Value] = field(default_factory=dict)
    parts: list[Model] = field(default_factory=list)


def read_stage(file: str) -> tuple[World, list[RobotSettings]]:
    """Return the walls and the robots of a world file.

    Raises:
        InvalidSettings: the file cannot be read, is invalid, or lacks a bitmap or a robot.
        MapError: the bitmap cannot be read.
    """
    models = _StageReader().read(file, 0)
    plan = next((model for model in models if model.kind != "position" and "bitmap" in model.values), None)
    if plan is None:
        raise InvalidSettings(
            f"{file} must contain a model with a bitmap; other kinds of walls are not supported"
        )
    found = [model for model in models if model.kind == "position"]
    if not found:
        raise InvalidSettings(f"{file} must contain a robot (a model of the kind position)")
    names = [""] if len(found) == 1 else [f"robot_{index}" for index in range(len(found))]
    return _world(plan), [_robot(model, name) for model, name in zip(found, names, strict=True)]


class _StageReader:
    """Reads a file and its includes."""

    def __init__(self) -> None:
        self._definitions: dict[str, Model] = {}
        self._models = 0

    def read(self, file: str, depth: int) -> list[Model]:
        try:
            text = read_text(file)
        except (OSError, UnicodeDecodeError, PiprosError) as error:
            raise InvalidSettings(f"cannot read the world {file}: {error}") from None
        tokens = list(_tokens(text, file))[::-1]
        return self._body(tokens, Model(""), file, depth).parts

    def _body(self, tokens: list[str], into: Model, file: str, depth: int) -> Model:
        """Read properties and models up to the closing bracket, or to the end of the file at top level."""
        if depth > MAX_DEPTH:
            raise InvalidSettings(f"{file}: models and includes must be nested at most {MAX_DEPTH} deep")
        is_top = into.kind == ""
        while tokens:
            word = tokens.pop()
            if word == ")" and not is_top:
                return into
            if word == "include":
                self._count(1, file)
                path = os.path.join(os.path.dirname(file), _popped(tokens, file).strip('"'))
                into.parts += self.read(path, depth + 1)
            elif word == "define":
                name, base = _popped(tokens, file), _popped(tokens, file)
                self._definitions[name] = self._model(base, tokens, file, depth)
            elif tokens and tokens[-1] == "(":
                into.parts.append(self._model(word, tokens, file, depth))
            else:
                into.values[word] = self._value(tokens, file, word, into)
        if not is_top:
            raise InvalidSettings(f"{file}: a closing bracket ')' is missing")
        return into

    def _model(self, kind: str, tokens: list[str], file: str, depth: int) -> Model:
        if _popped(tokens, file) != "(":
            raise InvalidSettings(f"{file}: {kind} must be followed by '('")
        base = self._definitions.get(kind)
        start = Model(kind) if base is None else Model(base.kind, dict(base.values), list(base.parts))
        self._count(1 + len(start.parts), file)
        start.values["folder"] = start.values.get("folder", os.path.dirname(file))
        return self._body(tokens, start, file, depth + 1)

    def _count(self, count: int, file: str) -> None:
        self._models += count
        if self._models > MAX_MODELS:
            raise InvalidSettings(f"{file} must have at most {MAX_MODELS} models and includes")

    def _value(self, tokens: list[str], file: str, key: str, into: Model) -> Value:
        word = _popped(tokens, file)
        if key == "bitmap":
            into.values["folder"] = os.path.dirname(file)
        if word != "[":
            return word[1:-1] if word.startswith('"') else _number_or_word(word)
        numbers: list[float] = []
        while (word := _popped(tokens, file)) != "]":
            value = _number_or_word(word)
            if isinstance(value, float):  # words in a list, such as names, are ignored
                numbers.append(value)
        return numbers


def _tokens(text: str, file: str) -> Iterator[str]:
    place = 0
    while place < len(text):
        found = _TOKEN.match(text, place)
        if found is None:
            line = text.count("\n", 0, place) + 1
            raise InvalidSettings(f"{file}:{line}: a closing quote is missing")
        place = found.end()
        if found["token"]:
            yield found["token"]


def _popped(tokens: list[str], file: str) -> str:
    if not tokens:
        raise InvalidSettings(f"{file} ends in the middle of a model or a property")
    return tokens.pop()


def _number_or_word(word: str) -> float | str:
    try:
        value = float(word)
    except ValueError:
        return word
    return value if math.isfinite(value) else word


def _numbers(model: Model, key: str, default: list[float]) -> list[float]:
    """Return the numbers in a property. Missing numbers are taken from the default."""
    value = model.values.get(key, default)
    if not isinstance(value, list):
        raise InvalidSettings(f"{key} of a {model.kind} must be a list of numbers, got {value!r}")
    return [*value, *default[len(value) :]]


def _single(model: Model, key: str, default: float) -> float:
    value = model.values.get(key, default)
    if not isinstance(value, float | int):
        raise InvalidSettings(f"{key} of a {model.kind} must be a number, got {value!r}")
    return float(value)


def _world(plan: Model) -> World:
    folder = str(plan.values["folder"])
    picture = read_picture(os.path.join(folder, str(plan.values["bitmap"])))
    width, height, *_ = _numbers(plan, "size", [1.0, 1.0, 1.0])
    x, y, _, turn, *_ = _numbers(plan, "pose", [0.0, 0.0, 0.0, 0.0])
    if turn % 90:
        raise InvalidSettings(f"the bitmap can only be rotated by multiples of 90 degrees, got {turn:g}")
    resolution = width / picture.width
    if resolution <= 0 or abs(height / picture.height / resolution - 1) > 0.02:
        raise InvalidSettings(
            "size must be > 0 and match the aspect ratio of the bitmap "
            f"({picture.width} x {picture.height} pixels), got {width} x {height} m"
        )
    shape = len(picture.colors), picture.height, picture.width
    grey = np.frombuffer(b"".join(picture.colors), np.uint8).reshape(shape).mean(axis=0)
    # With the lowest row first, a positive rotation of the array is clockwise.
    walls = np.rot90(grey[::-1] < DARK_BELOW, -round(turn / 90))
    rows, columns = walls.shape
    return World.from_cells(walls, resolution, (x - columns * resolution / 2, y - rows * resolution / 2))


def _robot(model: Model, name: str) -> RobotSettings:
    x, y, _, turn, *_ = _numbers(model, "pose", [0.0, 0.0, 0.0, 0.0])
    length, width, *_ = _numbers(model, "size", [0.4, 0.4, 0.4])
    radius = max(length, width) / 2
    if radius <= 0:
        raise InvalidSettings(f"a robot's size must be > 0, got {length} x {width}")
    return RobotSettings(
        name,
        start=Pose(x, y, math.radians(math.remainder(turn, 360))),
        radius=radius,
        max_linear=10.0,
        max_angular=10.0,
        command_timeout_s=0.2,
        laser=_laser(model),
    )


def _laser(robot: Model) -> Laser | None:
    """Return a robot's first scanner (a `laser`, or a `ranger` with a `sensor`), or None if it has none."""
    for part in robot.parts:
        if part.kind not in ("laser", "ranger"):
            continue
        sensor = next((each for each in part.parts if each.kind == "sensor"), part)
        nearest, farthest = _numbers(sensor, "range", [0.0, _single(sensor, "range_max", 8.0)])[:2]
        angle = math.radians(_single(sensor, "fov", 180.0))
        rays = round(_single(sensor, "samples", 180.0))
        x, y, _, turn, *_ = _numbers(part, "pose", [0.0, 0.0, 0.0, 0.0])
        if not (0 < angle <= math.tau + 1e-6 and 0 < rays <= MAX_RAYS and 0 <= nearest < farthest):
            raise InvalidSettings(
                f"a scanner needs a fov above 0 and at most 360, 1 to {MAX_RAYS} samples, and a range with "
                f"0 <= min < max, got fov {math.degrees(angle):g}, samples {rays}, "
                f"range {nearest:g} to {farthest:g}"
            )
        usual = Laser(rays, -angle / 2, angle, nearest, farthest, 0.0, no_echo=farthest)
        return replace(usual, x=x, y=y, yaw=math.radians(turn))
    return None
