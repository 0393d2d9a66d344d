"""Files below a folder, and nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipros.basics.files_below import NotBelow, file_inside, files_below


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


@pytest.mark.parametrize(
    "name",
    [
        "",
        ".",
        "day",
        "missing.bag",
        "../secret.bag",
        "day/../../secret.bag",
        "day/../a.bag",
        "out.bag",
        "up/secret.bag",
        "/etc/passwd",
        "a\0.bag",
        "..\\secret.bag",
        "package://a/../..",
        "$(find a)/..",
        "file:///etc/passwd",
        "~/secret.bag",
    ],
)
def test_all_other_names_are_refused(folder: Path, name: str) -> None:
    with pytest.raises(NotBelow):
        file_inside(folder, name)


def test_an_absolute_name_below_is_refused_too(folder: Path) -> None:
    with pytest.raises(NotBelow, match="relative"):
        file_inside(folder, str(folder / "a.bag"))
