"""Read Stage world files: https://player-stage-manual.readthedocs.io.

A file has properties (`resolution 0.02`), models (`floorplan ( bitmap "map.png" size [16 16 1] )`), models
inside models, definitions of new model types (`define floorplan model ( … )`), and includes.
The robots are the top-level models of the kind `position`; `stage_walls` reads all other models as walls.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Final, NamedTuple

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_text
from pipros_simulation.robots.errors import InvalidSettings
from pipros_simulation.robots.settings import MAX_RAYS, Laser, RobotSettings
from pipros_simulation.robots.stage_model import Model, Value, numbers, pose_of, single
from pipros_simulation.robots.stage_walls import world_of
from pipros_simulation.robots.world import World

MAX_MODELS: Final = 10_000
"""Maximum number of models and includes. A model in a definition counts each time the definition is used."""
MAX_DEPTH: Final = 20
"""Maximum nesting depth; models and includes both count."""

_TOKEN = re.compile(r'\s+|#[^\n]*|(?P<token>"[^"\n]*"|[()\[\]]|[^\s()\[\]"#]+(?:\[\d+\])?)')

_READ: Final = {
    "": {"resolution", "threads", "show_clock", "show_clock_interval"},
    "position": {"pose", "size", "localization", "localization_origin", "odom_error", "drive", "wheelbase"},
    "laser": {"pose", "range", "range_max", "fov", "samples", "size"},
    "ranger": {"pose", "range", "range_max", "fov", "samples", "size"},
    "sensor": {"range", "range_max", "fov", "samples", "size"},
    "model": {"pose", "origin", "size", "bitmap", "boundary", "obstacle_return"},
}
"""The properties that are read, or change nothing here, by the kind of the model."""
_LOOKS: Final = ("color", "gui_", "name", "folder", "fiducial_", "ctrl", "map_resolution")
"""Beginnings of the names of properties that change no measurement."""


class Stage(NamedTuple):
    """The contents of a world file.

    Attributes:
        unused: a text for each kind of model or property that the simulation lacks.
    """

    world: World
    robots: list[RobotSettings]
    unused: list[str]


def read_stage(file: str) -> Stage:
    """Return the walls and the robots of a world file.

    Raises:
        InvalidSettings: the file cannot be read, is invalid, or lacks walls or a robot.
        MapError: a bitmap cannot be read.
    """
    top = _StageReader().read(file, 0)
    found = [model for model in top.parts if model.kind == "position"]
    if not found:
        raise InvalidSettings(f"{file} must contain a robot (a model of the kind position)")
    names = [""] if len(found) == 1 else [f"robot_{index}" for index in range(len(found))]
    robots = [_robot(model, name) for model, name in zip(found, names, strict=True)]
    try:
        world = world_of(top.parts, [pose_of(model) for model in found])
    except InvalidSettings as error:
        raise InvalidSettings(f"{file}: {error}") from None
    return Stage(world, robots, list(dict.fromkeys(_unused(top))))


def _unused(model: Model) -> Iterator[str]:
    kind = f"a {model.kind}" if model.kind else "the world"
    for key in model.values:
        if key not in _READ.get(model.kind, _READ["model"]) and not key.startswith(_LOOKS):
            yield f"{key} of {kind} has no effect"
    scanners = 0
    for part in model.parts:
        scanners += part.kind in ("laser", "ranger")
        if part.kind in ("window", "block"):
            continue
        if model.kind == "position" and part.kind not in ("laser", "ranger"):
            yield f"a {part.kind} of a position is not simulated"
        elif model.kind == "position" and scanners > 1:
            yield "only the first scanner of a position is simulated"
        else:
            yield from _unused(part)


class _StageReader:
    """Reads a file and its includes."""

    def __init__(self) -> None:
        self._definitions: dict[str, Model] = {}
        self._models = 0

    def read(self, file: str, depth: int) -> Model:
        try:
            text = read_text(file)
        except (OSError, UnicodeDecodeError, PiprosError) as error:
            raise InvalidSettings(f"cannot read the world {file}: {error}") from None
        tokens = list(_tokens(text, file))[::-1]
        return self._body(tokens, Model(""), file, depth)

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
                included = self.read(path, depth + 1)
                into.parts += included.parts
                into.values |= included.values
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
        self._count(1 + sum(part.count for part in start.parts), file)
        start.values["folder"] = start.values.get("folder", os.path.dirname(file))
        made = self._body(tokens, start, file, depth + 1)
        made.count = 1 + sum(part.count for part in made.parts)
        return made

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


def _robot(model: Model, name: str) -> RobotSettings:
    length, width, height, *_ = numbers(model, "size", [0.4, 0.4, 0.4])
    radius = max(length, width) / 2
    if radius <= 0:
        raise InvalidSettings(f"a robot's size must be > 0, got {length} x {width}")
    localization = model.values.get("localization", "gps")
    if localization not in ("gps", "odom"):
        raise InvalidSettings(f"localization must be gps or odom, got {localization!r}")
    drive, wheelbase = model.values.get("drive", "diff"), single(model, "wheelbase", 1.0)
    if drive not in ("diff", "omni", "car") or wheelbase <= 0:
        raise InvalidSettings(
            f"drive must be diff, omni or car, and wheelbase > 0, got {drive!r} and {wheelbase}"
        )
    errors = numbers(model, "odom_error", [0.03, 0.03, 0.0, 0.05])
    has_origin = "localization_origin" in model.values
    return RobotSettings(
        name,
        start=pose_of(model),
        radius=radius,
        drive=str(drive),
        wheelbase=wheelbase,
        max_linear=10.0,
        max_angular=10.0,
        command_timeout_s=0.2,
        odometry_error=(errors[0], errors[3]) if localization == "odom" else (0.0, 0.0),
        odometry_origin=pose_of(model, "localization_origin") if has_origin else None,
        is_odometry_exact=localization == "gps",
        laser=_laser(model, height),
    )


def _laser(robot: Model, height: float) -> Laser | None:
    """Return a robot's first scanner (a `laser`, or a `ranger` with a `sensor`), or None if it has none.

    A part stands on the robot, so `height`, the robot's, is added to the scanner's own.
    """
    for part in robot.parts:
        if part.kind not in ("laser", "ranger"):
            continue
        sensor = next((each for each in part.parts if each.kind == "sensor"), part)
        nearest, farthest = numbers(sensor, "range", [0.0, single(sensor, "range_max", 8.0)])[:2]
        angle = math.radians(single(sensor, "fov", 180.0))
        rays = round(single(sensor, "samples", 180.0))
        x, y, z, turn, *_ = numbers(part, "pose", [0.0, 0.0, 0.0, 0.0])
        if not (0 < angle <= math.tau + 1e-6 and 0 < rays <= MAX_RAYS and 0 <= nearest < farthest):
            raise InvalidSettings(
                f"a scanner needs a fov above 0 and at most 360, 1 to {MAX_RAYS} samples, and a range with "
                f"0 <= min < max, got fov {math.degrees(angle):g}, samples {rays}, "
                f"range {nearest:g} to {farthest:g}"
            )
        usual = Laser(rays, -angle / 2, angle, nearest, farthest, 0.0, no_echo=farthest)
        return replace(usual, x=x, y=y, yaw=math.radians(turn), z=height + z)
    return None
