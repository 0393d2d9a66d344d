"""Data sets in LeRobot's format, read again with its library, used for training, and replayed on a robot.

    python -m tests.support.lerobot_dataset

Needs LeRobot with torch, and the plug-ins. Fails if a number, a picture or a task differs from those in the
bags, if training fails, if a replayed drive leads elsewhere, or if a robot without policy drives on. Also
opens the other formats with h5py, duckdb and pandas.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from importlib import import_module
from pathlib import Path
from typing import Any

os.environ["HF_HUB_OFFLINE"] = "1"

import av
import duckdb
import h5py
import numpy as np
import pandas
from sensor_msgs.msg import Image, JointState

from pipros.msg.time import Time
from pipros_data.commands.dataset import main as dataset
from tests.support.bags import Row, bag_bytes
from tests.support.lerobot_trials import drive_and_replay, stop_when_killed, train
from tests.support.waiting import wait_until

CONFIG = """\
rate: 10
task: wave
observations: {arm: {topic: /joints, names: [a, b]}}
actions: {arm: {topic: /joints, names: [b, a]}}
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
        continue_when_killed(folder, command)
        other_formats(folder, command)
        stop_when_killed(folder)
        drive_and_replay(folder)
        train(folder / "out" / "lerobot", folder)


def continue_when_killed(folder: Path, command: list[str]) -> None:
    """Kill the command after its first episode; run again, it makes the same data set."""
    output = folder / "killed"
    argv = [*command[:-1], str(output), "--format", "lerobot", "-j1", "-q"]
    program = "import sys; from pipros_data.commands.dataset import main; main(sys.argv[1:])"
    process = subprocess.Popen([sys.executable, "-c", program, *argv])
    wait_until(lambda: list(output.glob("checks/*.json")), timeout_s=120)
    process.kill()
    process.wait()
    assert not (output / "lerobot").exists(), "it was killed too late"
    assert dataset(argv) == 0
    check(output / "lerobot")
    print("a run that was killed after its first episode continued")


def other_formats(folder: Path, command: list[str]) -> None:
    """Open Parquet and HDF5 with duckdb, pandas and h5py."""
    for kind in ("parquet", "hdf5"):
        assert dataset([*command[:-1], str(folder / kind), "--format", kind, "-q"]) == 0
    file = folder / "parquet" / "data" / "episode_000001.parquet"
    frame = pandas.read_parquet(file)
    assert frame["observations.arm"].map(list).tolist() == [[1000 + n, -n] for n in range(20)]
    opened = duckdb.read_parquet(str(file))
    found = opened.aggregate('count(*), max("observations.arm"[1]), any_value(task)').fetchall()
    assert found == [(20, 1019.0, "wave")]
    with h5py.File(folder / "hdf5" / "data" / "episode_000001.hdf5") as hdf5:
        assert hdf5["observations/arm"][:].tolist() == [[1000 + n, -n] for n in range(20)]
    versions = ", ".join(f"{each.__name__} {each.__version__}" for each in (pandas, duckdb, h5py))
    print(f"Parquet and HDF5 have the same numbers in {versions}")


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
        assert each["action"].tolist() == [-n, 1000 * episode + n]
        assert each["task"] == "wave"
        assert tuple(each["observation.images.front"].shape) == (3, 64, 96)
        assert abs(float(each["observation.images.front"].mean()) * 255 - 10 * n) < 4
    batches = list(import_module("torch.utils.data").DataLoader(found, batch_size=8, shuffle=True))
    assert sum(len(batch["action"]) for batch in batches) == 40
    lerobot, torch = (import_module(name).__version__ for name in ("lerobot", "torch"))
    print(f"Python {sys.version.split()[0]}, LeRobot {lerobot}, torch {torch}, numpy {np.__version__}")
    print(f"LeRobot reads {found.num_frames} frames in {found.num_episodes} episodes; av {av.__version__}")


if __name__ == "__main__":
    main()
