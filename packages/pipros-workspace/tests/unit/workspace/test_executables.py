import os
from pathlib import Path

import pytest

from pipros_workspace.executables import find_executables, list_executables
from pipros_workspace.hooks import HOOKS_FOLDER, find_hooks
from pipros_workspace.index import SHARED_PACKAGES, Package
from pipros_workspace.overlays import BuiltWorkspace, built_workspaces


def program(path: Path, *, mode: int = 0o755) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("#!/bin/sh\n")
    path.chmod(mode)
    return path


@pytest.fixture
def package(tmp_path: Path) -> Package:
    (tmp_path / "src" / "p").mkdir(parents=True)
    return Package("p", tmp_path / "src" / "p")


@pytest.fixture
def workspace(tmp_path: Path) -> BuiltWorkspace:
    return BuiltWorkspace(tmp_path / "devel", (tmp_path / "src",))


def test_a_script_is_found_at_any_depth(package: Package) -> None:
    script = program(package.path / "scripts" / "deep" / "talker.py")
    assert find_executables(package, "talker.py", ()).runnable == (script,)
    assert find_executables(package, "deep/talker.py", ()).runnable == (script,)
    assert find_executables(package, "other/talker.py", ()).runnable == ()


@pytest.mark.needs("executable files")
def test_files_that_cannot_be_executed_are_listed_separately(package: Package) -> None:
    plain = program(package.path / "scripts" / "talker.py", mode=0o644)
    folder = package.path / "talker.py"
    folder.mkdir()
    found = find_executables(package, "talker.py", ())
    assert (found.runnable, found.unusable) == ((), (folder, plain))


@pytest.mark.needs("executable files")
def test_a_name_is_matched_whole(package: Package) -> None:
    program(package.path / "talker.py")
    assert find_executables(package, "talker", ()).runnable == ()


def test_hidden_folders_are_passed_over(package: Package) -> None:
    program(package.path / ".git" / "talker.py")
    assert find_executables(package, "talker.py", ()).runnable == ()


def test_links_to_one_file_count_once(package: Package) -> None:
    script = program(package.path / "a" / "talker.py")
    (package.path / "b").mkdir()
    (package.path / "b" / "talker.py").symlink_to(script)
    assert find_executables(package, "talker.py", ()).runnable == (script,)


def test_several_candidates_are_all_given(package: Package) -> None:
    one, two = program(package.path / "a" / "talker.py"), program(package.path / "b" / "talker.py")
    found = find_executables(package, "talker.py", ())
    assert found.runnable == (one, two)
    assert found.relay is None


def test_a_built_program_comes_first_and_relays_to_its_source(
    package: Package, workspace: BuiltWorkspace
) -> None:
    source = program(package.path / "scripts" / "talker.py")
    built = program(workspace.executables_of("p") / "talker.py")
    found = find_executables(package, "talker.py", [workspace])
    assert (found.runnable, found.relay) == ((built, source), built)


def test_two_built_programs_are_not_a_relay(package: Package, workspace: BuiltWorkspace) -> None:
    program(workspace.executables_of("p") / "a" / "talker.py")
    program(workspace.executables_of("p") / "b" / "talker.py")
    assert find_executables(package, "talker.py", [workspace]).relay is None


def test_only_the_topmost_workspace_with_this_package_counts(
    package: Package, workspace: BuiltWorkspace, tmp_path: Path
) -> None:
    below = BuiltWorkspace(tmp_path / "underlay")
    program(below.executables_of("p") / "talker")
    built = program(workspace.executables_of("p") / "talker")
    assert find_executables(package, "talker", [workspace, below]).runnable == (built,)


@pytest.mark.needs("executable files")
def test_programs_are_listed_by_name(package: Package, workspace: BuiltWorkspace) -> None:
    program(package.path / "scripts" / "b.py")
    program(package.path / "scripts" / "plain.py", mode=0o644)
    program(workspace.executables_of("p") / "a")
    assert list_executables(package, [workspace]) == ["a", "b.py"]


def test_a_program_that_is_not_compiled_runs_from_the_shipped_package(tmp_path: Path) -> None:
    source = Package("joy", tmp_path)
    (tmp_path / "include" / "joy_node").mkdir(parents=True)
    shipped = SHARED_PACKAGES / "joy" / "scripts" / "joy_node"

    found = find_executables(source, "joy_node", ())

    assert (found.runnable, found.searched) == ((shipped,), (SHARED_PACKAGES / "joy", tmp_path))
    assert list_executables(source, ()) == ["joy_node"]


@pytest.mark.needs("executable files")
def test_a_file_that_is_not_executable_hides_the_shipped_program(tmp_path: Path) -> None:
    source = Package("joy", tmp_path)
    plain = program(tmp_path / "joy_node", mode=0o644)
    assert find_executables(source, "joy_node", ()).runnable == ()
    plain.chmod(0o755)
    assert find_executables(source, "joy_node", ()).runnable == (plain,)


def test_workspaces_are_the_marked_folders_of_the_prefix_path(tmp_path: Path) -> None:
    devel, install, other = tmp_path / "devel", tmp_path / "install", tmp_path / "other"
    for folder in (devel, install, other):
        folder.mkdir()
    (devel / ".catkin").write_text("/ws/a;/ws/b")
    (install / ".catkin").write_text("")
    variables = {"CMAKE_PREFIX_PATH": f"{devel}::{other}:{install}:/nowhere"}
    assert built_workspaces(variables) == (
        BuiltWorkspace(devel, (Path("/ws/a"), Path("/ws/b"))),
        BuiltWorkspace(install),
    )
    assert built_workspaces({}) == ()


def test_on_windows_the_name_itself_comes_before_the_name_with_a_suffix(
    package: Package, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pipros_workspace.executables.ON_WINDOWS", True)
    monkeypatch.setattr("pipros_workspace.executables._is_executable", Path.is_file)
    for name in ("server.py", "server", "client.py", "client.exe"):
        program(package.path / "scripts" / name)
    program(package.path / "other" / "server.py")
    found = find_executables(package, "server", ()).runnable
    assert found == (package.path / "other" / "server.py", package.path / "scripts" / "server")
    assert find_executables(package, "client", ()).runnable == (package.path / "scripts" / "client.exe",)


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
