"""Start files of shells that source setup files of ROS that do not exist."""

from __future__ import annotations

from pathlib import Path

from pipros_tools.health.gather_machine import gather_machine


def test_a_missing_setup_file_in_bashrc_is_found(tmp_path: Path) -> None:
    (tmp_path / "my ws" / "setup.bash").mkdir(parents=True)
    missing = f". /opt/ros/none/setup.sh\nsource ~/my ws/setup.bash # lab\nsource '{tmp_path}/a/setup.bash'\n"
    present = 'source "$HOME/my ws/setup.bash"\n# source /opt/ros/none/setup.zsh\n. $LAB/setup.zsh\n'
    (tmp_path / ".bashrc").write_text(missing + present)
    variables = {"HOME": str(tmp_path), "PATH": "/usr/bin", "ROS_MASTER_URI": "http://127.0.0.1:1"}
    expected = ["/opt/ros/none/setup.sh", f"{tmp_path}/my ws/setup.bash", f"{tmp_path}/a/setup.bash"]
    assert gather_machine(variables).missing_setup_files == dict.fromkeys(expected, "~/.bashrc")
