"""Inputs and expected results for the JavaScript of the page, computed by the Python that it corresponds to.

`tests.support.page_checks` writes them as JSON for `tests/page/unit`. Times, and integers that JavaScript's
numbers cannot represent, are texts.
"""

import math
import random
from collections.abc import Callable, Mapping
from io import BytesIO
from typing import Any

import numpy as np

from image_geometry import PinholeCameraModel
from pipros.msg import load_message_class
from pipros.msg.time import Duration, Time
from pipros_libraries.transforms.buffer import TransformBuffer
from pipros_libraries.transforms.errors import TransformException
from pipros_libraries.transforms.pose import Pose, roll_pitch_yaw
from pipros_page.messages.layout import message_layout
from pipros_page.stale import is_stale
from tests.support.random_messages import fill_at_random, shipped_types

SECOND = 1_000_000_000
QUARTER = math.sqrt(0.5)
TABS = ("plot", "console", "images", "topics")


def random_pose(chance: random.Random) -> Pose:
    x, y, z, w = _unit([chance.gauss(0, 1) for _ in range(4)])
    return (chance.uniform(-9, 9), chance.uniform(-9, 9), chance.uniform(-9, 9), x, y, z, w)


def _unit(values: list[float]) -> list[float]:
    norm = math.sqrt(sum(value * value for value in values))
    return [value / norm for value in values]


