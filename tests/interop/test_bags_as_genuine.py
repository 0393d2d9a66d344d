"""Bags of either side are read by both, and both say the same of them."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.environments import genuine_environment, make_tool_folder, pipros_environment

PROGRAM = Path(__file__).parent / "programs" / "examine_bags.py"
GENUINE = "/usr/bin/python3"
NOWHERE = "http://127.0.0.1:1"


def run(home: Path, python: str, *arguments: str) -> str:
    """What the program, or a command, prints."""
    if python == GENUINE:
        environment = genuine_environment(home, NOWHERE)
    else:
        tools = home / "tools"
        environment = pipros_environment(home, NOWHERE, tools if tools.exists() else make_tool_folder(tools))
    done = subprocess.run([python, *arguments], env=environment, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.timeout(600)
@pytest.mark.parametrize("writer", [GENUINE, sys.executable], ids=["genuine", "pipros"])
def test_random_bags_are_the_same_to_both(writer: str, tmp_path: Path) -> None:
    run(tmp_path, writer, str(PROGRAM), "write", str(tmp_path), "0", "120")
    files = sorted(map(str, tmp_path.glob("*.bag")))
    assert len(files) == 120

    told = [run(tmp_path, python, str(PROGRAM), "read", *files) for python in (GENUINE, sys.executable)]

    for file, genuine, ours in zip(files, *(text.splitlines() for text in told), strict=True):
        assert json.loads(ours) == json.loads(genuine), file
