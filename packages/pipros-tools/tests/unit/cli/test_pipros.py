"""The `pipros` command."""

import json
import platform
import re
from pathlib import Path

import pytest

from pipros import __version__
from pipros.basics import plugin_table
from pipros.basics.plugins import Plugin, PluginCommand, named_plugins
from pipros_tools.cli import command_map, rosbag, rosdep
from pipros_tools.cli.complete.candidates import candidates
from pipros_tools.cli.pipros import main
from pipros_workspace.index import SHIPPED_FOLDERS
from pipros_workspace.overlays import MARKER
from tests.support.project import PROGRAMS as COMMANDS


def test_the_usage_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    assert "pipros stubs" in capsys.readouterr().out
    assert main(["nonsense"]) == 64


def test_the_version_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert (main(["--version"]), capsys.readouterr().out) == (0, f"{__version__}\n")


def test_versions_are_listed_for_a_report(capsys: pytest.CaptureFixture[str], monkeypatch) -> None:
    monkeypatch.setenv("ROS_DISTRO", "noetic")
    assert main(["version", "--json"]) == 0
    versions = json.loads(capsys.readouterr().out)
    assert (versions["pipros"], versions["ros"]) == (__version__, "noetic")
    assert versions["python"].startswith(platform.python_version())
    assert Path(versions["location"]).is_dir()
    assert main(["version"]) == 0
    assert f"pipros    {__version__}\n" in capsys.readouterr().out


def test_help_is_an_overview_of_all_commands(capsys: pytest.CaptureFixture[str], monkeypatch) -> None:
    monkeypatch.setattr(command_map, "installed_programs", lambda: {*COMMANDS, "mystery"})
    assert main(["--help"]) == 0
    words = capsys.readouterr().out.split()
    assert set(COMMANDS) - {"pipros-complete"} <= set(words)
    assert words[-3:] == ["Also", "installed:", "mystery"]


def test_every_command_is_in_the_overview() -> None:
    placed = {name for commands in command_map.COMMANDS.values() for name in commands}
    placed |= {name for room in named_plugins() for name in room.programs}
    assert set(COMMANDS) - placed == {"pipros", "pipros-complete"}


def test_the_overview_lists_only_installed_commands(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command_map, "installed_programs", lambda: {"rostopic"})
    text = command_map.command_map()

    assert "rosnode" not in text
    assert "rostopic" in text
    assert "pipros env" in text


SHELF = Plugin(
    "shelf", "books", programs={"shelve": PluginCommand("shelf:shelve", "store books", "Read")},
    subcommands={"shelf": PluginCommand(f"{__name__}:run_shelf", "find books", "Read", "find list")},
)  # fmt: skip


def run_shelf(argv: list[str]) -> int:
    print("shelf:", *argv)
    return 3


def test_commands_of_plugins_run_and_are_listed_and_completed(monkeypatch, capsys) -> None:
    for module in ("pipros_tools.cli.subcommands", "pipros_tools.cli.command_map"):
        monkeypatch.setattr(f"{module}.plugins", lambda: iter([SHELF]))
    monkeypatch.setattr(command_map, "installed_programs", lambda: {"rostopic", "rosbag", "shelve"})

    assert (main(["shelf", "find", "it"]), capsys.readouterr().out) == (3, "shelf: find it\n")
    assert main([]) == 0
    assert "\tpipros shelf\tfind books\n" in capsys.readouterr().out
    text = command_map.command_map()
    assert re.search(r"\n\nRead:\n  shelve +store books\n  pipros shelf +find books\n", text)
    assert text.index("rostopic") < text.index("shelve") < text.index("rosbag")
    assert {"doctor", "shelf"} < set(candidates(["pipros", ""]))
    assert list(candidates(["pipros", "shelf", ""])) == ["find", "list"]


def test_commands_of_absent_plugins_name_the_command_that_installs_them(monkeypatch, capsys) -> None:
    shelf = plugin_table.KnownPlugin("books", ("pipros shelf", "rosbag shelve", "rosdep"))
    monkeypatch.setattr(plugin_table, "PLUGINS", {"shelf": shelf})
    for module in ("pipros_tools.cli.rosdep", "pipros_tools.cli.subcommands", "pipros.basics.plugins"):
        monkeypatch.setattr(f"{module}.plugins", lambda: iter(()))
    monkeypatch.setattr("pipros.basics.extras._origin", dict)

    for command, run, code in (
        ("pipros shelf", lambda: main(["shelf"]), 1),
        ("rosbag shelve", lambda: rosbag.main(["shelve"]), plugin_table.NOT_INSTALLED),
        ("rosdep", lambda: rosdep.main([]), plugin_table.NOT_INSTALLED),
    ):
        assert run() == code
        output, error = capsys.readouterr()
        assert output == ""
        assert error.startswith(f"ERROR: {command} belongs to pipros-shelf (books), which is not installed.")
        assert error.endswith("pip install pipros-shelf\n")


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """A workspace built by catkin_make, without packages."""
    devel = tmp_path / "my ws" / "devel"
    devel.mkdir(parents=True)
    (devel / MARKER).write_text(str(tmp_path / "my ws" / "src"))
    return devel.parent


def test_env_prints_what_the_setup_file_would_set(workspace: Path, capsys, monkeypatch) -> None:
    monkeypatch.delenv("CMAKE_PREFIX_PATH", raising=False)
    for folder in (workspace, workspace / "devel"):
        assert main(["env", str(folder)]) == 0
        assert f"export CMAKE_PREFIX_PATH='{workspace}/devel'\n" in capsys.readouterr().out
    assert main(["env", "--shell", "fish", str(workspace)]) == 0
    assert f"set -gx CMAKE_PREFIX_PATH '{workspace}/devel'\n" in capsys.readouterr().out
    assert main(["env", "--json", str(workspace)]) == 0
    assert json.loads(capsys.readouterr().out)["ROS_PACKAGE_PATH"].startswith(f"{workspace}/src")


def test_env_without_a_workspace_is_that_of_pipros(capsys: pytest.CaptureFixture[str], monkeypatch) -> None:
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    assert main(["env"]) == 0
    shares = ":".join(map(str, SHIPPED_FOLDERS))
    assert f"export ROS_PACKAGE_PATH='{shares}'\n" in capsys.readouterr().out


def test_env_reports_that_nothing_was_built(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["env", str(tmp_path)]) == 1
    assert "is not a built workspace; run catkin_make" in capsys.readouterr().err


def test_stubs_are_written_where_editors_look(tmp_path: Path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["stubs", "std_srvs"]) == 0
    assert capsys.readouterr().out.split() == [
        "typings/std_srvs/srv/__init__.pyi",
        "typings/std_srvs/__init__.pyi",
    ]
    text = (tmp_path / "typings" / "std_srvs" / "srv" / "__init__.pyi").read_text()
    assert "class SetBoolRequest(_base.Message):\n" in text
    assert "\n    data: bool\n" in text
