"""Commands that genuine ROS lacks, or that print paths and builds, print their transcripts.

`RECORD_TRANSCRIPTS=1 script/test packages/pipros/tests/golden/cli/test_own_transcripts.py` records their
current output.
"""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

import pytest

import pipros
import pipros_workspace
from pipros.master.master import Master
from tests.golden.cli.scenes import MASKS, graph_for
from tests.golden.cli.test_transcripts import difference
from tests.golden.cli.transcript import Command, Outcome, mask_outcome, render, split
from tests.support.environments import REPOSITORY

HERE = Path(__file__).parent
EXAMPLE = REPOSITORY / "examples" / "catkin_ws" / "src" / "composiv_tryouts"
PROGRAMS = Path(sys.executable).parent


def run(command: Command, folder: Path, environment: Mapping[str, str]) -> Outcome:
    """Run a command as a shell would, with only the given environment."""
    program, *arguments = command.argv
    argv = [str(PROGRAMS / program), *arguments]
    variables = {**environment, **command.environment}
    done = subprocess.run(argv, env=variables, cwd=folder, capture_output=True, text=True, check=False)
    return Outcome(done.stdout, done.stderr, done.returncode)


def masks_for(folder: Path) -> dict[str, str]:
    """Replace output that differs between machines and installations."""
    places = {
        folder: "FOLDER", PROGRAMS: "BIN", Path(pipros.__file__).parent: "PIPROS",
        Path(pipros_workspace.__file__).parent: "WORKSPACE", REPOSITORY: "CHECKOUT",
    }  # fmt: skip
    masks = {re.escape(str(place)): name for place, name in places.items()}
    masks |= {rf"\b{re.escape(version('pipros'))}\b": "VERSION"}
    return {**masks, r"(?m)^(python|system)( +).*": r"\1\2…", **MASKS}


@pytest.mark.parametrize("name", sorted(path.stem for path in (HERE / "own").glob("*.txt")))
def test_commands_print_their_transcripts(name: str, tmp_path: Path) -> None:
    file = HERE / "own" / f"{name}.txt"
    folder = shutil.copytree(HERE / "files", tmp_path / "work")
    shutil.copytree(EXAMPLE, folder / "ws" / "src" / EXAMPLE.name)
    transcript = file.read_text()
    with Master(port=0) as master, graph_for(transcript, master.uri):
        environment = {
            "PATH": str(PROGRAMS), "HOME": str(folder), "ROS_MASTER_URI": master.uri, "ROS_IP": "127.0.0.1",
            "COLUMNS": "80", "LANG": "C.UTF-8",
        }  # fmt: skip
        blocks = []
        for block, line in split(transcript):
            if line is None:
                blocks.append(block)
                continue
            command = Command.parse(line)
            outcome = mask_outcome(run(command, folder, environment), masks_for(folder))
            blocks.append(render(command, outcome))
    if os.environ.get("RECORD_TRANSCRIPTS"):
        file.write_text("".join(blocks))
    assert difference(file.read_text(), "".join(blocks)) == ""
