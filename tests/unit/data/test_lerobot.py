"""Data sets through the library of LeRobot; `script/long lerobot` uses the real one."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar

import numpy as np
import pytest

from pipros.data.commands.dataset import main as dataset
from tests.unit.data.demonstrations import CONFIG, demonstration, failure, made


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("robot.yaml").write_text(CONFIG)
    demonstration(Path("run.bag"), 100.0)


@pytest.mark.parametrize("change", [("rate: 10", "rate: 2.5"), ("rate: 10", "rate: 10\ngaps: keep")])
def test_the_limits_of_lerobot_are_checked_first(
    change: tuple[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    reason = "needs a whole number as rate, and gaps: skip or hold"
    assert reason in failure(capsys, CONFIG.replace(*change), "--format", "lerobot")


class RecordedDataset:
    """Stands in for LeRobot's class, and checks what the library requires."""

    made: ClassVar[list[Any]] = []

    @classmethod
    def create(cls, repo_id: str, fps: int, features: dict[str, Any], root: Path) -> RecordedDataset:
        assert not root.exists()
        root.mkdir()
        found = cls()
        found.settings = (repo_id, fps, features)
        found.frames, found.episodes, found.is_complete = [], [], False
        cls.made.append(found)
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
        self.is_complete = True


def test_lerobot_gets_all_frames_of_all_episodes(monkeypatch: pytest.MonkeyPatch) -> None:
    module: Any = ModuleType("lerobot.datasets.lerobot_dataset")
    module.LeRobotDataset = RecordedDataset
    for name in ("lerobot", "lerobot.datasets"):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setattr(RecordedDataset, "made", [])
    demonstration(Path("other.bag"), 200.0, seconds=1.0)
    command = ["run.bag", "other.bag", "--config", "robot.yaml", "-o", "out", "--format", "lerobot"]
    assert dataset(command) == 0
    assert dataset(command) == 0  # complete, so nothing is written

    (found,) = RecordedDataset.made
    assert found.is_complete
    assert found.settings[:2] == ("local/data", 10)
    assert {key: feature["names"] for key, feature in found.settings[2].items()} == {
        "observation.state": ["joints.b", "joints.a"],
        "action": ["base.linear.x", "base.angular.z"],
        "observation.images.front": ["height", "width", "channels"],
    }
    assert [len(frames) for frames in found.episodes] == [21, 11]
    frame = found.episodes[0][7]
    assert frame["observation.state"].tolist() == [-1007, 1007]
    assert frame["action"].tolist() == [5, -5]
    assert frame["task"] == "lift the cup"
    assert abs(float(frame["observation.images.front"].mean()) - 70) < 2


def test_an_unfinished_lerobot_data_set_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    made()
    settings = json.loads(Path("out/dataset.json").read_text())
    Path("out/dataset.json").write_text(json.dumps({**settings, "format": "lerobot"}))
    Path("out/checks/episode_000000.json").unlink()
    Path("out/lerobot").mkdir()
    assert dataset(["run.bag", "--config", "robot.yaml", "-o", "out", "--format", "lerobot"]) == 1
    assert "out/lerobot is unfinished, and LeRobot cannot continue it" in capsys.readouterr().err
