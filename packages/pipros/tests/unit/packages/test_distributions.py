"""Versions of the Python packages of ROS in `importlib.metadata`."""

from __future__ import annotations

import importlib.metadata
import sys
from pathlib import Path

import pytest

import pipros.startup  # noqa: F401 # what pipros.pth imports
from pipros.packages.distributions import shipped_distribution


@pytest.mark.parametrize(
    ("name", "version"),
    [("rospy", "1.15.15"), ("roslib", "1.15.8"), ("genpy", "0.6.16"), ("sensor-msgs", "1.13.1")],
)
def test_versions_are_those_of_the_manifests(name: str, version: str) -> None:
    assert importlib.metadata.version(name) == version
    assert importlib.metadata.metadata(name)["Name"] == name.replace("-", "_")
    assert importlib.metadata.requires(name) is None


@pytest.mark.parametrize("name", ["no_such_package", "std_msgs", "..", "", "rospy/msg"])
def test_names_without_python_modules_have_no_distribution(name: str) -> None:
    assert shipped_distribution(name) is None


def test_lists_of_what_is_installed_leave_them_out(tmp_path: Path) -> None:
    assert "rospy" not in {found.name for found in importlib.metadata.distributions()}
    assert list(importlib.metadata.distributions(name="rospy", path=[str(tmp_path)])) == []


def test_an_installed_distribution_wins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "rospy-9.9.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: rospy\nVersion: 9.9\n")
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    assert importlib.metadata.version("rospy") == "9.9"
