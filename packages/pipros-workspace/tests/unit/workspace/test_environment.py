from __future__ import annotations

from pathlib import Path

import pytest

from pipros_workspace.environment import shell_code, underlays_of_build, workspace_environment
from pipros_workspace.index import SHARED_PACKAGES, SHIPPED_FOLDERS

SHIPPED = ":".join(map(str, SHIPPED_FOLDERS))


def space(base: Path, *folders: str, sources: str = "") -> Path:
    for folder in ("lib/python3/dist-packages", *folders):
        (base / folder).mkdir(parents=True, exist_ok=True)
    (base / ".catkin").write_text(sources)
    return base


@pytest.fixture
def devel(tmp_path: Path) -> Path:
    return space(tmp_path / "ws" / "devel", sources=f"{tmp_path}/ws/src")


@pytest.fixture
def underlay(tmp_path: Path) -> Path:
    return space(tmp_path / "under" / "install", "bin")


def test_a_workspace_sets_what_noetics_setup_files_set(devel: Path, tmp_path: Path) -> None:
    changes = workspace_environment(devel, [], {"PATH": "/bin", "PYTHONPATH": "/mine"})
    assert changes == {
        "CMAKE_PREFIX_PATH": str(devel), "LD_LIBRARY_PATH": f"{devel}/lib",
        "PYTHONPATH": f"{devel}/lib/python3/dist-packages:/mine",
        "ROS_PACKAGE_PATH": f"{tmp_path}/ws/src:{SHIPPED}", "ROS_DISTRO": "noetic", "ROS_VERSION": "1",
        "ROS_PYTHON_VERSION": "3", "ROS_ROOT": f"{SHARED_PACKAGES}/ros",
        "ROS_ETC_DIR": f"{SHARED_PACKAGES.parent}/etc/ros", "ROS_MASTER_URI": "http://localhost:11311",
    }  # fmt: skip


def test_the_folders_of_ros_exist(devel: Path) -> None:
    changes = workspace_environment(devel, [], {})

    assert Path(changes["ROS_ROOT"]).is_dir()
    assert Path(changes["ROS_ETC_DIR"], "python_logging.conf").is_file()


def test_sourcing_twice_changes_nothing(devel: Path, underlay: Path) -> None:
    once = {"PATH": "/bin"}
    once |= workspace_environment(devel, [underlay], once)
    assert workspace_environment(devel, [underlay], once) == {}


def test_the_workspaces_below_come_after_and_install_spaces_have_share(
    devel: Path, underlay: Path, tmp_path: Path
) -> None:
    changes = workspace_environment(devel, [underlay], {"PATH": "/bin"})
    assert changes["CMAKE_PREFIX_PATH"] == f"{devel}:{underlay}"
    assert changes["PATH"] == f"{underlay}/bin:/bin"
    assert changes["ROS_PACKAGE_PATH"] == f"{tmp_path}/ws/src:{underlay}/share:{SHIPPED}"


def test_sourcing_another_workspace_replaces_the_former(devel: Path, tmp_path: Path) -> None:
    other = space(tmp_path / "other" / "devel", sources="/other/src")
    environment = {"PATH": "/bin", "CMAKE_PREFIX_PATH": f"/nowhere:{tmp_path}"}
    environment |= workspace_environment(other, [], environment)
    environment |= workspace_environment(devel, [], environment)
    assert environment["CMAKE_PREFIX_PATH"] == f"{devel}:{tmp_path}"
    assert str(other) not in environment["PYTHONPATH"]
    assert "/other/src" not in environment["ROS_PACKAGE_PATH"]


def test_extend_keeps_the_existing_environment(devel: Path, tmp_path: Path) -> None:
    other = space(tmp_path / "other" / "devel", sources="/other/src")
    environment = {"PATH": "/bin"}
    environment |= workspace_environment(other, [], environment)
    environment |= workspace_environment(devel, [], environment, extend=True)
    assert environment["CMAKE_PREFIX_PATH"] == f"{devel}:{other}"
    assert environment["ROS_PACKAGE_PATH"].startswith(f"{tmp_path}/ws/src:/other/src:")


def test_programs_of_pipros_are_added_to_the_path_once(devel: Path) -> None:
    own = Path("/venv/bin")
    assert workspace_environment(devel, [], {"PATH": "/bin"}, own_programs=own)["PATH"] == "/venv/bin:/bin"
    assert "PATH" not in workspace_environment(devel, [], {"PATH": "/bin:/venv/bin"}, own_programs=own)


def test_an_environment_without_a_workspace_is_complete(devel: Path) -> None:
    changes = workspace_environment(None, [], {"PATH": "/bin", "ROS_MASTER_URI": "http://robot:11311"})
    assert changes["ROS_PACKAGE_PATH"] == SHIPPED
    assert changes["CMAKE_PREFIX_PATH"] == ":".join(str(folder.parent) for folder in SHIPPED_FOLDERS)
    sourced = workspace_environment(devel, [], changes)
    assert sourced["CMAKE_PREFIX_PATH"] == f"{devel}:{changes['CMAKE_PREFIX_PATH']}"
    assert "ROS_MASTER_URI" not in changes


def test_the_underlays_of_a_build_are_the_workspaces_that_are_set_up(devel: Path, underlay: Path) -> None:
    variables = {"CMAKE_PREFIX_PATH": f"{devel}:/nowhere:{underlay}"}
    assert underlays_of_build(variables, devel) == [underlay]


@pytest.mark.parametrize(("shell", "code"), [
    ("sh", "export A='it'\\''s $x'\n"), ("fish", "set -gx A 'it\\'s $x'\n"),
    ("powershell", "$env:A = 'it''s $x'\n"),
])  # fmt: skip
def test_values_are_quoted_for_each_shell(shell: str, code: str) -> None:
    assert shell_code({"A": "it's $x"}, shell) == code
