"""roslaunch on a terminal: each line shows its node."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.programs import make_programs
from tests.support.ros import RosSystem

PROGRAM = """\
#!/bin/sh
[ -t 1 ] && echo "$1 has a terminal"
echo "$1 complains" >&2
printf '%s' "$1 asks: "
exec sleep 1000
"""


@pytest.fixture
def file(ros: RosSystem) -> Path:
    folder = make_programs(ros.home / "programs", {"talk": PROGRAM})
    nodes = "".join(
        f'<node pkg="programs" type="talk" name="{name}" args="{name}" output="screen"/>' for name in "ab"
    )
    (folder / "x.launch").write_text(f"<launch>{nodes}</launch>")
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(folder)
    return folder / "x.launch"


def test_each_line_starts_with_the_name_of_its_node_in_its_own_colour(ros: RosSystem, file: Path) -> None:
    terminal = ros.pipros.open_terminal()
    terminal.type(f"roslaunch {file}")
    terminal.wait_for(r"\033\[35m\[a-2\]\033\[0m a has a terminal")
    terminal.wait_for(r"\033\[33m\[b-3\]\033\[0m b complains")
    terminal.wait_for(r"\033\[35m\[a-2\]\033\[0m a asks: ")
    terminal.press_ctrl_c()
    assert terminal.wait_for_prompt() == 0


def test_nodes_can_write_to_the_terminal_themselves(ros: RosSystem, file: Path) -> None:
    terminal = ros.pipros.open_terminal()
    terminal.type(f"roslaunch --raw-output {file}")
    terminal.wait_for("b complains")
    assert "[b-3]\033[0m" not in terminal.output
    terminal.press_ctrl_c()
    assert terminal.wait_for_prompt() == 0


def test_without_a_terminal_the_output_has_no_prefix(ros: RosSystem, file: Path) -> None:
    running = ros.pipros.start("roslaunch", file)
    running.wait_for("^b complains$")
    assert "b complains" in running.stderr
