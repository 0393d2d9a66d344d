"""Time to make a data set of two cameras; part of `benchmarks/data.py`.

Two bags, each with two cameras of 640 x 480 at 30 Hz, JPEG of some 40 kB, and joints at 100 Hz.
"""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np
from sensor_msgs.msg import CompressedImage, JointState
from soak_resources import Processors

import rosbag
from pipros.data.commands.dataset import main as dataset
from pipros.msg.time import Time

SECONDS = 40
DESCRIPTION = """\
rate: 30
gaps: hold
observations: {arm: {topic: /joints}}
actions: {arm: {topic: /joints}}
cameras: {left: {topic: /left}, right: {topic: /right}}
"""


def pictures() -> list[bytes]:
    """Return 60 JPEG pictures of some 40 kB: a pattern that moves, with noise."""
    random = np.random.default_rng(0)
    y, x = np.mgrid[0:480, 0:640]
    noise = random.normal(0, 9, (480, 640))
    found = []
    for n in range(60):
        waves = [
            128 + 100 * np.sin((x + k * y + 6 * n) / (30 + 9 * k)) + np.roll(noise, n, 1) for k in range(3)
        ]
        pixels = np.clip(np.stack(waves, 2), 0, 255).astype(np.uint8)
        found.append(cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, 62])[1].tobytes())
    return found


def write_bag(path: Path, cells: list[bytes]) -> None:
    with rosbag.Bag(str(path), "w") as bag:
        for n in range(SECONDS * 300):
            stamp = Time(1000 + n // 300, n % 300 * 3_333_333)
            if n % 10 == 0:
                for m, side in enumerate(("/left", "/right")):
                    image = CompressedImage(format="jpeg", data=cells[(n // 10 + 30 * m) % len(cells)])
                    image.header.stamp = stamp
                    bag.write(side, image, stamp)
            if n % 3 == 0:
                state = JointState(name=list("abcdef"), position=[n / 1000] * 6)
                state.header.stamp = stamp
                bag.write("/joints", state, stamp)


def main(folder: str | None) -> None:
    """Write the bags, make a data set with one process for each processor, and print the time for a GB."""
    with tempfile.TemporaryDirectory(dir=folder) as name:
        cells = pictures()
        paths = [Path(name) / f"run{number}.bag" for number in range(2)]
        for path in paths:
            write_bag(path, cells)
        size = sum(path.stat().st_size for path in paths) / 1e9
        (Path(name) / "robot.yaml").write_text(DESCRIPTION)
        output = str(Path(name) / "out")
        processors = Processors()
        began = time.monotonic()
        command = [*map(str, paths), "--config", str(Path(name) / "robot.yaml"), "-o", output, "-q"]
        assert dataset(command) == 0
        seconds = time.monotonic() - began
        own, foreign = processors.percent()
        kilobytes = sum(map(len, cells)) / len(cells) / 1000
        busy = own * (os.cpu_count() or 1) * seconds / 100
        print(
            f"data set of two cameras, pictures of {kilobytes:.0f} kB: {size:.3f} GB in {seconds:.0f} s, "
            f"{seconds / size:.0f} s a GB (goal: 300 on two processors); processor time {busy / size:.0f}; "
            f"processors: {own:.0f} % used by this run, {foreign:.0f} % by others",
            flush=True,
        )
