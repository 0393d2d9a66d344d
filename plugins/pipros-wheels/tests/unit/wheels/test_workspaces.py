"""Workspaces of the shapes that public repositories have: the files of their wheels, and what is said."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import pytest

from pipros_wheels.wheel_build import WheelOptions, build_wheels, source_packages
from tests.support.wheel_workspace_table import WORKSPACES, write_workspace
from tests.support.workspaces import hide_setuptools


def build_workspace(folder: Path) -> tuple[dict[str, set[str]], list[str]]:
    """Return the files of each wheel by package, and what was said, with the package's name first."""
    space = source_packages([folder])
    build = build_wheels(space.packages, folder / "dist", WheelOptions(), lambda _line: None)
    files = {}
    for wheel in build.wheels:
        with zipfile.ZipFile(wheel.file) as archive:
            paths = [re.sub(r".*\.data/(?:data/)?", "", name) for name in archive.namelist()]
        files[wheel.package.name] = {
            re.sub(r"^scripts/", "bin/", path)
            for path in paths
            if ".dist-info/" not in path
            and not path.startswith("share/pipros/")
            and not path.endswith("/package.xml")
        }
    notes = [f"{wheel.package.name}: {note}" for wheel in build.wheels for note in wheel.notes]
    return files, [*space.errors, *build.errors, *build.left_out, *notes]


@pytest.mark.parametrize("name", WORKSPACES)
def test_the_wheels_of_a_workspace_have_exactly_these_files(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    packs = WORKSPACES[name]
    hide_setuptools(tmp_path, monkeypatch)
    write_workspace(packs, tmp_path / "ws" / "src")
    files, lines = build_workspace(tmp_path / "ws")
    expected = {path.rpartition("/")[2]: pack.expected for path, pack in packs.items()}
    assert files == {
        name: set(of_one.format(name).replace("@", f"share/{name}").split())
        for name, of_one in expected.items()
        if of_one is not None
    }
    for path, pack in packs.items():
        said = [line for line in lines if line.startswith(f"{path.rpartition('/')[2]}: ")]
        wanted = pack.said.split(" | ") if pack.said else []
        assert len(said) == len(wanted), said
        assert all(part in line for part, line in zip(wanted, said, strict=True)), said
