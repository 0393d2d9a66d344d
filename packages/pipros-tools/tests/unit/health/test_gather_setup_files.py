"""Start files of shells that source setup files of ROS that do not exist."""

from __future__ import annotations

from pathlib import Path

from pipros_tools.health.gather_machine import gather_machine


def test_a_missing_setup_file_in_bashrc_is_found(tmp_path: Path) -> None:
    (tmp_path / ".bashrc").write_text("alias ll='ls -l'\nsource /opt/ros/none-such/setup.bash\n")
    (tmp_path / ".zshrc").write_text("# source /opt/ros/none-such/setup.zsh\n")
    variables = {"HOME": str(tmp_path), "PATH": "/usr/bin", "ROS_MASTER_URI": "http://127.0.0.1:1"}
    assert gather_machine(variables).missing_setup_files == {"~/.bashrc": "/opt/ros/none-such/setup.bash"}
