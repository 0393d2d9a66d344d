from __future__ import annotations

import os
import tracemalloc
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.input_file import read_file


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
