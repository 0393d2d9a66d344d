"""Every command and example of docs/data.md runs, and prints what the document shows."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu
from tf2_msgs.msg import TFMessage

from pipros.cli.rosbag import main as rosbag
from pipros.msg.time import Time
from tests.support.bags import Row, bag_bytes
from tests.support.environments import REPOSITORY

TEXT = (REPOSITORY / "docs" / "data.md").read_text()
EXAMPLES = re.findall(r"^```python\n(.*?)^```\n\n```text\n(.*?)^```", TEXT, re.MULTILINE | re.DOTALL)
COMMANDS = re.findall(
    r"^\$ (.*)\n((?:(?!\$ |```).*\n)*)",
    "".join(re.findall(r"```console\n(.*?)```", TEXT, re.DOTALL)),
    re.MULTILINE,
)


@pytest.fixture(autouse=True)
def drive(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Write the bag of the document: an IMU, odometry and transforms, from 0 to 100 s."""
    monkeypatch.chdir(tmp_path)
    rows: list[Row] = []
    for n in range(100):
        imu, odometry, transform = Imu(), Odometry(), TransformStamped(child_frame_id="base_link")
        imu.header.stamp = odometry.header.stamp = Time(n + 1, 0)
        imu.linear_acceleration.x = n
        odometry.pose.pose.position.x = n
        transform.header.frame_id, transform.header.stamp = "map", Time(n + 1, 500_000_000)
        transform.transform.translation.x = n
        transform.transform.rotation.w = 1.0
        rows += [("/imu", imu, n + 1, 0), ("/tf", TFMessage([transform]), n + 1, 600_000_000)]
        if n % 2 == 0:
            rows.append(("/odom", odometry, n + 1, 0))
    Path("run.bag").write_bytes(bag_bytes(rows))


def test_all_examples_and_commands_are_found() -> None:
    assert len(EXAMPLES) == TEXT.count("```python") == 3
    assert len(COMMANDS) == len(re.findall(r"^\$ ", TEXT, re.MULTILINE)) == 5


@pytest.mark.parametrize(("code", "printed"), EXAMPLES)
def test_the_example_prints_the_output_below_it(
    code: str, printed: str, capsys: pytest.CaptureFixture[str]
) -> None:
    exec(code, {})  # noqa: S102 # our own document
    assert capsys.readouterr().out == printed


@pytest.mark.parametrize(("command", "printed"), COMMANDS)
def test_the_command_prints_the_output_below_it(command: str, printed: str, capfd: Any) -> None:
    program, *arguments = shlex.split(command)
    assert program == "rosbag"
    assert rosbag(arguments) == 0
    assert capfd.readouterr() == (printed, "")
    if "-o" in arguments:
        assert Path(arguments[arguments.index("-o") + 1]).stat().st_size > 0
