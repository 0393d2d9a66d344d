"""Log files in a folder where other users can write: planted files are not written to."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest

from pipros.basics.env import Environment
from pipros.basics.log_file import open_to_write
from pipros.node.log import open_file_handler
from pipros_tools.launch.logs import LogFolder, LogFolderUnusable
from tests.support.ros import RosSystem
from tests.support.users import give_away, needs_other_users
from tests.support.waiting import wait_until


@pytest.fixture
def victim(tmp_path: Path) -> Path:
    file = tmp_path / "file of mine"
    file.write_text("precious")
    return file


def link_of_another_user(path: Path, victim: Path) -> None:
    path.symlink_to(victim)
    give_away(path)


def link_to_a_link_of_another_user(path: Path, victim: Path) -> None:
    link_of_another_user(path.with_name("between"), victim)
    path.symlink_to("between")


def hard_link(path: Path, victim: Path) -> None:
    path.hardlink_to(victim)


def pipe(path: Path, victim: Path) -> None:
    del victim
    os.mkfifo(path)


@needs_other_users
@pytest.mark.parametrize(
    "plant",
    [link_of_another_user, link_to_a_link_of_another_user, hard_link, pipe],
    ids=lambda plant: plant.__name__,
)
@pytest.mark.parametrize("append", [True, False])
def test_files_that_another_user_could_have_planted_are_not_written_to(
    tmp_path: Path, victim: Path, plant: Callable[[Path, Path], None], append: bool
) -> None:
    plant(tmp_path / "x.log", victim)

    with pytest.raises(OSError, match=r"link that belongs to another user|hard link|No such device"):
        os.close(open_to_write(tmp_path / "x.log", append=append))

    assert victim.read_text() == "precious"


@needs_other_users
@pytest.mark.skipif(sys.platform != "linux", reason="needs descriptors of links")
def test_a_link_exchanged_after_it_was_checked_is_not_followed(
    tmp_path: Path, victim: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, allowed = tmp_path / "x.log", tmp_path / "of-mine.log"
    path.symlink_to(allowed)
    link_of_another_user(tmp_path / "evil", victim)

    def exchange_before(call: Callable[..., str]) -> Callable[..., str]:
        def exchanged(*args: object, **options: object) -> str:
            with suppress(FileNotFoundError):
                (tmp_path / "evil").replace(path)
            return call(*args, **options)

        return exchanged

    monkeypatch.setattr("os.readlink", exchange_before(os.readlink))
    os.close(open_to_write(path, append=False))

    assert victim.read_text() == "precious"
    assert allowed.exists()


@needs_other_users
def test_the_log_of_a_node_does_not_follow_the_link_of_another_user(
    tmp_path: Path, victim: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    link_of_another_user(tmp_path / "talker.log", victim)

    open_file_handler(tmp_path / "talker.log").emit(logging.makeLogRecord({"msg": "a line"}))

    assert "a link that belongs to another user" in capsys.readouterr().err
    assert victim.read_text() == "precious"


@needs_other_users
def test_the_folder_of_a_run_is_not_a_link_of_another_user(tmp_path: Path) -> None:
    (tmp_path / "documents").mkdir()
    link_of_another_user(tmp_path / "the-run", tmp_path / "documents")

    with pytest.raises(LogFolderUnusable, match="a link that belongs to another user"):
        LogFolder.of_run(Environment(log_dir=tmp_path), "the-run")


def test_links_of_the_user_are_followed(tmp_path: Path, victim: Path) -> None:
    (tmp_path / "x.log").symlink_to("between")
    (tmp_path / "between").symlink_to(victim)

    with open(open_to_write(tmp_path / "x.log"), "w") as file:
        file.write(" indeed")

    assert victim.read_text() == "precious indeed"


def test_a_link_to_itself_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "x.log").symlink_to("x.log")

    with pytest.raises(OSError, match="symbolic links"):
        open_to_write(tmp_path / "x.log")


@pytest.mark.skipif(not os.path.exists("/dev/stderr"), reason="needs /dev/stderr")
@pytest.mark.parametrize("device", ["/dev/null", "/dev/stderr"])
def test_devices_may_be_log_files(device: str) -> None:
    code = f"from pipros.basics.log_file import LogFile; LogFile({device!r}).write('a line\\n')"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    assert ran.stderr == ("a line\n" if device == "/dev/stderr" else "")


@needs_other_users
def test_the_pid_file_of_a_core_replaces_a_planted_link(ros: RosSystem, victim: Path) -> None:
    home = Path(ros.pipros.environment["ROS_HOME"])
    home.mkdir()
    link_of_another_user(home / f"roscore-{ros.port}.pid", victim)

    core = ros.pipros.start_master()

    def written() -> str:
        with suppress(FileNotFoundError):  # between the end of the link and the new file
            return (home / f"roscore-{ros.port}.pid").read_text()
        return ""

    assert wait_until(lambda: written() == str(core.pid))
    assert victim.read_text() == "precious"


_NODE = """\
import rospy
rospy.init_node("chatty")
for number in range(20):
    rospy.loginfo("line %d", number)
print("done", flush=True)
"""


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full of Linux")
def test_a_node_on_a_full_disk_warns_once_and_continues(ros: RosSystem) -> None:
    ros.pipros.start_master()
    (ros.home / "chatty.py").write_text(_NODE)

    ran = ros.pipros.run("python", ros.home / "chatty.py", "__log:=/dev/full")

    assert ran.returncode == 0
    assert "done" in ran.stdout
    assert "Logging error" not in ran.output
    assert ran.output.count("WARNING: cannot write to log file [/dev/full]: No space left on device") == 1
