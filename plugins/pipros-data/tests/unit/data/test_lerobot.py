"""Data sets through the library of LeRobot; `script/long lerobot` uses the real one."""

from __future__ import annotations

import pickle
import shutil
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import cv2
import numpy as np
import pytest

from pipros_data.commands.dataset import main as dataset
from tests.unit.data import demonstrations
from tests.unit.data.demonstrations import CONFIG, demonstration, failure


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("robot.yaml").write_text(CONFIG)
    demonstration(Path("run.bag"), 100.0)


@pytest.mark.parametrize("change", [("rate: 10", "rate: 2.5"), ("rate: 10", "rate: 10\ngaps: keep")])
def test_the_limits_of_lerobot_are_checked_first(change: tuple[str, str], capsys) -> None:
    reason = "needs a whole number as the rate, and gaps: skip or hold"
    assert reason in failure(capsys, CONFIG.replace(*change), "--format", "lerobot")


class RecordedDataset:
    """Stands in for LeRobot's class, and checks what the library requires. `finalize` writes a file."""

    @classmethod
    def create(cls, repo_id: str, fps: int, features: dict[str, Any], root: Path) -> RecordedDataset:
        assert not root.exists()
        root.mkdir(parents=True)
        found = cls()
        found.root, found.settings = root, (repo_id, fps, features)
        found.frames, found.episodes = [], []
        return found

    def add_frame(self, frame: dict[str, Any]) -> None:
        assert set(frame) == {*self.settings[2], "task"}
        for key, feature in self.settings[2].items():
            assert frame[key].shape == feature["shape"]
            assert frame[key].dtype == (np.uint8 if feature["dtype"] == "video" else np.float32)
        self.frames.append(frame)

    def save_episode(self) -> None:
        self.episodes.append(self.frames)
        self.frames = []

    def finalize(self) -> None:
        assert not self.frames
        (self.root / "data").write_bytes(pickle.dumps((self.settings, self.episodes)))


def aggregate_datasets(repo_ids: list[str], aggr_repo_id: str, roots: list[Path], aggr_root: Path) -> None:
    """Join data sets like the function of LeRobot."""
    assert repo_ids == [aggr_repo_id] * len(roots)
    aggr_root.mkdir()
    parts = [pickle.loads((root / "data").read_bytes()) for root in roots]  # noqa: S301 # our own
    if any(settings != parts[0][0] for settings, _ in parts):
        raise ValueError("features differ")
    found = parts[0][0], [episode for _, episodes in parts for episode in episodes]
    (aggr_root / "data").write_bytes(pickle.dumps(found))


def joined() -> Any:
    return pickle.loads(Path("out/lerobot/data").read_bytes())  # noqa: S301 # our own


@pytest.fixture
def library(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (
        "lerobot", "lerobot.datasets", "lerobot.datasets.lerobot_dataset", "lerobot.datasets.aggregate",
    ):  # fmt: skip
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    modules: Any = sys.modules
    modules["lerobot.datasets.lerobot_dataset"].LeRobotDataset = RecordedDataset
    modules["lerobot.datasets.aggregate"].aggregate_datasets = aggregate_datasets
    demonstration(Path("other.bag"), 200.0, seconds=1.0)


COMMAND = ["run.bag", "other.bag", "--config", "robot.yaml", "-o", "out", "--format", "lerobot", "-j1"]


@pytest.mark.usefixtures("library")
def test_lerobot_gets_all_frames_of_all_episodes() -> None:
    assert dataset(COMMAND) == 0
    before = Path("out/lerobot/data").stat().st_mtime_ns
    assert dataset(COMMAND) == 0  # complete, so nothing is written
    assert Path("out/lerobot/data").stat().st_mtime_ns == before
    assert not Path("out/parts").exists()

    (repo_id, fps, features), episodes = joined()
    assert (repo_id, fps) == ("local/data", 10)
    assert {key: feature["names"] for key, feature in features.items()} == {
        "observation.state": ["joints.b", "joints.a"],
        "action": ["base.linear.x", "base.angular.z"],
        "observation.images.front": ["height", "width", "channels"],
    }
    assert [len(frames) for frames in episodes] == [21, 11]
    frame = episodes[0][7]
    assert (frame["observation.state"].tolist(), frame["action"].tolist()) == ([-1007, 1007], [5, -5])
    assert frame["task"] == "lift the cup"
    assert abs(float(frame["observation.images.front"].mean()) - 70) < 2


@pytest.mark.usefixtures("library")
@pytest.mark.parametrize("moment", ["save_episode", "finalize", "join"])
def test_a_run_continues_after_an_interruption(moment: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert dataset(COMMAND) == 0
    complete = Path("out/lerobot/data").read_bytes()
    shutil.rmtree("out")
    count = 0

    def interrupted(*_: Any, **options: Any) -> None:
        nonlocal count
        count += 1
        if moment == "join":
            options["aggr_root"].mkdir()
        elif count == 1:
            return getattr(RecordedDataset, f"real_{moment}")(*_)
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        if moment == "join":
            patched.setattr(sys.modules["lerobot.datasets.aggregate"], "aggregate_datasets", interrupted)
        else:
            patched.setattr(
                RecordedDataset, f"real_{moment}", getattr(RecordedDataset, moment), raising=False
            )
            patched.setattr(RecordedDataset, moment, interrupted)
        assert dataset(COMMAND) == 130
    assert not Path("out/lerobot").exists()
    assert len(list(Path("out/checks").glob("*.json"))) == (2 if moment == "join" else 1)
    assert (dataset(COMMAND), Path("out/lerobot/data").read_bytes()) == (0, complete)


@pytest.mark.usefixtures("library")
def test_pictures_of_different_sizes_are_an_error(monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    monkeypatch.setattr(
        demonstrations, "jpeg", lambda level: cv2.imencode(".jpg", np.full((16, 16, 3), level))[1].tobytes()
    )
    demonstration(Path("other.bag"), 200.0, seconds=1.0)
    assert dataset(COMMAND) == 1
    assert "LeRobot cannot join the episodes: features differ" in capsys.readouterr().err
