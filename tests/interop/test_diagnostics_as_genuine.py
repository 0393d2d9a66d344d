"""diagnostic_updater of both sides reports alike."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.interop.programs.examine_diagnostics import __file__ as script
from tests.support.ros import RosSystem

PROGRAMS = Path(__file__).parent / "programs"


def asked(python: str) -> Any:
    ended = subprocess.run(
        [python, script, "1", "200"],
        env={"PATH": "/usr/bin:/bin"},
        check=True,
        capture_output=True,
        text=True,
    )
    return json.loads(ended.stdout)


def test_tasks_report_alike_on_random_events() -> None:
    assert asked(sys.executable) == asked("/usr/bin/python3")


@pytest.mark.timeout(200)
def test_a_node_sends_the_same_reports(plain_ros: RosSystem) -> None:
    plain_ros.serve_master()
    program = PROGRAMS / "report_diagnostics.py"

    genuine = plain_ros.genuine.run("python3", program, timeout_s=60)
    ours = plain_ros.pipros.run("python3", program, timeout_s=60)

    assert ours.stdout == genuine.stdout, ours.output
    assert len(ours.stdout) == 9
