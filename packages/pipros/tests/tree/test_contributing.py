"""The commands and paths in the guide for contributors exist."""

import os
import re
import subprocess
from pathlib import Path
from typing import Any

import pytest

from pipros.safe import yaml
from tests.support import documents
from tests.support.absent_plugins import DELETED
from tests.support.environments import REPOSITORY

GUIDE = (REPOSITORY / "CONTRIBUTING.md").read_text()
RECIPES = documents.text_of("internals/recipes.md")
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


@pytest.mark.parametrize("command", COMMANDS, ids=lambda file: file.name)
def test_every_command_explains_itself(command: Path) -> None:
    ended = subprocess.run([command, "--help"], capture_output=True, text=True, timeout=120)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert len(ended.stdout) > 80


def test_the_folder_of_commands_is_short() -> None:
    assert len([file for file in (REPOSITORY / "script").iterdir() if file.is_file()]) <= 15


def test_the_guide_can_be_read_in_five_minutes() -> None:
    assert len(GUIDE.split()) <= 900


def test_all_paths_in_the_guide_and_in_the_scripts_of_tutorials_exist() -> None:
    texts = [GUIDE, RECIPES, *map(Path.read_text, REPOSITORY.glob("packages/pipros/tests/tutorial/*.sh"))]
    path = r"(?:(?<![\w/])|(?<=\$here/))(?:script|packages|plugins|docs)/[\w./-]*\w"
    named = set(re.findall(path, "\n".join(texts)))
    assert {"script/check", "packages/pipros/tests/unit"} < named
    assert [
        path
        for path in named
        if path != "packages/pipros/src/pipros/share/NAME"
        and Path(path).parts[1].removeprefix("pipros-") not in DELETED
        and not (REPOSITORY / path).exists()
    ] == []


def test_pre_commit_hooks_are_the_parts_of_the_check() -> None:
    (local,) = read_yaml(".pre-commit-config.yaml")["repos"]
    assert {hook["entry"]: hook["stages"] for hook in local["hooks"]} == {
        "script/check lint": ["pre-commit"],
        "script/check format": ["pre-commit"],
        "script/check types": ["pre-push"],
    }


def test_the_workflow_runs_all_parts_of_ci_and_all_python_versions() -> None:
    jobs = read_yaml(".github/workflows/ci.yml")["jobs"]
    listed = re.search(r'^parts="install (.*)"$', (REPOSITORY / ".ci" / "run").read_text(), re.MULTILINE)
    assert listed
    assert jobs["part"]["strategy"]["matrix"]["part"] == listed[1].split()
    assert jobs["part"]["steps"][-1]["run"] == ".ci/run install ${{ matrix.part }}"
    assert jobs["tests"]["strategy"]["matrix"]["python"] == ["3.10", "3.11", "3.12", "3.13", "3.14"]
    assert not any(job.get("continue-on-error") for job in jobs.values())


def test_the_workflow_trusts_only_commits_and_gives_pull_requests_no_privileges() -> None:
    workflow = read_yaml(".github/workflows/ci.yml")
    assert workflow["permissions"] == {"contents": "read"}
    for job in workflow["jobs"].values():
        for step in job["steps"]:
            assert re.search("@[0-9a-f]{40}$", step.get("uses", "@" + "0" * 40)), step
        options = job.get("container", {}).get("options", "")
        assert "--privileged" not in options or "github.event_name == 'push' && '--privileged'" in options
