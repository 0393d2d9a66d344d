"""The files of examples/fleet."""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from pipros_fleet.fleet_file import parse_fleet_file, read_fleet_file
from tests.support import documents
from tests.support.environments import REPOSITORY
from tests.support.project import PLUGIN_PROJECTS, PROGRAMS

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
            [analyze, "verify", "--recursive-errors=no", str(copy)], capture_output=True, text=True,
            timeout=60,
        )  # fmt: skip
        assert ended.returncode == 0, ended.stderr


def test_the_container_runs_a_pipros_command(tmp_path: Path) -> None:
    """The image is not built: no test has containers or their registry."""
    lines = (EXAMPLES / "Containerfile").read_text().splitlines()
    instructions = dict(line.split(" ", 1) for line in lines if not line.startswith("#"))
    assert list(instructions) == ["FROM", "RUN", "USER", "EXPOSE", "ENTRYPOINT", "CMD"]
    assert instructions["USER"] == "nobody"
    assert f"-p {instructions['EXPOSE']}:{instructions['EXPOSE']}" in lines[3]

    (requirement,) = [word for word in shlex.split(instructions["RUN"]) if word.startswith("pipros")]
    assert requirement in PLUGIN_PROJECTS

    program, *arguments = json.loads(instructions["ENTRYPOINT"])
    module, _, function = PROGRAMS[program].partition(":")
    address, *keys = json.loads(instructions["CMD"])
    assert address == f"tls/0.0.0.0:{instructions['EXPOSE']}"
    ended = subprocess.run(
        [
            sys.executable, "-c",
            f"import sys; from {module} import {function}; sys.exit({function}(sys.argv[1:]))", *arguments,
            address, *keys,
        ],
        capture_output=True,
        text=True,
        timeout=60,
        cwd=tmp_path,
        env={**os.environ, "HOME": "/nonexistent"},
    )  # fmt: skip
    assert (ended.returncode, ended.stderr) == (
        1,
        "ERROR: [/fleet] has no authority; `pipros fleet keys create /fleet` creates one\n",
    )


# The example of docs/guides/fleets.md.


DOCUMENT = documents.text_of("guides/fleets.md")


def test_the_file_is_valid() -> None:
    (example,) = re.findall(r"^```yaml\n(.*?)^```", DOCUMENT, re.MULTILINE | re.DOTALL)

    file = parse_fleet_file(example, "plugins/pipros-fleet/docs/guides/fleets.md")

    assert file.router == "tls/router.lan:7447"


# Modules that an agent imports.


def test_an_agent_does_not_load_the_page() -> None:
    code = "import sys, pipros_fleet.serve; print([each for each in sys.modules if 'pipros_page' in each])"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True
    )
    assert done.stdout.strip() == "[]"
