"""Workspaces of the shapes that public repositories have: the files of their wheels, and what is said."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import pytest

from pipros_wheels.wheel_build import WheelOptions, build_wheels, source_packages
from tests.support.wheel_workspace_table import WORKSPACES, Pack
from tests.support.workspaces import MANIFEST, hide_setuptools

_CONTENTS = {
    ".msg": "int8 a\n",
    ".srv": "---\nbool ok\n",
    ".action": "---\n---\nint8 a\n",
    ".launch": "<launch/>\n",
}


def write_workspace(packs: dict[str, Pack], folder: Path) -> None:
    """Write the packages of a workspace below `folder/src`."""
    for path, pack in packs.items():
        root, name = folder / "src" / path, path.rpartition("/")[2]
        needed = "".join(f"  <depend>{item}</depend>\n" for item in pack.depends.split())
        texts = {"package.xml": MANIFEST.format(name=name, more=needed + pack.more)}
        if pack.cmake is not None:
            texts["CMakeLists.txt"] = f"cmake_minimum_required(VERSION 3.0.2)\nproject({name})\n{pack.cmake}"
        texts |= {file: _CONTENTS.get(Path(file).suffix, "") for file in pack.files.split()} | pack.texts
        for file, text in texts.items():
            (root / file).parent.mkdir(parents=True, exist_ok=True)
            (root / file).write_text(text)
        for file, target in pack.links.items():
            (root / file).symlink_to(target)


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
    write_workspace(packs, tmp_path / "ws")
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
