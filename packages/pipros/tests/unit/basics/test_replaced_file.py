"""A file that a user names is overwritten as a whole or not at all, and stays what it was otherwise."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from pipros.basics.replaced_file import overwritten_file

UNIX = pytest.mark.skipif(sys.platform == "win32", reason="Unix permissions and links")


def test_what_fails_leaves_the_old_file_and_is_named(tmp_path: Path) -> None:
    path = tmp_path / "params.yaml"
    path.write_text("old")

    def fail() -> None:
        with overwritten_file(path) as file:
            file.write(b"half")
            file.flush()
            raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(OSError, match=r"No space left .*params\.yaml'$"):
        fail()

    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


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
    assert path.read_text() == "new"
    assert path.stat().st_mode & 0o777 == 0o600


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
