"""Files below a folder, and nothing else."""

import errno
import os
import shutil
import subprocess
import sys
import tempfile
import tracemalloc
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock

import pytest

import rosbag
from pipros.basics.files_below import NotBelow, file_inside, files_below
from pipros.basics.input_file import open_file, read_end, read_file
from pipros.basics.log_file import open_to_write
from pipros.basics.planted import UntrustedFile
from pipros.basics.posix import READ
from pipros.basics.replaced_file import cleared, overwritten_file, replaced_file, write_whole


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "secret.bag").write_text("secret")
    inside = tmp_path / "bags"
    (inside / "day").mkdir(parents=True)
    for name in ("b.bag", "a.bag", "notes.txt", "day/c.bag", ".hidden.bag"):
        (inside / name).write_text(name)
    (inside / "out.bag").symlink_to(tmp_path / "secret.bag")
    (inside / "up").symlink_to(tmp_path)
    (inside / "same.bag").symlink_to(inside / "a.bag")
    return inside


def test_files_are_listed_without_links_that_leave(folder: Path) -> None:
    assert list(files_below(folder, (".bag",))) == ["a.bag", "b.bag", "same.bag", "day/c.bag"]


def test_a_search_ends_at_the_limit(folder: Path) -> None:
    assert list(files_below(folder, (".bag", ".txt"), most=2)) == ["a.bag"]  # the other one is hidden


@pytest.mark.parametrize("name", ["a.bag", "day/c.bag", "./a.bag", "same.bag"])
def test_names_below_are_found(folder: Path, name: str) -> None:
    assert file_inside(folder, name).is_relative_to(folder)


@pytest.mark.parametrize("name", [
    "", ".", "day", "missing.bag", "../secret.bag", "day/../../secret.bag", "day/../a.bag", "out.bag",
    "up/secret.bag", "/etc/passwd", "a\0.bag", "..\\secret.bag", "package://a/../..", "$(find a)/..",
    "file:///etc/passwd", "~/secret.bag", "l" * 300, "\ud800.bag",
])  # fmt: skip
def test_all_other_names_are_refused(folder: Path, name: str) -> None:
    with pytest.raises(NotBelow):
        file_inside(folder, name)


def test_an_absolute_name_below_is_refused_too(folder: Path) -> None:
    with pytest.raises(NotBelow, match="relative"):
        file_inside(folder, str(folder / "a.bag"))


# Input file


def test_a_small_file_takes_little_memory(tmp_path: Path) -> None:
    file = tmp_path / "small"
    file.write_bytes(b"few")
    tracemalloc.start()
    try:
        assert read_file(file, 64 * 1024 * 1024) == b"few"
        assert tracemalloc.get_traced_memory()[1] < 1024 * 1024
    finally:
        tracemalloc.stop()


def test_a_file_without_a_size_is_read_up_to_the_limit(tmp_path: Path, monkeypatch) -> None:
    file = tmp_path / "as in proc"
    file.write_bytes(b"content")
    status: Any = list(os.stat(file))
    status[6] = 0
    monkeypatch.setattr("pipros.basics.input_file.os.fstat", lambda _: os.stat_result(status))
    assert read_file(file, 7) == b"content"
    with pytest.raises(OSError, match="larger than 6 bytes"):
        read_file(file, 6)
    opened = MagicMock()
    opened.__enter__.return_value.read.return_value = None  # as /proc/kmsg without news
    monkeypatch.setattr("pipros.basics.input_file.open_file", lambda _: opened)
    assert (read_file(file, 6), read_end(file, 6)) == (b"", "")


def test_an_open_file_has_its_name(tmp_path: Path) -> None:
    (file := tmp_path / "run.bag").write_bytes(b"")
    with open_file(file) as opened:
        assert opened.name == str(file)


@pytest.mark.parametrize("read", [open_file, read_file, lambda path: read_end(path, 9)])
def test_folders_pipes_and_odd_names_are_refused_and_no_descriptor_stays_open(
    tmp_path: Path, read: Callable[[Path], object]
) -> None:
    refused = {tmp_path: "Is a directory", tmp_path / "a\0b": "no file can have this name"}
    if READ & getattr(os, "O_NONBLOCK", 0):  # Windows has no pipes with names
        os.mkfifo(pipe := tmp_path / "pipe")
        refused |= {pipe: "it is not a regular file", Path("\ud800"): "no file can have this name"}
    os.close(before := os.open(os.devnull, os.O_RDONLY))
    for path, error in refused.items():
        with pytest.raises(OSError, match=error):
            read(path)
    os.close(after := os.open(os.devnull, os.O_RDONLY))
    assert after == before


