"""A bag with a demonstration, and the description of a data set for it."""

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pyarrow.parquet
import pytest
from geometry_msgs.msg import Twist
from sensor_msgs.msg import CompressedImage, JointState
from std_msgs.msg import String

from pipros.msg.time import Time
from pipros_data.commands.dataset import main as dataset
from tests.support.bags import Row, bag_bytes

CONFIG = """\
rate: 10
tolerance: 0.15
episodes: {topic: /episode}
observations:
  joints: {topic: /joints, names: [b, a], unit: deg, scale: 10, min: -1000, max: [1000, 1000]}
cameras:
  front: {topic: /camera/compressed}
actions:
  base: {topic: /cmd_vel, fields: [linear.x, angular.z], time: receipt, tolerance: 1}
"""


def ns(time: float) -> tuple[int, int]:
    return divmod(round(time * 1e9), 10**9)


def jpeg(level: int) -> bytes:
    return cv2.imencode(".jpg", np.full((32, 48, 3), level, np.uint8))[1].tobytes()


def joints(time: float, *, value: float | None = None, names: tuple[str, ...] = ("a", "b")) -> Row:
    state = JointState(name=list(names), position=[time if value is None else value, -time][: len(names)])
    state.header.stamp = Time(*ns(time))
    return "/joints", state, *ns(time + 0.01)


def picture(time: float, data: bytes) -> Row:
    image = CompressedImage(format="jpeg", data=data)
    image.header.stamp = Time(*ns(time))
    return "/camera/compressed", image, *ns(time + 0.02)


def demonstration(path: Path, start: float, *, seconds: float = 2.0) -> Path:
    """Write a bag with an episode: joints and pictures at 10 Hz, a command each 0.5 s."""
    rows: list[Row] = [("/episode", String("lift the cup"), *ns(start + 0.05))]
    for n in range(round(seconds * 10) + 5):
        time = start + n / 10
        rows += [
            joints(time), joints(time, value=7.0, names=("gripper",)), picture(time, jpeg(10 * (n % 25)))
        ]  # fmt: skip
        if n % 5 == 0:
            command = Twist()
            command.linear.x, command.angular.z = n, -n
            rows.append(("/cmd_vel", command, *ns(time)))
    rows.append(("/episode", String(""), *ns(start + 0.05 + seconds)))
    path.write_bytes(bag_bytes(sorted(rows, key=lambda row: row[2:])))
    return path


def made(*arguments: str, config: str | None = None) -> Any:
    """Run the command, which must succeed, and return the first episode as a table."""
    if config is not None:
        Path("robot.yaml").write_text(config)
    assert dataset(["run.bag", "--config", "robot.yaml", "-o", "out", "-j1", *arguments]) == 0
    files = sorted(Path("out/data").glob("*.parquet"))
    return pyarrow.parquet.read_table(files[0]) if files else None


def failure(capsys: pytest.CaptureFixture[str], config: str, *arguments: str) -> str:
    """Return the one-line error of a run that must fail."""
    Path("bad.yaml").write_text(config)
    assert dataset(["run.bag", *arguments, "--config", "bad.yaml", "-o", "bad", "-j1"]) == 1
    text = capsys.readouterr().err
    assert text.startswith("pipros dataset: ")
    assert text.count("\n") == 1
    return text
