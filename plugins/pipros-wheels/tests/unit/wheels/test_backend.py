"""The hooks that pip and uv call, in the package's folder."""

from __future__ import annotations

import tarfile
import zipfile
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.errors import PiprosError
from pipros_wheels import backend
from pipros_wheels.init_file import BUILD_SYSTEM, write_build_system
from tests.support.workspaces import Workspace

CMAKE = "catkin_package()\ninstall(DIRECTORY launch DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})"


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    workspace = Workspace(tmp_path / "ws")
    workspace.add("hand")
    folder = workspace.add(
        "arm", CMAKE, "hand rospy", launch__run_dot_launch="<launch/>", _dot_git__config=""
    )
    monkeypatch.chdir(folder)
    return folder


def metadata(file: Path) -> str:
    with zipfile.ZipFile(file) as archive:
        (path,) = [name for name in archive.namelist() if name.endswith("METADATA")]
        return archive.read(path).decode()


def test_the_metadata_is_that_of_the_wheel(package: Path, tmp_path: Path) -> None:
    assert backend.get_requires_for_build_wheel() == []
    name = backend.build_wheel(str(tmp_path))
    assert name == "ros1_arm-0.1.0-py3-none-any.whl"
    info = backend.prepare_metadata_for_build_wheel(str(tmp_path))
    assert info == "ros1_arm-0.1.0.dist-info"
    assert (tmp_path / info / "METADATA").read_text() == metadata(tmp_path / name)
    assert "Requires-Dist: ros1-hand\n" in metadata(tmp_path / name)


def test_nothing_is_written_to_the_source(package: Path, tmp_path: Path) -> None:
    before = sorted(package.rglob("*"))
    backend.build_wheel(str(tmp_path))
    backend.build_sdist(str(tmp_path))
    assert sorted(package.rglob("*")) == before


def test_a_source_archive_makes_the_same_wheel(
    package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_build_system(package)
    archive = tmp_path / backend.build_sdist(str(tmp_path))
    first = archive.read_bytes()
    backend.build_sdist(str(tmp_path))
    assert archive.read_bytes() == first
    wheel = (tmp_path / backend.build_wheel(str(tmp_path))).read_bytes()
    with tarfile.open(archive) as opened:
        assert not any(".git" in name for name in opened.getnames())
        # Python 3.10 and 3.11 have filters only in later releases
        options: dict[str, Any] = {"filter": "data"} if hasattr(tarfile, "data_filter") else {}
        opened.extractall(tmp_path / "unpacked", **options)  # noqa: S202 - made by this test
    monkeypatch.chdir(tmp_path / "unpacked" / "ros1_arm-0.1.0")
    other = tmp_path / "other"
    other.mkdir()
    assert (other / backend.build_wheel(str(other))).read_bytes() == wheel


def test_an_editable_wheel_points_to_the_folder(package: Path, tmp_path: Path) -> None:
    info = backend.prepare_metadata_for_build_editable(str(tmp_path))
    file = tmp_path / backend.build_editable(str(tmp_path))
    assert (tmp_path / info / "METADATA").read_text() == metadata(file)
    with zipfile.ZipFile(file) as archive:
        assert archive.read(archive.namelist()[0]).decode() == f"{package}\n"


def test_settings_are_the_options_of_the_command(package: Path, tmp_path: Path) -> None:
    (package / "extra.txt").touch()
    name = backend.build_wheel(str(tmp_path), {"whole": "true"})
    with zipfile.ZipFile(tmp_path / name) as archive:
        assert any(path.endswith("share/arm/extra.txt") for path in archive.namelist())
    (package / "CMakeLists.txt").write_text("project(arm)\nadd_executable(a a.cpp)\n")
    with pytest.raises(PiprosError, match="compiles a "):
        backend.build_wheel(str(tmp_path), {"strict": "true"})
    with pytest.raises(PiprosError, match=r"the setting strict must be true or false, got \[maybe\]"):
        backend.build_wheel(str(tmp_path), {"strict": "maybe"})


def test_a_folder_without_a_package_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(PiprosError, match=r"has no package\.xml"):
        backend.build_wheel(str(tmp_path))
    with pytest.raises(PiprosError, match=r"has no package\.xml"):
        write_build_system(tmp_path)


def test_the_build_system_is_added_once(package: Path) -> None:
    file = package / "pyproject.toml"
    file.write_text("[tool.black]\n")
    write_build_system(package)
    write_build_system(package)
    assert file.read_text() == f"{BUILD_SYSTEM}\n[tool.black]\n"
    file.write_text("[build-system]\nrequires = []\n")
    with pytest.raises(PiprosError, match="already has a \\[build-system\\]"):
        write_build_system(package)
