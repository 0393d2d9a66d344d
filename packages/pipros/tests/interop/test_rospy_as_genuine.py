"""Every public function of rospy behaves like genuine rospy, with valid and invalid arguments.

Each script runs under genuine rospy and under pipros, and must print the same.
"""

import difflib
import json
import re
from pathlib import Path

import pytest

from pipros.master.master import Master
from tests.support.ros import RosSystem, Side

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
    ("examine_rospy.py", *ARGUMENTS): 150, ("examine_early_names.py", *REMAPPINGS): 200,
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
