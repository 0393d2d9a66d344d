"""The setup files of a workspace, sourced by real shells."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from pipros_workspace.hooks import HOOKS_FOLDER
from pipros_workspace.overlays import built_workspaces
from pipros_workspace.setup_files import write_if_changed, write_relaying_setup_files, write_setup_files

SHELLS = [shell for shell in ("sh", "bash", "zsh", "fish") if shutil.which(shell)]
NAMES = ("CMAKE_PREFIX_PATH", "ROS_PACKAGE_PATH", "ROS_DISTRO", "HOOKED")


def workspace(base: Path, name: str, *underlays: Path) -> Path:
    prefix = base / name / "devel"
    (base / name / "src").mkdir(parents=True)
    write_setup_files(prefix, [base / name / "src"], underlays)
    hook = prefix / HOOKS_FOLDER / f"10.{name}.sh"
    hook.parent.mkdir(parents=True)
    hook.write_text(f'export HOOKED="${{HOOKED}}{name},"\n')
    return prefix


def sourced(shell: str, *files: Path, options: str = "") -> dict[str, str]:
    """Return the variables after sourcing files one after another."""
    word = "source" if shell == "fish" else "."
    lines = [f"{word} '{file}' {options}" for file in files]
    ended = subprocess.run(
        [shell, "-c", "; ".join([*lines, "env"])],
        env={"PATH": os.environ["PATH"], "HOME": "/nonexistent"},
        capture_output=True, text=True, timeout=60, check=True,
    )  # fmt: skip
    pairs = (line.partition("=") for line in ended.stdout.splitlines())
    return dict.fromkeys(NAMES, "") | {name: value for name, _, value in pairs if name in NAMES}


@pytest.mark.parametrize("shell", SHELLS)
def test_a_workspace_and_those_below_it_are_set_up(tmp_path: Path, shell: str) -> None:
    lower = workspace(tmp_path, "lower")
    upper = workspace(tmp_path, "upper", lower)
    found = sourced(shell, upper / f"setup.{shell}")
    assert found["CMAKE_PREFIX_PATH"] == f"{upper}:{lower}"
    assert found["ROS_PACKAGE_PATH"].startswith(f"{tmp_path}/upper/src:{tmp_path}/lower/src:")
    assert found["ROS_DISTRO"] == "noetic"
    assert found["HOOKED"] == ("" if shell == "fish" else "lower,upper,")


@pytest.mark.parametrize("shell", SHELLS)
def test_a_folder_of_workspaces_sets_up_the_last(tmp_path: Path, shell: str) -> None:
    first = workspace(tmp_path, "first")
    last = workspace(tmp_path, "it's last", first)
    (tmp_path / "all").mkdir()
    write_relaying_setup_files(tmp_path / "all", last)
    found = sourced(shell, tmp_path / "all" / f"setup.{shell}")
    assert found["CMAKE_PREFIX_PATH"] == f"{last}:{first}"


@pytest.mark.parametrize("shell", [shell for shell in SHELLS if shell != "fish"])
def test_local_files_leave_others_alone(tmp_path: Path, shell: str) -> None:
    lower = workspace(tmp_path, "lower")
    other = workspace(tmp_path, "other")
    upper = workspace(tmp_path, "upper", lower)
    found = sourced(shell, other / f"setup.{shell}", upper / f"local_setup.{shell}")
    assert found["CMAKE_PREFIX_PATH"] == f"{upper}:{other}"


def test_env_sh_runs_a_command_in_the_workspace(tmp_path: Path) -> None:
    prefix = workspace(tmp_path, "ws")
    (tmp_path / "all").mkdir()
    write_relaying_setup_files(tmp_path / "all", prefix)
    for script in (prefix / "env.sh", tmp_path / "all" / "env.sh"):
        command = [str(script), "sh", "-c", "echo $CMAKE_PREFIX_PATH; exit 7"]
        ended = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
        assert (ended.returncode, ended.stdout) == (7, f"{prefix}\n")
    assert (
        subprocess.run([str(prefix / "env.sh")], capture_output=True, timeout=60, check=False).returncode == 1
    )


def test_the_marker_names_the_sources(tmp_path: Path) -> None:
    write_setup_files(tmp_path / "devel", [Path("/a"), Path("/b")], [])
    write_setup_files(tmp_path / "install", [], [])
    paths = f"{tmp_path / 'devel'}{os.pathsep}{tmp_path / 'install'}"
    assert [found.sources for found in built_workspaces({"CMAKE_PREFIX_PATH": paths})] == [
        (Path("/a"), Path("/b")),
        (),
    ]


def test_files_are_written_only_when_they_change(tmp_path: Path) -> None:
    file = tmp_path / "below" / "x"
    assert write_if_changed(file, "a")
    assert not write_if_changed(file, "a")
    assert write_if_changed(file, "b")
    file.write_bytes(b"\xff")
    assert write_if_changed(file, "ä")
    assert file.read_text("utf-8") == "ä"


def test_a_batch_file_is_written_on_windows_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for is_windows in (False, True):
        monkeypatch.setattr("pipros_workspace.setup_files.ON_WINDOWS", is_windows)
        write_setup_files(tmp_path / "devel", [tmp_path / "src"], [])
        write_relaying_setup_files(tmp_path / "all", tmp_path / "devel")
        for folder in ("devel", "all"):
            assert (tmp_path / folder / "setup.bat").exists() == is_windows
    assert str(tmp_path / "devel") in (tmp_path / "all" / "setup.bat").read_text()