def frames(chance: random.Random) -> Any:
    """Return transforms, and the results of lookups by the library: a pose, or an error's name and text."""
    names = [f"f{number}" for number in range(14)]
    buffer = TransformBuffer()
    inserts: list[Any] = []

    def insert(parent: str, child: str, stamp: int, is_static: bool) -> None:
        pose = random_pose(chance)
        buffer.insert(parent, child, stamp, pose, "test", is_static=is_static)
        inserts.append([parent, child, str(stamp), list(pose), is_static])

    for _ in range(1200):
        child = chance.randrange(1, 12)
        parent = names[chance.randrange(child)] if chance.random() < 0.05 else names[child // 2]
        insert(parent, names[child], 100 * SECOND + chance.randrange(13 * SECOND), child % 5 == 0)
    insert(names[12], names[13], 110 * SECOND, False)
    lookups = []
    for _ in range(10_000):
        target, source = (chance.choice([*names, "missing", "", "/f1"]) for _ in range(2))
        time = chance.choice([0, 99, *range(103, 114)]) * SECOND
        time += chance.randrange(SECOND) if time else 0
        answer: list[Any]
        try:
            answer = list(buffer.lookup(target, source, time)[1])
        except TransformException as error:
            answer = [type(error).__name__, str(error).split("\n")[0]]
        lookups.append([target, source, str(time), answer])
    return {"inserts": inserts, "lookups": lookups}


def angles(chance: random.Random) -> Any:
    """Return quaternions of any norm with their roll, pitch and yaw in degrees."""
    found = []
    turns = [random_pose(chance)[3:] for _ in range(300)]
    locked = [(0.0, QUARTER, 0.0, QUARTER), (0.0, -QUARTER, 0.0, QUARTER), (0.5, 0.5, -0.5, 0.5)]
    for turn in (*turns, *locked):
        size = chance.uniform(0.5, 2.0) if turn not in locked else 1.0
        own = [size * value for value in turn]
        degrees = [math.degrees(value) for value in roll_pitch_yaw((0.0, 0.0, 0.0, *own))]  # type: ignore[arg-type]
        found.append([own, degrees])
    return found


def stale(chance: random.Random) -> Any:
    """Return ages, intervals, and whether the data are stale."""
    pairs = [(chance.uniform(0, 30), chance.choice([None, chance.uniform(0, 4)])) for _ in range(300)]
    return [[age_s, interval_s, is_stale(age_s, interval_s)] for age_s, interval_s in pairs]


def plain(value: Any, kind: str) -> Any:
    """Return a field's value as the test in JavaScript writes it."""
    base, bracket, _ = kind.partition("[")
    if bracket:
        return [plain(each, base) for each in value]
    if isinstance(value, (Time, Duration)):
        return str(value.to_nsec())
    if base in ("int64", "uint64"):
        return str(value)
    if base == "bool":
        return int(value)
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if hasattr(value, "__slots__"):
        fields = zip(value.__slots__, value._slot_types, strict=True)
        return {name: plain(getattr(value, name), field) for name, field in fields}
    return value


def messages(chance: random.Random) -> Any:
    """Return a random message of every included type: its layout, its bytes, and its fields."""
    found = []
    for name in shipped_types():
        cls: Any = load_message_class(name)
        message = fill_at_random(cls(), chance)
        buffer = BytesIO()
        message.serialize(buffer)
        layout = message_layout(name, cls._full_text)
        found.append([name, layout, buffer.getvalue().hex(), plain(message, name)])
    return found


def cameras(chance: random.Random) -> Any:
    """Return cameras, points in front of them, and the pixels that image_geometry computes."""
    found = []
    info_class: Any = load_message_class("sensor_msgs/CameraInfo")
    for number in range(50):
        info = info_class(width=640, height=480)
        fx, fy = chance.uniform(200, 900), chance.uniform(200, 900)
        cx, cy = chance.uniform(250, 400), chance.uniform(200, 300)
        info.K = [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
        info.R = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
        info.P = [fx, 0, cx, -fx * chance.uniform(0, 0.2) * (number % 2), 0, fy, cy, 0, 0, 0, 1, 0]
        camera = PinholeCameraModel()
        camera.fromCameraInfo(info)
        points = [(chance.uniform(-1, 1), chance.uniform(-1, 1), chance.uniform(0.5, 20)) for _ in range(20)]
        pixels = [[float(value) for value in camera.project3dToPixel(point)] for point in points]
        pose = random_pose(chance)
        found.append({"P": list(map(float, info.P)), "pose": list(pose), "points": points, "pixels": pixels})
    return found


def _orbit(yaw: float, pitch: float, distance: float, focus: Any) -> Any:
    back = [math.cos(yaw) * math.cos(pitch), math.sin(yaw) * math.cos(pitch), math.sin(pitch)]
    return focus + distance * np.array(back)


def views(chance: random.Random) -> Any:
    """Return movements of the view Orbit, and where its camera and its focal point are afterwards."""
    found = []
    for _ in range(50):
        yaw, pitch, distance = chance.uniform(-3, 3), chance.uniform(-1, 1), chance.uniform(1, 20)
        focus = np.array([chance.uniform(-5, 5) for _ in range(3)])
        start = {"Yaw": yaw, "Pitch": pitch, "Distance": distance, "Focal Point": focus.tolist()}
        steps, states = [], []
        for _ in range(5):
            kind = chance.choice(["rotate", "zoom", "pan"])
            dx, dy = chance.randint(-80, 80), chance.randint(-80, 80)
            if kind == "rotate":
                yaw -= dx * 0.005
                limit = math.pi / 2 - 0.001
                pitch = min(limit, max(-limit, pitch + dy * 0.005))
            elif kind == "zoom":
                distance = max(0.001, distance * (1 + dy * 0.01))
            else:
                back = (_orbit(yaw, pitch, distance, focus) - focus) / distance
                right = np.cross([0, 0, 1], back) / np.linalg.norm(np.cross([0, 0, 1], back))
                metres = 2 * distance * math.tan(math.pi / 8) / 480  # per pixel, 45 degrees of view
                focus = focus + (-dx * right + dy * np.cross(back, right)) * metres
            steps.append([kind, dx, dy])
            states.append([_orbit(yaw, pitch, distance, focus).tolist(), focus.tolist()])
        found.append({"start": start, "steps": steps, "states": states})
    return found


def layouts(chance: random.Random) -> Any:
    """Return layouts of panels as texts, and the panels with their boxes in percent."""

    def part(depth: int, box: tuple[float, float, float, float]) -> tuple[str, list[Any]]:
        if depth == 3 or chance.random() < 0.4:
            tab = chance.choice(TABS)
            argument = chance.choice(["", "/imu/x", "a(b)~c*!", "ü/%"])
            escaped = "".join(f"!{ord(sign):x}" if sign in "!()~*" else sign for sign in argument)
            return tab + (f"/{escaped}" if escaped else ""), [[tab, argument, box]]
        x, y, width, height = box
        is_row = chance.random() < 0.5
        sizes = [chance.randint(10, 90) for _ in range(chance.randint(2, 2 if depth else 3))]
        texts, panels, start = [], [], 0.0
        for size in sizes:
            share = size / sum(sizes)
            inner = (
                (x + start * width, y, width * share, height)
                if is_row
                else (x, y + start * height, width, height * share)
            )
            text, found = part(depth + 1, inner)
            texts.append(f"{text}*{size}")
            panels += found
            start += share
        return f"{'row' if is_row else 'column'}({'~'.join(texts)})", panels

    drawn = [part(0, (0.0, 0.0, 100.0, 100.0)) for _ in range(300)]
    return [[text, panels] for text, panels in drawn if len(panels) <= 16]


def _at(values: Any) -> list[float | None]:
    return [None if math.isnan(value) else float(value) for value in values]


def plots(chance: random.Random) -> Any:
    """Return samples of two curves, with derivatives by numpy, and one curve over the other."""
    found = []
    for number in range(50):
        first, second = (
            sorted({round(chance.uniform(0, 100), 3) for _ in range(chance.randint(3, 60))}) for _ in range(2)
        )
        values, others = ([chance.gauss(0, 5) for _ in times] for times in (first, second))
        if number % 2:
            values[len(values) // 2] = math.nan
        # numpy makes a value NaN beside a gap, and outside of the samples
        crossed = np.interp(second, first, values, left=math.inf, right=math.inf)
        pairs = [
            None if math.isnan(x) else [float(x), y, time_s]
            for x, y, time_s in zip(crossed, others, second, strict=True)
            if not math.isinf(x)
        ]
        found.append(
            {"samples": list(zip(first, _at(values), strict=True)),
                "others": list(zip(second, others, strict=True)),
                "rates": _at(np.diff(values) / np.diff(first)), "pairs": pairs},
        )  # fmt: skip
    return found


VECTORS: Mapping[str, Callable[[random.Random], Any]] = {
    "frames": frames, "messages": messages, "cameras": cameras, "views": views, "layouts": layouts,
    "plots": plots, "angles": angles, "stale": stale,
}  # fmt: skip


def vectors() -> dict[str, Any]:
    """Return all vectors; the same each time."""
    return {name: make(random.Random(27)) for name, make in VECTORS.items()}  # noqa: S311 # no secret