# A file that a user names is overwritten as a whole or not at all, and stays what it was otherwise.


UNIX = pytest.mark.skipif(sys.platform == "win32", reason="Unix permissions and links")


@pytest.mark.parametrize("place", ["/dev/shm", "."])  # noqa: S108  # it has files, beside devices
def test_what_fails_leaves_the_old_file_and_is_named(tmp_path: Path, place: str) -> None:
    if place != "." and Path(place).is_dir():
        tmp_path = Path(tempfile.mkdtemp(dir=place))
    path = tmp_path / "params.yaml"
    path.write_text("old")

    def fail() -> None:
        with overwritten_file(path) as file:
            file.write(b"half")
            file.flush()
            raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(OSError, match=r"No space left .*params\.yaml'$"):
        fail()

    assert (path.read_text(), list(tmp_path.iterdir())) == ("old", [path])
    shutil.rmtree(tmp_path)


def test_of_two_files_the_failed_one_is_named(tmp_path: Path) -> None:
    with (
        pytest.raises(FileNotFoundError, match=r"nowhere.map\.pgm'$"),
        overwritten_file(tmp_path / "map.yaml"),
        overwritten_file(tmp_path / "nowhere" / "map.pgm"),
    ):
        pass
    assert not list(tmp_path.iterdir())


@UNIX
def test_links_and_permissions_are_kept(tmp_path: Path) -> None:
    path, link = tmp_path / "params.yaml", tmp_path / "link.yaml"
    path.write_text("old")
    path.chmod(0o600)
    link.symlink_to(path)

    with overwritten_file(link) as file:
        file.write(b"new")

    assert link.is_symlink()
    assert (path.read_text(), path.stat().st_mode & 0o777) == ("new", 0o600)


WRITERS = [overwritten_file, replaced_file, cleared, open_to_write, partial(rosbag.Bag, mode="w")]


@pytest.mark.needs("file owners")
@UNIX
@pytest.mark.parametrize("name", ["link.yaml", "pipe.yaml", "folder/new.yaml", "folder/..", "mine/new.yaml"])
def test_links_and_pipes_of_other_users_in_shared_folders_are_refused(
    tmp_path: Path, monkeypatch, name: str
) -> None:
    (shared := tmp_path / "shared").mkdir()
    (secret := tmp_path / "secret").mkdir()
    (secret / "old").write_text("old")
    (shared / "link.yaml").symlink_to(secret / "old")
    (shared / "folder").symlink_to("../secret")
    os.mkfifo(shared / "pipe.yaml")
    (tmp_path / "mine").symlink_to(shared / "folder")
    path = (tmp_path if name.startswith("mine") else shared) / name
    real = os.lstat
    with monkeypatch.context() as patched:
        patched.setattr(os, "lstat", lambda *path, **given: _with_owner(real(*path, **given), 4321))
        shared.chmod(0o1777)
        writers: list[Any] = [overwritten_file] if path.parent == shared else WRITERS
        for write in writers:
            with (
                pytest.raises(UntrustedFile, match=r"is a .* of another user \(4321\)") as refused,
                write(path),
            ):
                pass
            assert refused.value.filename in (str(path), str(path.parent))
        shared.chmod(0o755)
        if path.name == "new.yaml":
            write_whole(path, b"new")
            assert path.read_bytes() == b"new"
    assert (secret / "old").read_text() == "old"


def _with_owner(status: os.stat_result, owner: int) -> os.stat_result:
    return os.stat_result([*status[:4], owner, *status[5:]])


@UNIX
def test_what_is_not_a_file_is_written_directly(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        with overwritten_file(pipe) as file:
            file.write(b"new")
        assert os.read(reader, 10) == b"new"
    finally:
        os.close(reader)
    assert pipe.is_fifo()
    with pytest.raises(IsADirectoryError), overwritten_file(tmp_path):
        pass


@UNIX
def test_standard_output_is_written_directly(tmp_path: Path) -> None:
    link, output = tmp_path / "link", tmp_path / "output"
    link.symlink_to("/dev/stdout")
    code = "import sys\nfrom pathlib import Path\nfrom pipros.basics.replaced_file import overwritten_file\n"
    code += "with overwritten_file(Path(sys.argv[1])) as file:\n    file.write(b'new')"
    for path in ("/dev/stdout", str(link)):
        done = subprocess.run([sys.executable, "-c", code, path], capture_output=True, check=True)
        assert done.stdout == b"new"
    with output.open("wb") as file:
        subprocess.run([sys.executable, "-c", code, "/dev/stdout"], stdout=file, check=True)
        assert os.path.samestat(os.fstat(file.fileno()), output.stat())
    assert output.read_bytes() == b"new"
