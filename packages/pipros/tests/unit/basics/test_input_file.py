from __future__ import annotations

import os
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.input_file import open_file, read_end, read_file
from pipros.basics.posix import READ


def test_a_small_file_takes_little_memory(tmp_path: Path) -> None:
    file = tmp_path / "small"
    file.write_bytes(b"few")
    tracemalloc.start()
    try:
        assert read_file(file, 64 * 1024 * 1024) == b"few"
        assert tracemalloc.get_traced_memory()[1] < 1024 * 1024
    finally:
        tracemalloc.stop()


def test_a_file_without_a_size_is_read_up_to_the_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "as in proc"
    file.write_bytes(b"content")
    status: Any = list(os.stat(file))
    status[6] = 0
    monkeypatch.setattr("pipros.basics.input_file.os.fstat", lambda _: os.stat_result(status))
    assert read_file(file, 7) == b"content"
    with pytest.raises(OSError, match="larger than 6 bytes"):
        read_file(file, 6)


def test_an_open_file_has_its_name(tmp_path: Path) -> None:
    (file := tmp_path / "run.bag").write_bytes(b"")
    with open_file(file) as opened:
        assert opened.name == str(file)


@pytest.mark.parametrize("read", [open_file, read_file, lambda path: read_end(path, 9)])
def test_folders_and_pipes_are_refused_at_once_and_no_descriptor_stays_open(
    tmp_path: Path, read: Callable[[Path], object]
) -> None:
    refused = {tmp_path: "Is a directory"}
    if READ & getattr(os, "O_NONBLOCK", 0):  # Windows has no pipes with names
        os.mkfifo(pipe := tmp_path / "pipe")
        refused[pipe] = "it is not a regular file"
    os.close(before := os.open(os.devnull, os.O_RDONLY))
    for path, error in refused.items():
        with pytest.raises(OSError, match=error):
            read(path)
    os.close(after := os.open(os.devnull, os.O_RDONLY))
    assert after == before
