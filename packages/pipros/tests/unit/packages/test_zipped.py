"""The shipped packages, if pipros is imported from a zip file."""

from __future__ import annotations

import os
import shutil
import sys
import zipfile
from pathlib import Path

import pytest

from pipros.packages import SHARE, folder_of_modules, has_only_messages
from pipros.packages.zipped import unpacked


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    file = tmp_path / "pipros.zip"
    with zipfile.ZipFile(file, "w") as content:
        content.writestr("pipros/share/robot/msg/Arm.msg", "int8 fingers\n")
        program = zipfile.ZipInfo("pipros/share/robot/nodes/talker")
        program.external_attr = 0o755 << 16
        content.writestr(program, "#!/usr/bin/env python3\n")
        content.writestr("pipros/other.py", "")
    return file


def test_each_state_of_a_zip_file_is_unpacked_once(archive: Path, tmp_path: Path) -> None:
    cache = str(tmp_path / "cache")
    share = Path(unpacked(f"{archive}/pipros/share", cache))
    assert (share / "robot/msg/Arm.msg").read_text() == "int8 fingers\n"
    assert os.access(share / "robot/nodes/talker", os.X_OK)
    assert not (share.parent / "other.py").exists()
    (share / "robot/msg/Arm.msg").write_text("kept")
    assert unpacked(f"{archive}/pipros/share", cache) == str(share)
    assert (share / "robot/msg/Arm.msg").read_text() == "kept"

    with zipfile.ZipFile(archive, "a") as content:
        content.writestr("pipros/share/robot/msg/Hand.msg", "")
    assert Path(unpacked(f"{archive}/pipros/share", cache), "robot/msg/Hand.msg").is_file()
    assert len(os.listdir(cache)) == 2


def test_another_process_may_be_first(archive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rename = os.rename

    def rename_too_late(old: str, new: str) -> None:
        shutil.copytree(old, new)
        (Path(new) / "first").touch()
        rename(old, new)

    monkeypatch.setattr(os, "rename", rename_too_late)
    share = Path(unpacked(f"{archive}/pipros/share", str(tmp_path / "cache")))
    assert (share.parents[1] / "first").is_file()
    assert len(os.listdir(tmp_path / "cache")) == 1


def test_a_cache_that_cannot_be_written_is_named(archive: Path, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match="file"):
        unpacked(f"{archive}/pipros/share", str(tmp_path / "file" / "cache"))


def test_modules_of_shipped_packages_are_on_the_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = folder_of_modules("sensor_msgs", os.path.join(SHARE, "sensor_msgs"))
    assert found is not None
    assert os.path.isfile(os.path.join(found, "point_cloud2.py"))
    assert not has_only_messages(found)
    monkeypatch.setattr(sys, "path", [str(tmp_path)])
    assert folder_of_modules("sensor_msgs", os.path.join(SHARE, "sensor_msgs")) is None
    own = tmp_path / "ws" / "robot" / "src" / "robot"
    own.mkdir(parents=True)
    (own / "__init__.py").touch()
    assert folder_of_modules("robot", str(tmp_path / "ws" / "robot")) == str(own)
