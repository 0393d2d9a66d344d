"""`rosconsole` compared with that of genuine ROS, on nodes of both."""

from __future__ import annotations

import re
from collections.abc import Sequence

import pytest

from tests.support.processes import Process
from tests.support.ros import RosSystem

# Genuine `echo -1` ends after the first message, even if it prints nothing. So each topic has one message.
LOGGING_NODE = """
import rospy
from rosgraph_msgs.msg import Log
rospy.init_node('speaker')
for topic, level in (("calm", Log.INFO), ("alarm", Log.FATAL)):
    log = Log(level=level, name="/speaker", msg="one\\ntwo", file="alarm.py", function="ring", line=3)
    log.header.stamp = rospy.Time(1700000000, 250000000)
    rospy.Publisher(topic, Log, queue_size=1, latch=True).publish(log)
rospy.logfatal("bad")
rospy.spin()
"""

QUESTIONS = (
    "rosconsole list /speaker",
    "rosconsole get speaker rosout",
    "rosconsole set /speaker rosout DEBUG",
    "rosconsole get /speaker rosout",
    "rosconsole set /speaker rosout info",
    "rosconsole get /speaker rosout",
    "rosconsole echo -1 -v -l fatal --topic /alarm",
    "rosconsole echo -1 --topic /alarm speaker",
    "rosconsole echo -1 -v -l info --topic /calm",
)

MISTAKES = (
    "rosconsole nonsense",
    "rosconsole list",
    "rosconsole list -h",
    "rosconsole list /nobody",
    "rosconsole get /speaker",
    "rosconsole get /speaker nothing",
    "rosconsole get a b c",
    "rosconsole set -h",
    "rosconsole set /speaker rosout",
    "rosconsole set /speaker rosout loud",
    "rosconsole set /speaker nothing debug",
    "rosconsole set /nobody rosout loud",
    "rosconsole echo -h",
    "rosconsole echo -l LOUD",
)


@pytest.fixture(params=["genuine", "pipros"])
def speaker(request: pytest.FixtureRequest, ros: RosSystem) -> Process:
    """A logging node of one implementation, with a master of the other."""
    side, other = (ros.genuine, ros.pipros) if request.param == "genuine" else (ros.pipros, ros.genuine)
    if other is ros.genuine:
        other.start_bare_master()
    else:
        ros.serve_master()
    python = "/usr/bin/python3" if side is ros.genuine else "python"
    process = side.start(python, "-c", LOGGING_NODE)
    process.wait_for("bad")
    return process


@pytest.mark.timeout(400)
def test_both_get_the_same_responses(ros: RosSystem, speaker: Process) -> None:
    assert differences(ros, QUESTIONS) == {}


@pytest.mark.timeout(400)
@pytest.mark.parametrize("speaker", ["pipros"], indirect=True)
def test_both_handle_errors_alike(ros: RosSystem, speaker: Process) -> None:
    assert differences(ros, MISTAKES) == {}


def differences(ros: RosSystem, commands: Sequence[str]) -> dict[str, object]:
    """Return the outcomes that differ."""
    different: dict[str, object] = {}
    for command in commands:
        outcomes = []
        for side in (ros.genuine, ros.pipros):
            done = side.run(*command.split())
            outcomes.append((done.returncode, _plain(done.stdout), _plain(done.stderr)))
        if outcomes[0] != outcomes[1]:
            different[command] = outcomes
    return different


def _plain(lines: list[str]) -> list[str]:
    """Without colours, which genuine rosconsole prints into pipes, and without times."""
    text = re.sub(r"\x1b\[\d+m", "", "\n".join(lines))
    text, _, _ = text.partition("Exception in thread")  # genuine rosconsole, sometimes, at its end
    return re.sub(r"\[\d{4}-.* \([\d.]+\)\]", "[WHEN]", text).split("\n")


def test_a_roscpp_node_obeys(ros: RosSystem) -> None:
    ros.serve_master()
    ros.genuine.start_node("cpp_battery", "battery_listener", "battery_topic:=/battery_topic")
    ros.wait_for_subscriber("/battery_topic")
    for command in ("list cpp_listener", "get cpp_listener ros", "get cpp_listener ros.roscpp"):
        genuine, pipros = (side.run("rosconsole", *command.split()) for side in (ros.genuine, ros.pipros))
        assert (pipros.returncode, pipros.stdout) == (genuine.returncode, genuine.stdout)
    assert ros.pipros.run("rosconsole", "set", "/cpp_listener", "ros", "error").returncode == 0
    assert ros.genuine.run("rosconsole", "get", "/cpp_listener", "ros").stdout == ["error"]
