"""Setup files treat the name of a workspace's folder as data: no shell executes it."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from pipros_workspace.index import SHIPPED_FOLDERS
from pipros_workspace.setup_files import write_setup_files

NAMES = [
    'it"s mine',
    "it's mine",
    "a $(touch PWNED) b",
    "a `touch PWNED` b",
    "a ${HOME} $HOME %s {b}",
    "two\nlines",
    "back\\slash | touch PWNED",
    "a & touch PWNED",
    "(touch PWNED)",
    "Ünïcode #* ?[a]",
]
PRINT = 'printf %s "$ROS_PACKAGE_PATH"'
SHELLS = {
    "dash": ("dash", "-c", f'. "$1"; {PRINT}', "dash"),
    "bash": ("bash", "--norc", "-c", f'. "$1"; {PRINT}', "bash"),
    "zsh": ("zsh", "-f", "-c", f'. "$1"; {PRINT}', "zsh"),
    "fish": ("fish", "--no-config", "-c", f"source $argv[1]; {PRINT}"),
}
SHELLS["setup.bash in zsh"] = SHELLS["zsh"]
FILES = {"dash": "setup.sh", "bash": "setup.bash", "zsh": "setup.zsh", "fish": "setup.fish"}
FILES["setup.bash in zsh"] = "setup.bash"


def devel_space(folder: Path, underlays: tuple[Path, ...] = ()) -> Path:
    (folder / "src").mkdir(parents=True)
    write_setup_files(folder / "devel", [folder / "src"], underlays)
    return folder / "devel"


def run(folder: Path, *argv: str | Path) -> subprocess.CompletedProcess[str]:
    variables = {"PATH": "/usr/bin:/bin", "HOME": str(folder), "LANG": "C.UTF-8"}
    return subprocess.run(argv, cwd=folder, env=variables, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("shell", SHELLS)
def test_a_folder_of_any_name_can_be_sourced(tmp_path: Path, shell: str, name: str) -> None:
    program = shutil.which(SHELLS[shell][0])
    if program is None:
        pytest.skip(f"{shell} is not installed")
    underlay = devel_space(tmp_path / "below" / name)
    devel = devel_space(tmp_path / name, (underlay,))

    sourced = run(tmp_path, program, *SHELLS[shell][1:], devel / FILES[shell])

    assert sourced.stdout.split(os.pathsep) == [
        str(tmp_path / name / "src"),
        str(tmp_path / "below" / name / "src"),
        *map(str, SHIPPED_FOLDERS),
    ], sourced.stderr
    assert sourced.stderr == ""
    assert list(tmp_path.rglob("PWNED")) == []


@pytest.mark.parametrize("name", NAMES)
def test_commands_run_in_the_environment_of_a_folder_of_any_name(tmp_path: Path, name: str) -> None:
    devel = devel_space(tmp_path / name)

    ran = run(tmp_path, devel / "env.sh", "sh", "-c", PRINT)
    local = run(tmp_path, "sh", "-c", f'. "$1"; {PRINT}', "sh", devel / "local_setup.sh")

    expected = f"{tmp_path / name / 'src'}{os.pathsep}{os.pathsep.join(map(str, SHIPPED_FOLDERS))}"
    assert (ran.stdout, ran.stderr) == (expected, "")
    assert (local.stdout, local.stderr) == (expected, "")
    assert list(tmp_path.rglob("PWNED")) == []
