"""Nodelets and assets of packages."""

import os
from collections.abc import Sequence
from pathlib import Path

import pytest

from pipros.basics.input_file import read_file
from pipros.packages.assets import AssetRefused, read_asset
from pipros.packages.nodelets import package_of, python_nodelet, shipped_nodelets
from pipros_libraries.nodelets.hosting import CannotLoad, class_of


@pytest.mark.parametrize("plugin", shipped_nodelets())
def test_every_nodelet_can_be_imported(plugin: str) -> None:
    assert callable(class_of(plugin))


def test_nodelets_that_cannot_be_imported_are_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    assert python_nodelet("my_package/Nothing") is None
    wrong = {"a/A": "pipros_libraries.nodelets.nothing:A", "a/B": "pipros_libraries.nodelets.hosting:Nothing"}
    monkeypatch.setattr("pipros.packages.nodelets.shipped_nodelets", lambda: wrong)
    for plugin in ("a/A", "a/B"):
        with pytest.raises(CannotLoad, match=f"of {plugin} cannot be imported"):
            class_of(plugin)


def test_prefixes_name_packages() -> None:
    assert [package_of(each) for each in ("pcl/VoxelGrid", "image_proc/rectify")] == ["pcl_ros", "image_proc"]


# Assets: only files of packages that describe a robot, whatever the path.


@pytest.fixture
def package(tmp_path: Path) -> Path:
    folder = tmp_path / "ws" / "my_robot"
    (folder / "meshes" / ".hidden").mkdir(parents=True)
    (folder / "meshes" / "arm 1.STL").write_bytes(b"arm")
    (folder / "meshes" / ".hidden" / "a.stl").write_bytes(b"hidden")
    (folder / "meshes" / ".a.stl").write_bytes(b"hidden")
    (folder / "package.xml").write_bytes(b"<package/>")
    (folder / "secret.key").write_bytes(b"secret")
    (tmp_path / "outside.stl").write_bytes(b"outside")
    (folder / "out.stl").symlink_to(tmp_path / "outside.stl")
    (folder / "key.stl").symlink_to(folder / "secret.key")
    (folder / "inside.stl").symlink_to(folder / "meshes" / "arm 1.STL")
    (folder / "up").symlink_to(tmp_path)
    (folder / "loop.stl").symlink_to(folder / "loop.stl")
    if hasattr(os, "mkfifo"):
        os.mkfifo(folder / "pipe.stl")
    return folder


def read(package: Path, uri: str, limit_bytes: int = 1000) -> bytes:
    def folders_of(name: str) -> Sequence[Path]:
        return [package] if name == "my_robot" else []

    return read_asset(uri, folders_of, limit_bytes, read_file)


@pytest.mark.parametrize("path", ["meshes/arm 1.STL", "meshes/arm%201.STL", "inside.stl"])
def test_files_of_a_package_are_read(package: Path, path: str) -> None:
    assert read(package, f"package://my_robot/{path}") == b"arm"


@pytest.mark.parametrize(
    "uri",
    [
        "package://my_robot/../../outside.stl",
        "package://my_robot/meshes/../../../outside.stl",
        "package://my_robot/%2e%2e/%2e%2e/outside.stl",
        "package://my_robot/..%2f..%2foutside.stl",
        "package://my_robot/out.stl",
        "package://my_robot/up/outside.stl",
        "package://my_robot/key.stl",
        "package://my_robot/secret.key",
        "package://my_robot/package.xml",
        "package://my_robot/meshes/.a.stl",
        "package://my_robot/meshes/.hidden/a.stl",
        "package://my_robot/meshes/",
        "package://my_robot/",
        "package://my_robot",
        "package://",
        "package://other/meshes/a.stl",
        "package://../my_robot/inside.stl",
        "package://my_robot//etc/a.stl",
        "package://my_robot/a\0.stl",
        "package://my_robot/loop.stl",
        pytest.param("package://my_robot/pipe.stl", marks=pytest.mark.needs("named pipes")),
        "package://my_robot/" + "a/" * 5000 + "a.stl",
        "file:///etc/passwd",
        "http://localhost/a.stl",
        "/etc/passwd",
        "",
    ],
)
def test_everything_else_is_refused(package: Path, uri: str) -> None:
    with pytest.raises(AssetRefused):
        read(package, uri)


def test_a_file_that_is_too_large_is_refused(package: Path) -> None:
    with pytest.raises(AssetRefused, match="larger than 2 bytes"):
        read(package, "package://my_robot/inside.stl", 2)
