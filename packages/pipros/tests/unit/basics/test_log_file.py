"""Log files: rotated if they are large, and ignored if they cannot be written."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from pipros.basics.limits import Limits
from pipros.basics.log_file import LogFile, open_to_write
from pipros_tools.launch.console import Console

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
        "x.log": ["8", "9"],
        "x.log.1": ["6", "7"],
        "x.log.2": ["4", "5"],
    }


def test_a_single_file_is_truncated(tmp_path: Path) -> None:
    file = LogFile(tmp_path / "x.log", Limits(log_bytes=10, log_files=1))
    for number in range(4):
        file.write(f"{number} 4567890\n")
    file.close()
    assert [path.read_text() for path in tmp_path.iterdir()] == ["3 4567890\n"]


def test_threads_do_not_mix_their_lines(tmp_path: Path) -> None:
    file = LogFile(tmp_path / "x.log")
    threads = [
        threading.Thread(target=lambda letter=letter: [file.write(letter * 99 + "\n") for _ in range(50)])
        for letter in "abcd"
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
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


def test_a_file_that_cannot_be_opened_is_reported_once_and_opened_later(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
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
def test_a_launcher_goes_on_when_its_log_cannot_be_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
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
