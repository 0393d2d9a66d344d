"""Messages, their tools and times, in corner cases of genpy and genmsg."""

from __future__ import annotations

import json
import os
import subprocess
import sys

from tests.interop.programs.examine_corners import __file__ as script


def test_every_corner_looks_as_in_genuine_ros() -> None:
    # The texts of genuine ROS' definitions, including comments. Under another name, Debian's folder comes
    # before the packages of pipros, as any other on the path.
    path = {"ROS_PACKAGE_PATH": "/usr/share/."}
    genuine = answers("/usr/bin/python3", {"PATH": "/usr/bin:/bin", **path})
    own = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")} | path

    ours = answers(sys.executable, own)

    assert len(genuine) > 700
    assert {line: ours[line] for line in genuine if ours[line] != genuine[line]} == {}
    failed = [line for line, said in genuine.items() if "NameError" in said]
    assert failed == [], "these lines say nothing"


def answers(python: str, environment: dict[str, str]) -> dict[str, str]:
    ended = subprocess.run([python, script], env=environment, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    found: dict[str, str] = json.loads(ended.stdout)
    return found
