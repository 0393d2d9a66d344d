"""The node of docs/libraries.md: its test passes, and it runs as a program."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.environments import REPOSITORY
from tests.support.ros import RosSystem
from tests.tutorial.test_docs import BLOCK

FILES = {
    title: content
    for _, title, content in BLOCK.findall((REPOSITORY / "docs" / "libraries.md").read_text(encoding="utf-8"))
    if title.endswith("nearest.py")
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, content in FILES.items():
        (tmp_path / name).write_text(content, encoding="utf-8")
    return tmp_path


def test_the_example_is_short_and_its_test_passes(folder: Path) -> None:
    assert sum(bool(line) for content in FILES.values() for line in content.splitlines()) <= 30
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_nearest.py"]
    ended = subprocess.run(command, cwd=folder, capture_output=True, text=True)

    assert "1 passed" in ended.stdout, ended.stdout + ended.stderr


def test_the_example_is_a_program(folder: Path, ros: RosSystem) -> None:
    ros.serve_master()
    node = ros.pipros.start("python3", folder / "nearest.py", "_limit:=1")
    ros.wait_for_subscriber("/scan")
    scan = "{range_min: 0.5, ranges: [2.0, 0.1, 0.75], header: {frame_id: laser}}"
    ros.pipros.start("rostopic", "pub", "-r", "10", "scan", "sensor_msgs/LaserScan", scan)
    echo = ros.pipros.run("rostopic", "echo", "-n", "1", "nearest")

    assert "range: 0.75" in echo.output
    node.press_ctrl_c()
    assert node.wait() == 0
