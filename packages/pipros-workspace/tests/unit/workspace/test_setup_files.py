"""The setup files of a workspace, sourced by real shells."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import tree_sitter_powershell
from tree_sitter import Language, Node, Parser

from pipros_workspace.environment import shell_code, underlays_of_build, workspace_environment
from pipros_workspace.hooks import HOOKS_FOLDER
from pipros_workspace.index import SHARED_PACKAGES, SHIPPED_FOLDERS
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
        write_setup_files(tmp_path / "100%", [tmp_path / "src"], [])
        write_relaying_setup_files(tmp_path / "all", tmp_path / "100%")
        for folder in ("100%", "all"):
            assert (tmp_path / folder / "setup.bat").exists() == is_windows
    named = str(tmp_path / "100%%" / "setup.bat")
    assert (tmp_path / "all" / "setup.bat").read_text().rstrip() == f'@"{named}" %*'


# The PowerShell setup file, checked by a grammar of PowerShell, because the shell is not packaged.


def read(code: str) -> Node:
    """Return the root of the syntax tree; it has no error."""
    root = Parser(Language(tree_sitter_powershell.language())).parse(code.encode()).root_node
    assert not root.has_error, f"{root}\n{code}"
    return root


def below(node: Node) -> Iterator[Node]:
    for child in node.children:
        yield child
        yield from below(child)


def texts(root: Node, kind: str) -> list[str]:
    return [(node.text or b"").decode() for node in below(root) if node.type == kind]


def values_of(root: Node) -> list[str]:
    """Return the values of all literals, after joining literals and characters that `+` joins."""
    assert (root.text or b"").isascii(), "Windows PowerShell 5 reads code pages"
    values, is_joined = [], False
    for node in below(root):
        text = (node.text or b"").decode()
        if node.type == "+":
            is_joined = True
        if node.type == "verbatim_string_characters":
            part = text[1:-1].replace("''", "'")
        elif node.type == "cast_expression" and (number := re.fullmatch(r"\[char\](\d+)", text)):
            part = chr(int(number[1]))
        else:
            continue
        values.append(values.pop() + part if is_joined else part)
        is_joined = False
    return values


@pytest.mark.parametrize("python", ["/usr/bin/python3", "C:\\Users\\o'neil\\it’s [mine]\\python.exe"])  # noqa: RUF001
def test_the_setup_file_is_powershell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, python: str) -> None:
    monkeypatch.setattr(sys, "executable", python)
    write_setup_files(tmp_path, [tmp_path / "src"], [])
    root = read((tmp_path / "setup.ps1").read_text("utf-8"))
    assert texts(root, "command_name") == [
        "Test-Path", "Where-Object", "Out-String", "Invoke-Expression", "Remove-Variable",
    ]  # fmt: skip
    assert python in values_of(root)
    for literal in texts(root, "verbatim_string_characters"):
        assert '"' not in literal, "PowerShell before 7.3 loses such quotes on the way to a program"


@pytest.mark.parametrize(
    "value",
    ["/a:/b", "it's", "‘quoted’ ‚so‛", "$HOME `n $(evil)", "two\nlines", "", "# no comment", "';evil;'"],  # noqa: RUF001
)
def test_arbitrary_values_survive_as_one_string(value: str) -> None:
    root = read(shell_code({"ROS_PACKAGE_PATH": value, "ROS_DISTRO": "noetic"}, "powershell"))
    assert texts(root, "variable") == ["$env:ROS_PACKAGE_PATH", "$env:ROS_DISTRO"]
    assert values_of(root) == [value, "noetic"]
    assert not texts(root, "command")


def test_the_grammar_notices_mistakes() -> None:
    with pytest.raises(AssertionError):
        read("if (-not (Test-Path $a) { 1 }\n")


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
