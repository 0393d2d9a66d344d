"""A data set of two episodes in LeRobot's format, written from bags and read again with LeRobot's library.

    python -m tests.support.lerobot_dataset

Needs LeRobot, with torch. Fails if a number, a picture or a task differs from those in the bags.
"""

from __future__ import annotations

import os
import tempfile
from importlib import import_module
from pathlib import Path
from typing import Any

os.environ["HF_HUB_OFFLINE"] = "1"

import av
import numpy as np
from sensor_msgs.msg import Image, JointState

from pipros.data.commands.dataset import main as dataset
from pipros.msg.time import Time
from tests.support.bags import Row, bag_bytes

CONFIG = """\
rate: 10
task: wave
observations: {arm: {topic: /joints, names: [a, b]}}
actions: {arm: {topic: /joints, names: [b]}}
cameras: {front: {topic: /image}}
"""


def write_bag(path: Path, first: int) -> None:
    rows: list[Row] = []
    for n in range(20):
        time = divmod((100 * 10 + n) * 10**8, 10**9)
        state = JointState(name=["a", "b"], position=[first + n, -n])
        pixels = np.full((64, 96, 3), 10 * n, np.uint8)
        image = Image(height=64, width=96, encoding="rgb8", step=288, data=pixels.tobytes())
        state.header.stamp = image.header.stamp = Time(*time)
        rows += [("/joints", state, *time), ("/image", image, *time)]
    path.write_bytes(bag_bytes(rows))


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "robot.yaml").write_text(CONFIG)
        for number in range(2):
            write_bag(folder / f"run{number}.bag", 1000 * number)
        command = [
            str(folder / "run*.bag"),
            "--config",
            str(folder / "robot.yaml"),
            "-o",
            str(folder / "out"),
        ]
        assert dataset([*command, "--format", "lerobot"]) == 0
        check(folder / "out" / "lerobot")
        assert dataset([*command, "--format", "lerobot"]) == 0, "a finished data set is not an error"


def check(root: Path) -> None:
    found: Any = import_module("lerobot.datasets.lerobot_dataset").LeRobotDataset(
        "local/data", root=root, video_backend="pyav"
    )
    assert (found.num_episodes, found.num_frames, found.fps) == (2, 40, 10)
    assert found.features["observation.state"]["names"] == ["arm.a", "arm.b"]
    for row in range(40):
        each = found[row]
        episode, n = divmod(row, 20)
        assert each["observation.state"].tolist() == [1000 * episode + n, -n]
        assert each["action"].reshape(-1).tolist() == [-n]
        assert each["task"] == "wave"
        assert tuple(each["observation.images.front"].shape) == (3, 64, 96)
        assert abs(float(each["observation.images.front"].mean()) * 255 - 10 * n) < 4
    batches = list(import_module("torch.utils.data").DataLoader(found, batch_size=8, shuffle=True))
    assert sum(len(batch["action"]) for batch in batches) == 40
    print(f"LeRobot reads {found.num_frames} frames in {found.num_episodes} episodes; av {av.__version__}")


if __name__ == "__main__":
    main()
