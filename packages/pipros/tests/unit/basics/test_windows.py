"""Windows's ways, on any system."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from pipros.basics.windows import file_url, path_of_url, replace_file, with_slashes
from pipros.basics.windows_job import Job


def test_only_paths_of_windows_get_slashes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipros.basics.windows.ON_WINDOWS", False)
    assert with_slashes(r"/a\b") == r"/a\b"
    monkeypatch.setattr("pipros.basics.windows.ON_WINDOWS", True)
    assert with_slashes(r"C:\ws\src") == "C:/ws/src"


@pytest.mark.parametrize(
    ("is_windows", "path", "url", "named"),
    [(True, "C:\\my ws", "file:///C:/my ws", "C:/my ws"), (False, "/a\\b", "file:///a\\b", "/a\\b")],
)
def test_a_url_names_a_file(
    monkeypatch: pytest.MonkeyPatch, is_windows: bool, path: str, url: str, named: str
) -> None:
    monkeypatch.setattr("pipros.basics.windows.ON_WINDOWS", is_windows)
    assert file_url(path) == url
    assert path_of_url(url) == named


def test_a_file_is_replaced_once_other_programs_have_closed_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "new").write_text("new")
    rename = os.replace
    refusals = 3

    def refuse_first(source: Path, target: Path) -> None:
        nonlocal refusals
        if refusals:
            refusals -= 1
            raise PermissionError(13, "in use")
        rename(source, target)

    slept: list[float] = []
    monkeypatch.setattr("pipros.basics.windows.ON_WINDOWS", True)
    monkeypatch.setattr(os, "replace", refuse_first)
    replace_file(tmp_path / "new", tmp_path / "old", slept.append)
    assert (tmp_path / "old").read_text() == "new"
    assert len(slept) == 3


def test_a_file_that_stays_open_is_reported_after_two_seconds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(13, "in use")

    slept: list[float] = []
    monkeypatch.setattr("pipros.basics.windows.ON_WINDOWS", True)
    monkeypatch.setattr(os, "replace", refuse)
    with pytest.raises(PermissionError, match="in use"):
        replace_file(tmp_path / "new", tmp_path / "old", slept.append)
    assert sum(slept) == pytest.approx(2)


def test_a_job_of_no_process_is_refused() -> None:
    with pytest.raises(OSError, match=r"."):
        Job(0)
