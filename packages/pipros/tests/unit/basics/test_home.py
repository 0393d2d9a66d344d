"""The home folder, and its substitutes."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from pipros.basics import home
from pipros.basics.env import Environment
from pipros_tools.launch.model import Machine
from pipros_tools.launch.placement import is_local
from tests.support.users import give_away, needs_other_users

pwd = pytest.importorskip("pwd")


@pytest.fixture
def homeless(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Run without HOME and account; return the folder for temporary files."""

    def unknown(_number: int) -> None:
        raise KeyError("uid not found")

    for name in ("HOME", "ROS_HOME", "LOGNAME", "USER", "LNAME", "USERNAME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(pwd, "getpwuid", unknown)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    home.fallback_home.cache_clear()
    yield tmp_path
    home.fallback_home.cache_clear()


def stand_in(folder: Path) -> Path:
    return folder / f"pipros-home-{os.getuid()}"


def test_a_known_home_is_used(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", "/home/me")
    assert home.expanded("~/.ros") == "/home/me/.ros"
    assert home.expanded("/a/~") == "/a/~"


@pytest.mark.needs("file owners")
def test_without_a_home_a_private_folder_is_used(homeless: Path) -> None:
    assert Environment.from_os({}).log_dir == stand_in(homeless) / ".ros" / "log"
    assert Environment.from_os({}).ros_home == stand_in(homeless) / ".ros"
    assert Environment.from_os({"ROS_HOME": "~/mine"}).ros_home == stand_in(homeless) / "mine"
    assert stand_in(homeless).stat().st_mode & 0o777 == 0o700


def test_every_process_finds_the_same_one(homeless: Path) -> None:
    first = home.expanded("~")
    home.fallback_home.cache_clear()
    assert home.expanded("~") == first


def link(folder: Path) -> None:
    (folder / "elsewhere").mkdir()
    stand_in(folder).symlink_to(folder / "elsewhere")


def open_folder(folder: Path) -> None:
    stand_in(folder).mkdir()
    stand_in(folder).chmod(0o777)


def file(folder: Path) -> None:
    stand_in(folder).touch()


@pytest.mark.needs("file owners")
@pytest.mark.parametrize("plant", [link, open_folder, file])
def test_folders_that_another_user_could_have_made_are_not_used(
    homeless: Path, plant: Callable[[Path], None], capfd: pytest.CaptureFixture[str]
) -> None:
    plant(homeless)

    used = Path(home.expanded("~"))

    assert used.parent == homeless
    assert used != stand_in(homeless)
    assert used.stat().st_mode & 0o777 == 0o700
    assert f"ROS files go to {used}; set HOME or ROS_HOME" in capfd.readouterr().err


@needs_other_users
def test_the_folder_of_another_user_is_not_used(homeless: Path) -> None:
    stand_in(homeless).mkdir(mode=0o700)
    give_away(stand_in(homeless))

    assert home.expanded("~") != str(stand_in(homeless))


def test_without_a_writable_folder_a_path_is_returned_nevertheless(
    homeless: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(homeless / "missing"))
    assert home.expanded("~/.ros").endswith("/.ros")


def test_a_user_without_a_name_is_not_the_user_of_a_machine(homeless: Path) -> None:
    assert not is_local(Machine("here", "localhost", user="somebody"))
