"""The home folder, and its substitutes."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from pipros.basics import home
from pipros.basics.env import Environment
from pipros.basics.limits import Limits
from pipros.basics.log_file import LogFile, open_to_write
from pipros_tools.launch.console import Console
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
    assert (home.expanded("~/.ros"), home.expanded("/a/~")) == ("/home/me/.ros", "/a/~")


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


def test_without_a_writable_folder_a_path_is_returned_nevertheless(homeless: Path, monkeypatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(homeless / "missing"))
    assert home.expanded("~/.ros").endswith("/.ros")


def test_a_user_without_a_name_is_not_the_user_of_a_machine(homeless: Path) -> None:
    assert not is_local(Machine("here", "localhost", user="somebody"))


# Log files: rotated if they are large, and ignored if they cannot be written.


needs_dev_full = pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full of Linux")


_UNTIL_THERE_IS_ROOM = """\
import resource, sys
from pipros.basics.log_file import LogFile

file = LogFile(sys.argv[1])
file.write("first\\n")
resource.setrlimit(resource.RLIMIT_FSIZE, (10, resource.RLIM_INFINITY))  # as on a disk that becomes full
for number in range(5):
    file.write(f"lost {number}\\n")
resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
file.write("last\\n")
"""


def test_lines_are_appended_to_what_is_there(tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_text("before\n")
    file = LogFile(path)
    file.write("after \udcff é\n")
    file.close()
    file.write("too late\n")
    assert path.read_text("utf-8") == "before\nafter \\udcff é\n"


def test_a_large_file_is_put_aside_and_the_oldest_deleted(tmp_path: Path) -> None:
    file = LogFile(tmp_path / "x.log", Limits(log_bytes=20, log_files=3))
    for number in range(10):
        file.write(f"{number} 4567890\n")
    file.close()
    kept = {path.name: path.read_text().split() for path in tmp_path.iterdir()}
    assert {name: lines[::2] for name, lines in kept.items()} == {
        "x.log": ["8", "9"], "x.log.1": ["6", "7"], "x.log.2": ["4", "5"],
    }  # fmt: skip


def test_a_single_file_is_truncated(tmp_path: Path) -> None:
    file = LogFile(tmp_path / "x.log", Limits(log_bytes=10, log_files=1))
    for number in range(4):
        file.write(f"{number} 4567890\n")
    file.close()
    assert [path.read_text() for path in tmp_path.iterdir()] == ["3 4567890\n"]


def test_threads_do_not_mix_their_lines(tmp_path: Path) -> None:
    file = LogFile(tmp_path / "x.log")
    with ThreadPoolExecutor(4) as threads:
        list(threads.map(lambda letter: [file.write(letter * 99 + "\n") for _ in range(50)], "abcd"))
    file.close()
    lines = (tmp_path / "x.log").read_text().split()
    assert sorted(lines) == sorted(letter * 99 for letter in "abcd" for _ in range(50))


@pytest.mark.skipif(sys.platform == "win32", reason="needs resource limits")
def test_a_full_disk_is_reported_once_and_lines_continue_when_there_is_room(tmp_path: Path) -> None:
    path = tmp_path / "x.log"

    ran = subprocess.run(
        [sys.executable, "-c", _UNTIL_THERE_IS_ROOM, path], capture_output=True, text=True, check=True
    )

    [warning] = ran.stderr.splitlines()
    assert warning.startswith(f"WARNING: cannot write to log file [{path}]: ")
    assert path.read_text().splitlines() == [
        "first",
        "lost",  # as many bytes as fit
        "WARNING: 5 log entries before this line were lost",
        "last",
    ]


def test_a_file_that_cannot_be_opened_is_reported_once_and_opened_later(tmp_path: Path, capsys) -> None:
    folder = tmp_path / "log"
    folder.write_text("a file where a folder is wanted")
    files = [LogFile(folder / "run" / name) for name in ("x.log", "y.log")]
    assert [file.write("lost\n") for file in files] == [False, False]
    assert capsys.readouterr().err.count("WARNING: cannot write to log file") == 1
    folder.unlink()
    assert files[0].write("last\n")
    written = (folder / "run" / "x.log").read_text().splitlines()
    assert written == ["WARNING: 1 log entries before this line were lost", "last"]


@needs_dev_full
def test_a_launcher_goes_on_when_its_log_cannot_be_written(tmp_path: Path, capsys) -> None:
    console = Console()
    (tmp_path / "x.log").symlink_to("/dev/full")
    console.open_log(tmp_path / "x.log")
    console.say("one")
    console.error("two")
    console.close()
    out, err = capsys.readouterr()
    assert out == "one\n"
    assert err.count("WARNING: cannot write to log file") == 1


def test_a_file_is_truncated_only_on_request(tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_text("before")
    os.close(open_to_write(path))
    assert path.read_text() == "before"
    os.close(open_to_write(path, append=False))
    assert path.read_text() == ""
