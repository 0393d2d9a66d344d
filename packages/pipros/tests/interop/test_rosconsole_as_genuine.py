"""rospy and rosconsole behave as genuine ones, with the loggers of both sides."""

import difflib
import json
import re
from collections.abc import Sequence
from pathlib import Path

import pytest

from pipros.master.master import Master
from tests.support.processes import Process
from tests.support.ros import RosSystem, Side

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
    "rosconsole list /speaker", "rosconsole get speaker rosout", "rosconsole set /speaker rosout DEBUG",
    "rosconsole get /speaker rosout", "rosconsole set /speaker rosout info", "rosconsole get /speaker rosout",
    "rosconsole echo -1 -v -l fatal --topic /alarm", "rosconsole echo -1 --topic /alarm speaker",
    "rosconsole echo -1 -v -l info --topic /calm",
)  # fmt: skip

MISTAKES = (
    "rosconsole nonsense", "rosconsole list", "rosconsole list -h", "rosconsole list /nobody",
    "rosconsole get /speaker", "rosconsole get /speaker nothing", "rosconsole get a b c", "rosconsole set -h",
    "rosconsole set /speaker rosout", "rosconsole set /speaker rosout loud",
    "rosconsole set /speaker nothing debug", "rosconsole set /nobody rosout loud", "rosconsole echo -h",
    "rosconsole echo -l LOUD",
)  # fmt: skip


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


def test_both_get_the_same_responses(ros: RosSystem, speaker: Process) -> None:
    assert differences(ros, QUESTIONS) == {}


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


# The terminal output of nodes: format, colours, titles.
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
FORMATS = (
    "", "ROSCONSOLE_FORMAT='[${severity}] ${node} ${logger} ${function}: ${message}' ",
    "ROSCONSOLE_FORMAT='${message} ${line} ${file}' ",
)  # fmt: skip


def shown(side: Side, script: str, *formats: str) -> list[str]:
    """Return the outputs of a script on a terminal, with placeholders for times."""
    (side.home / "script.py").write_text(script)
    terminal = side.open_terminal()
    outputs = []
    for each in formats:
        code, output = terminal.run(f"{each}python3 script.py")
        assert code == 0, output
        outputs.append(re.sub(r"\d{10}\.\d{6}", "TIME", output))
    return outputs


def test_log_lines_look_the_same_in_each_format(ros: RosSystem) -> None:
    ros.serve_master()
    theirs, ours = (shown(side, LOGS, *FORMATS) for side in (ros.genuine, ros.pipros))

    assert list(map(_without_internals, ours)) == list(map(_without_internals, theirs))
    assert all("\x1b[33m" in output and "\x1b[31m" in output for output in ours)


def test_the_warning_about_a_missing_queue_size_looks_the_same(ros: RosSystem) -> None:
    ros.serve_master()
    theirs, ours = (shown(side, WARNS, "") for side in (ros.genuine, ros.pipros))

    assert ours == theirs
    assert "script.py:5: SyntaxWarning" in ours[0]


def _without_internals(text: str) -> str:
    """Return the lines of the script: at DEBUG, each side also logs its own work."""
    said = ("a debug line", "25 % of 100", "a warning", "an error", "the end", "two", "lines, é", "once")
    return "".join(line for line in text.splitlines(keepends=True) if any(part in line for part in said))


# Every public function of rospy behaves like genuine rospy, with valid and invalid arguments.
#
# Each script runs under genuine rospy and under pipros, and must print the same.


REMAPPINGS = ["from:=to", "/abs:=/dest", "abs:=moved", "x:=xx", "~p:=pp", "deep/x:=deeper"]

ARGUMENTS = [
    "plain", "remapped:=renamed", "~private:=/elsewhere", "_integer:=5", "_text:=hello", "_list:=[1, two]",
    "_dict:={a: 1}", "_yes:=true", "_float:=1.5", "_quoted:='5'", "__log:=probe.log",
]  # fmt: skip

DELIBERATE = {
    ("times", "rate 0"): "the words of the ZeroDivisionError are Python's own",
    ("parameters", "namespace"): "genuine answers from its cache of one parameter, and forgets the others",
}
"""Where this rospy differs on purpose: (part, label) -> why."""


SCRIPTS = {
    ("examine_rospy.py", *ARGUMENTS): 163, ("examine_early_names.py", *REMAPPINGS): 200,
    ("examine_early_names.py", *REMAPPINGS, "__ns:=/cmd"): 200, ("examine_topic_impl.py",): 40,
    ("examine_junitxml.py",): 12, ("examine_private_names.py",): 35, ("examine_durations.py",): 40,
    ("examine_the_rest.py",): 80, ("examine_tool_libraries.py",): 35, ("examine_second_node.py",): 15,
    ("examine_sequences.py",): 40, ("examine_user_loggers.py",): 6, ("examine_user_loggers.py", "own"): 6,
    ("examine_second_node.py", "revived"): 20,
}  # fmt: skip
"""Script and arguments -> how many outcomes it has at least."""


def run(side: Side, python: str, script: str, *arguments: str) -> list[str]:
    """Return the output of the script: `part | label | outcome` lines without addresses."""
    path = str(Path(__file__).parent / "programs" / script)
    process = side.run(python, path, *arguments, timeout_s=110, ROS_NAMESPACE="ns")
    assert process.returncode == 0, process.output
    part, lines = "before_init", []
    for line in process.stdout:
        if not line.startswith("@@"):
            continue
        record = json.loads(line[2:])
        if record["label"].startswith("-- "):
            part = record["label"][3:]
        elif (part, record["label"]) not in DELIBERATE:
            outcome = re.sub(r"0x[0-9a-f]+|127\.0\.0\.1:\d+", "…", json.dumps(record, ensure_ascii=False))
            lines.append(f"{part} | {outcome}")
    return lines


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: f"{script[0]}-{script[-1]}")
def test_rospy_behaves_like_genuine_rospy(ros: RosSystem, script: tuple[str, ...]) -> None:
    with Master(port=ros.port):
        genuine = run(ros.genuine, "/usr/bin/python3", *script)
    with Master(port=ros.port):
        ours = run(ros.pipros, "python3", *script)
    assert len(genuine) >= SCRIPTS[script]
    differences = list(difflib.unified_diff(genuine, ours, "genuine", "pipros", n=0, lineterm=""))
    assert not differences, "\n".join(differences)


def test_without_a_master_calls_are_refused_as_by_genuine_rospy(ros: RosSystem) -> None:
    genuine = run(ros.genuine, "/usr/bin/python3", "examine_no_master.py")
    ours = run(ros.pipros, "python3", "examine_no_master.py")
    assert len(ours) == 7
    assert ours == genuine
