"""Every command and example of docs/guides/data.md runs, and prints what the document shows."""

import math
import re
import shlex
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CompressedImage, Imu, JointState
from std_msgs.msg import Float64MultiArray, String
from tf2_msgs.msg import TFMessage

from pipros.msg.time import Time
from pipros_data.commands.dataset import main as dataset
from pipros_tools.cli.rosbag import main as rosbag
from tests.support import documents
from tests.support.bags import Row, bag_bytes

TEXT = documents.text_of("guides/data.md")
EXAMPLES = re.findall(r"^```python\n(.*?)^```\n\n```text\n(.*?)^```", TEXT, re.MULTILINE | re.DOTALL)
WITHOUT_ROBOT = [each for each in EXAMPLES if "LiveRobot" not in each[0]]
"""`tests.graph.test_live_robot` runs the others."""
COMMANDS = re.findall(
    r"^\$ (.*)\n((?:(?!\$ |```).*\n)*)",
    "".join(re.findall(r"```console\n(.*?)```", TEXT, re.DOTALL)),
    re.MULTILINE,
)
DESCRIPTION, _ = re.findall(r"```yaml\n(.*?)```", TEXT, re.DOTALL)
PROGRAMS = {"rosbag": rosbag, "pipros dataset": dataset}


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
    Path("demo.bag").write_bytes(bag_bytes(demonstration()))
    Path("robot.yaml").write_text(DESCRIPTION)


def demonstration() -> list[Row]:
    """Return the messages of an arm that moves for 5 s, of which an episode lasts 4 s."""
    rows: list[Row] = [
        ("/episode", String("grasp"), 10, 500_000_000),
        ("/episode", String(""), 14, 520_000_000),
    ]
    for n in range(150):
        time = divmod(10 * 10**9 + n * 10**9 // 30, 10**9)
        angle = math.sin(n / 20)
        state = JointState(name=["shoulder", "elbow"], position=[angle, angle / 2])
        _, jpeg = cv2.imencode(".jpg", np.full((16, 16, 3), n, np.uint8))
        picture = CompressedImage(format="jpeg", data=jpeg.tobytes())
        state.header.stamp = picture.header.stamp = Time(*time)
        command = Float64MultiArray(data=[angle, angle / 2])
        rows += [("/joint_states", state, *time), ("/camera/compressed", picture, *time)]
        rows.append(("/arm/command", command, *time))
    return sorted(rows, key=lambda row: row[2:])


def test_all_examples_and_commands_are_found() -> None:
    assert len(EXAMPLES) == TEXT.count("```python") == 5
    assert len(COMMANDS) == len(re.findall(r"^\$ ", TEXT, re.MULTILINE)) == 8


@pytest.mark.parametrize(("code", "printed"), WITHOUT_ROBOT)
def test_the_example_prints_the_output_below_it(code: str, printed: str, capsys) -> None:
    exec(code, {})  # noqa: S102 # our own document
    assert capsys.readouterr().out == printed


@pytest.mark.parametrize(("command", "printed"), COMMANDS)
def test_the_command_prints_the_output_below_it(command: str, printed: str, capfd: Any) -> None:
    found = next(name for name in PROGRAMS if command.startswith(f"{name} "))
    line, _, target = command.removeprefix(found).partition(" > ")
    arguments = shlex.split(line)
    assert PROGRAMS[found](arguments) == 0
    output, errors = capfd.readouterr()
    assert errors == ""
    if target:
        Path(target).write_text(output)
        assert PROGRAMS[found](["demo.bag", "--config", target, "-o", "suggested", "-j1"]) == 0
    else:
        assert output == printed
    if "-o" in arguments:
        assert Path(arguments[arguments.index("-o") + 1]).stat().st_size > 0
