"""Outputs shared by tests are built once, and again when their inputs change."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

pytest.importorskip("fcntl", reason="locks files as POSIX systems do")

from tests.support.once import machine_folder, make_once


def test_concurrent_requests_compile_a_type_once(tmp_path: Path) -> None:
    folder, made = tmp_path / "shared" / "thing", []

    def make() -> None:
        made.append(1)
        (folder / "content").write_text("whole")

    def use(_: int) -> str:
        return (make_once(folder, make) / "content").read_text()

    with ThreadPoolExecutor(8) as pool:
        assert set(pool.map(use, range(8))) == {"whole"}
    assert made == [1]


def test_unfinished_outputs_are_built_again(tmp_path: Path) -> None:
    folder = tmp_path / "thing"

    def fail() -> None:
        (folder / "half").write_text("")
        raise RuntimeError("interrupted")

    with pytest.raises(RuntimeError):
        make_once(folder, fail)
    make_once(folder, (folder / "whole").touch)
    assert not (folder / "half").exists()
    assert (folder / "whole").exists()


def test_a_folder_of_the_machine_is_named_by_all_its_sources(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "source").mkdir()
    file = tmp_path / "source" / "a.py"
    names = []
    for content, mode in (("1", 0o644), ("2", 0o644), ("2", 0o755), ("1", 0o644)):
        file.write_text(content)
        file.chmod(mode)
        (file.parent / "a.pyc").write_bytes(os.urandom(4))
        names.append(machine_folder("thing", [file.parent]).name)
    assert len(set(names)) == 3
    assert names[0] == names[3]


def test_an_unused_folder_of_the_machine_is_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    old, new = (make_once(tmp_path / "pipros/tests" / name, lambda: None) for name in ("thing-1", "thing-2"))
    os.utime(old / ".made", (0, 0))
    machine_folder("thing", [])
    assert (old.exists(), new.exists()) == (False, True)
