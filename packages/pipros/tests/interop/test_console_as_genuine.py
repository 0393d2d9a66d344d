"""The terminal output of nodes and launchers equals that of genuine ROS: format, colours, titles."""

from __future__ import annotations

import re

import pytest

from tests.support.ros import RosSystem, Side

LOGS = """
import rospy
rospy.init_node("logger", log_level=rospy.DEBUG)
rospy.logdebug("a debug line")
rospy.loginfo("25 %% of %s", "100")
rospy.logwarn("a warning")
rospy.logerr("an error")
rospy.logfatal("the end")
rospy.loginfo("two\\nlines, é")
rospy.logwarn_once("once")
"""
WARNS = """
import rospy
from composiv_tryouts.msg import BatteryLevel
rospy.init_node("talker")
rospy.Publisher("battery_topic", BatteryLevel)
"""


def shown(side: Side, script: str, **variables: str) -> str:
    """Return the output of a script on a terminal, with placeholders for times and its path."""
    terminal = side.open_terminal()
    file = side.home / "script.py"
    file.write_text(script)
    for name, value in variables.items():
        terminal.run(f"export {name}='{value}'")
    code, output = terminal.run("python3 script.py")
    assert code == 0, output
    return re.sub(r"\d{10}\.\d{6}", "TIME", output)


@pytest.fixture(autouse=True)
def master(ros: RosSystem) -> None:
    ros.genuine.start_master()


@pytest.mark.parametrize(
    "variables",
    [
        {},
        {"ROSCONSOLE_FORMAT": "[${severity}] ${node} ${logger} ${function}: ${message}"},
        {"ROSCONSOLE_FORMAT": "${message} ${line} ${file}"},
    ],
    ids=lambda variables: variables.get("ROSCONSOLE_FORMAT", "the usual format"),
)
def test_log_lines_look_the_same(ros: RosSystem, variables: dict[str, str]) -> None:
    theirs = shown(ros.genuine, LOGS, **variables)
    ours = shown(ros.pipros, LOGS, **variables)

    assert _without_internals(ours) == _without_internals(theirs)
    assert "\x1b[33m" in ours
    assert "\x1b[31m" in ours


def test_the_warning_about_a_missing_queue_size_looks_the_same(ros: RosSystem) -> None:
    theirs = shown(ros.genuine, WARNS)
    ours = shown(ros.pipros, WARNS)

    assert ours == theirs
    assert "script.py:5: SyntaxWarning" in ours


def _without_internals(text: str) -> str:
    """Return the lines of the script: at DEBUG, each side also logs its own work."""
    said = ("a debug line", "25 % of 100", "a warning", "an error", "the end", "two", "lines, é", "once")
    return "".join(line for line in text.splitlines(keepends=True) if any(part in line for part in said))
