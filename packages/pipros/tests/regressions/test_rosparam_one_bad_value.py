"""rosparam: a file with one number beyond 32 bits, or an empty value, was loaded up to this line."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipros.master.master import Master
from tests.support.ros import RosSystem


@pytest.mark.parametrize(
    ("bad", "reason"),
    [
        ("99999999999", "int exceeds XML-RPC limits"),
        ("[1, [2, null]]", "cannot marshal None"),
    ],
)
def test_a_file_with_a_value_that_cannot_be_sent_changes_nothing(
    bad: str, reason: str, ros: RosSystem, tmp_path: Path, master: Master
) -> None:
    file = tmp_path / "params.yaml"
    file.write_text(f"first: 1\nwheels: {{left: 2}}\nbad: {bad}\nlast: 3\n")
    loaded = ros.pipros.run("rosparam", "load", str(file), "/robot", ROS_MASTER_URI=master.uri)
    assert loaded.returncode == 1
    assert "cannot set parameter [/robot/bad] to" in loaded.output
    assert reason in loaded.output
    assert ros.pipros.run("rosparam", "list", ROS_MASTER_URI=master.uri).output.strip() == ""
