"""The files of examples/fleet."""

from __future__ import annotations

import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from pipros.fleet.fleet_file import read_fleet_file
from tests.support.environments import REPOSITORY

EXAMPLES = REPOSITORY / "examples" / "fleet"
UNITS = sorted(EXAMPLES.glob("*.service"))


def test_the_file_of_a_robot_is_valid() -> None:
    file = read_fleet_file(EXAMPLES / "fleet.yaml")
    camera, command = file.shared_topic("/camera/image"), file.accepted_topic("/cmd_vel")
    assert camera is not None
    assert camera.is_latest_only
    assert command is not None
    assert not command.accepts("robot2")


@pytest.mark.parametrize("unit", UNITS, ids=lambda unit: unit.stem)
def test_units_run_a_pipros_command(unit: Path, tmp_path: Path) -> None:
    """With systemd on the machine, it verifies the unit, for a program that exists."""
    (line,) = [line for line in unit.read_text().splitlines() if line.startswith("ExecStart=")]
    program, fleet, *rest = shlex.split(line.partition("=")[2])
    assert (program, fleet) == ("/opt/pipros/bin/pipros", "fleet")
    assert rest[0] in ("router", "join")
    analyze = shutil.which("systemd-analyze")
    if analyze is not None:
        copy = tmp_path / unit.name
        copy.write_text(unit.read_text().replace(program, "/bin/true"))
        ended = subprocess.run(
            [analyze, "verify", "--recursive-errors=no", str(copy)],
            capture_output=True,
            text=True,
            timeout=60,
        )
        assert ended.returncode == 0, ended.stderr
