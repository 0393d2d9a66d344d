"""The commands and paths in the guide for contributors exist."""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path
from typing import Any

import pytest

from pipros.safe import yaml
from tests.support.absent_rooms import DELETED
from tests.support.environments import REPOSITORY

GUIDE = (REPOSITORY / "CONTRIBUTING.md").read_text()
COMMANDS = sorted(file for file in (REPOSITORY / "script").iterdir() if not file.suffix and file.is_file())


def read_yaml(name: str) -> Any:
    return yaml.load((REPOSITORY / name).read_text())


@pytest.mark.parametrize("command", COMMANDS, ids=lambda file: file.name)
def test_every_command_can_be_run_and_is_in_the_guide(command: Path) -> None:
    assert os.access(command, os.X_OK)
    # `script/venv` is called by the others. The block must not be wrapped like a paragraph.
    assert (
        re.search(rf"^script/{command.name} |`script/{command.name}\b", GUIDE, re.MULTILINE)
        or command.name == "venv"
    )


def test_all_paths_in_the_guide_exist() -> None:
    named = set(re.findall(r"\b(?:script|packages|docs)/[\w./-]*\w", GUIDE))
    assert {"script/check", "packages/pipros/tests/unit"} < named
    assert [
        path
        for path in named
        if path != "packages/pipros/src/pipros/share/NAME"
        and Path(path).parts[1] not in DELETED
        and not (REPOSITORY / path).exists()
    ] == []


def test_pre_commit_hooks_are_the_parts_of_the_check() -> None:
    (local,) = read_yaml(".pre-commit-config.yaml")["repos"]
    assert {hook["entry"]: hook["stages"] for hook in local["hooks"]} == {
        "script/check lint": ["pre-commit"],
        "script/check format": ["pre-commit"],
        "script/check types": ["pre-push"],
    }


def test_an_unknown_part_of_the_check_is_refused() -> None:
    ended = subprocess.run([REPOSITORY / "script" / "check", "spelling"], capture_output=True, text=True)
    assert (ended.returncode, ended.stdout) == (2, "")
    assert "must be lint, format, types, platforms or page, got spelling" in ended.stderr


def test_the_workflow_runs_all_parts_of_ci_and_all_python_versions() -> None:
    jobs = read_yaml(".github/workflows/ci.yml")["jobs"]
    listed = re.search(r'^parts="install (.*)"$', (REPOSITORY / ".ci" / "run").read_text(), re.MULTILINE)
    assert listed
    assert jobs["part"]["strategy"]["matrix"]["part"] == listed[1].split()
    assert {"run": ".ci/run install ${{ matrix.part }}"} in jobs["part"]["steps"]
    assert jobs["tests"]["strategy"]["matrix"]["python"] == ["3.10", "3.11", "3.12", "3.13", "3.14"]
    assert not any(job.get("continue-on-error") for job in jobs.values())


def test_an_unknown_part_of_continuous_integration_is_refused() -> None:
    ended = subprocess.run([REPOSITORY / ".ci" / "run", "spelling"], capture_output=True, text=True)
    assert (ended.returncode, ended.stdout) == (2, "")
    assert "one of: install check docs fuzz fresh user wheel pyodide lacks windows test" in ended.stderr
