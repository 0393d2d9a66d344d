from __future__ import annotations

import os
from pathlib import Path

import pytest

from pipros_workspace.hooks import HOOKS_FOLDER, find_hooks
from pipros_workspace.overlays import BuiltWorkspace, built_workspaces


@pytest.mark.parametrize(
    ("marker", "sources"), [("", ()), ("/a", ("/a",)), ("/a;/b", ("/a", "/b")), (" /a ; ;/b\n", ("/a", "/b"))]
)
def test_the_marker_lists_the_source_folders(tmp_path: Path, marker: str, sources: tuple[str, ...]) -> None:
    (tmp_path / ".catkin").write_text(marker)
    found = built_workspaces({"CMAKE_PREFIX_PATH": str(tmp_path)})
    assert found == (BuiltWorkspace(tmp_path, tuple(map(Path, sources))),)
    assert found[0].executables_of("robot") == tmp_path / "lib" / "robot"


def test_folders_without_a_marker_are_left_out_and_the_order_stays(tmp_path: Path) -> None:
    for name in ("upper", "lower"):
        (tmp_path / name).mkdir()
        (tmp_path / name / ".catkin").touch()
    (tmp_path / "plain").mkdir()
    path = os.pathsep.join(str(tmp_path / name) for name in ("upper", "plain", "nowhere", "lower"))
    prefixes = [
        workspace.prefix.name for workspace in built_workspaces({"CMAKE_PREFIX_PATH": f"{path}{os.pathsep}"})
    ]
    assert (prefixes, built_workspaces({})) == (["upper", "lower"], ())


def hook(workspace: Path, name: str) -> None:
    file = workspace / HOOKS_FOLDER / name
    file.parent.mkdir(parents=True, exist_ok=True)
    file.touch()


@pytest.mark.parametrize(("shell", "expected"), [
    ("sh", ["lower/05.b.sh", "upper/00.z.sh", "upper/10.a.sh"]),
    ("bash", ["lower/05.b.sh", "upper/00.z.sh", "upper/10.a.sh", "lower/10.a.bash"]),
    ("zsh", ["lower/05.b.sh", "upper/00.z.sh", "upper/10.a.sh"]), ("fish", ["upper/10.a.fish"]),
    ("powershell", []),
])  # fmt: skip
def test_hooks_run_from_the_underlay_up_and_each_name_once(
    tmp_path: Path, shell: str, expected: list[str]
) -> None:
    upper, lower = tmp_path / "upper", tmp_path / "lower"
    for name in ("10.a.sh", "00.z.sh", "10.a.fish"):
        hook(upper, name)
    for name in ("10.a.sh", "05.b.sh", "10.a.bash", "readme.txt"):
        hook(lower, name)
    found = find_hooks([upper, lower], shell)
    assert [f"{item.workspace.name}/{item.file.name}" for item in found] == expected
    assert all(item.file.parent == item.workspace / HOOKS_FOLDER for item in found)
