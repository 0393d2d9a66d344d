"""Every public function of rospy, with good and bad arguments, does what genuine rospy does."""

from __future__ import annotations

import difflib
import json
import re
from pathlib import Path

import pytest

from pipros.master.server import Master
from tests.support.processes import Process
from tests.support.ros import RosSystem, Side

SCRIPT = Path(__file__).with_name("examine_rospy.py")

ARGUMENTS = [
    "plain",
    "remapped:=renamed",
    "~private:=/elsewhere",
    "_integer:=5",
    "_text:=hello",
    "_list:=[1, two]",
    "_dict:={a: 1}",
    "_yes:=true",
    "_float:=1.5",
    "_quoted:='5'",
    "__log:=probe.log",
]

#: Where this rospy differs on purpose: (part, label) -> why.
DELIBERATE = {
    ("times", "rate 0"): "the words of the ZeroDivisionError are Python's own",
    ("parameters", "namespace"): "genuine answers from its cache of one parameter, and forgets the others",
}


def run(side: Side, *command: str) -> list[str]:
    """What the script printed, as `part | label | outcome` lines without addresses."""
    process: Process = side.run(*command, str(SCRIPT), *ARGUMENTS, timeout_s=50, ROS_NAMESPACE="ns")
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


@pytest.mark.timeout(120)
def test_rospy_does_what_genuine_rospy_does(ros: RosSystem) -> None:
    with Master(port=ros.port):
        genuine = run(ros.genuine, "/usr/bin/python3")
    with Master(port=ros.port):
        ours = run(ros.pipros, "python3")
    assert len(genuine) > 150
    differences = list(difflib.unified_diff(genuine, ours, "genuine", "pipros", n=0, lineterm=""))
    assert not differences, "\n".join(differences)
