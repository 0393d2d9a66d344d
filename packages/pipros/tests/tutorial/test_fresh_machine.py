"""script/venv on machines with missing programs: it names each one and the command that installs it."""

import shutil
from pathlib import Path

import pytest

from tests.support.environments import REPOSITORY, make_tool_folder
from tests.support.processes import Process, Processes

OLD = "case $1 in --version) echo Python 3.8.10 ;; *) exit 1 ;; esac"
WITHOUT_VENV = 'case "$*" in *ensurepip*) exit 1 ;; *) exit 0 ;; esac'
COMPLETE = (
    'case "$*" in *venv\\ .venv) mkdir -p .venv/bin && cp "$0" .venv/bin/python ;; esac; echo "$*" >>calls'
)


class Machine:
    """A machine with a copy of the set-up script and only the programs that a test adds."""

    def __init__(self, folder: Path, processes: Processes) -> None:
        self.folder = folder / "pipros"
        self._tools = make_tool_folder(folder / "bin")
        self._processes = processes
        (self.folder / "script").mkdir(parents=True)
        shutil.copy(REPOSITORY / "script" / "venv", self.folder / "script" / "venv")
        (self.folder / "pyproject.toml").write_text("one\n")

    def add(self, name: str, body: str) -> None:
        program = self._tools / name
        program.unlink(missing_ok=True)
        program.write_text(f"#!/bin/sh\n{body}\n")
        program.chmod(0o755)

    def run(self, *arguments: str) -> Process:
        path = {"PATH": str(self._tools), "PYTHON": ""}
        return self._processes.run(self.folder / "script" / "venv", *arguments, environment=path)

    def calls(self) -> list[str]:
        file = self.folder / "calls"
        return file.read_text().splitlines() if file.exists() else []


@pytest.fixture
def machine(tmp_path: Path, processes: Processes) -> Machine:
    made = Machine(tmp_path, processes)
    made.add("id", "echo 1000")
    return made


@pytest.mark.parametrize(("programs", "words"), [
    ({}, ["python3 is not installed. pipros needs Python 3.10 or newer."]),
    ({"python3": OLD}, ["Python 3.8.10 is too old: pipros needs Python 3.10 or newer.", "PYTHON=python3.12"]),
    ({"python3": WITHOUT_VENV}, ["On Debian and Ubuntu run: sudo apt-get install python3-venv"]),
    ({"python3": WITHOUT_VENV, "id": "echo 0", "apt-get": 'echo "$*" >>calls'},
        [". On Debian and Ubuntu run: apt-get install python3-venv"]),
], ids=["no Python", "an old Python", "Debian's Python without venv", "the same for root"])  # fmt: skip
def test_what_is_missing_is_named_with_a_way_out_and_nothing_is_installed_unasked(
    machine: Machine, programs: dict[str, str], words: list[str]
) -> None:
    for name, body in programs.items():
        machine.add(name, body)
    ended = machine.run()
    ended.check(1)
    assert all(word in ended.stderr[-1] for word in words), ended.output
    assert machine.calls() == []


def test_an_installation_is_unchanged_until_the_project_changes(machine: Machine) -> None:
    machine.add("python3", COMPLETE)

    first = machine.run("dev")
    calls = machine.calls()
    assert first.returncode == 0, first.output
    upgrade, installation = [call for call in calls if "pip install" in call]
    assert upgrade.endswith("--upgrade pip")
    assert installation.endswith("--editable . --group dev")

    # Whatever is in a plain installation is also in one for developers.
    for arguments in (["dev"], []):
        assert machine.run(*arguments).stderr == []
    assert [call for call in machine.calls() if "pip install" in call] == [upgrade, installation]

    (machine.folder / "pyproject.toml").write_text("two\n")
    machine.run()
    assert machine.calls()[-1].endswith("--editable .")
