"""Programs that only read launch files do not run their commands; xacro is bounded wherever it runs."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from pipros_tools.cli import roslaunch_complete, roslaunch_deps
from tests.support.ros import RosSystem


@pytest.mark.parametrize("main", [roslaunch_deps.main, roslaunch_complete.main], ids=["deps", "complete"])
def test_a_program_that_reads_a_launch_file_runs_no_command(
    main: object, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "x.launch"
    file.write_text(
        f"<launch><arg name='a' default='1'/><param name='p' command='touch {tmp_path}/ran'/>"
        "<node pkg='std_msgs' type='t' name='n'/></launch>"
    )
    assert callable(main)
    main([str(file)])
    assert not (tmp_path / "ran").exists()


NAMESPACE = "xmlns:xacro='http://www.ros.org/wiki/xacro'"


@pytest.mark.skipif(sys.platform == "win32", reason="needs fork")
@pytest.mark.parametrize(
    ("expression", "reason"),
    [("9**9**9", "xacro: not done in time, so it was ended"), ("'x' * 10**10", "when evaluating expression")],
    ids=["time", "memory"],
)
def test_an_endless_expression_of_a_robot_description_ends(
    ros: RosSystem, expression: str, reason: str
) -> None:
    file = ros.home / "x.xacro"
    file.write_text(
        f"<robot {NAMESPACE}><xacro:property name='a' value=\"${{{expression}}}\"/>"
        "<link name='${a}'/></robot>"
    )
    ran = ros.pipros.run("rosrun", "xacro", "xacro", file, PIPROS_LIMITS="launch_command_s=3")
    assert ran.returncode != 0
    assert reason in ran.output


def test_a_usual_robot_description_is_not_bounded(ros: RosSystem) -> None:
    file = ros.home / "x.xacro"
    file.write_text(f"<robot {NAMESPACE} name='r'><link name='${{3 ** 3}}'/></robot>")
    ran = ros.pipros.run("rosrun", "xacro", "xacro", file)
    assert ran.returncode == 0
    assert '<link name="27"/>' in ran.output
