"""Packages in folders, their nodelets and their assets."""

import os
from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros.basics.input_file import read_file
from pipros.packages.assets import AssetRefused, read_asset
from pipros.packages.crawl import DRY, META, WET, Crawl, CrawledPackage, crawl, dump, load
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


@pytest.mark.parametrize("uri", [
    "package://my_robot/../../outside.stl", "package://my_robot/meshes/../../../outside.stl",
    "package://my_robot/%2e%2e/%2e%2e/outside.stl", "package://my_robot/..%2f..%2foutside.stl",
    "package://my_robot/out.stl", "package://my_robot/up/outside.stl", "package://my_robot/key.stl",
    "package://my_robot/secret.key", "package://my_robot/package.xml", "package://my_robot/meshes/.a.stl",
    "package://my_robot/meshes/.hidden/a.stl", "package://my_robot/meshes/", "package://my_robot/",
    "package://my_robot", "package://", "package://other/meshes/a.stl", "package://../my_robot/inside.stl",
    "package://my_robot//etc/a.stl", "package://my_robot/a\0.stl", "package://my_robot/loop.stl",
    pytest.param("package://my_robot/pipe.stl", marks=pytest.mark.needs("named pipes")),
    "package://my_robot/" + "a/" * 5000 + "a.stl", "file:///etc/passwd", "http://localhost/a.stl",
    "/etc/passwd", "",
])  # fmt: skip
def test_everything_else_is_refused(package: Path, uri: str) -> None:
    with pytest.raises(AssetRefused):
        read(package, uri)


def test_a_file_that_is_too_large_is_refused(package: Path) -> None:
    with pytest.raises(AssetRefused, match="larger than 2 bytes"):
        read(package, "package://my_robot/inside.stl", 2)


# The results of a crawl and their cache. `tests.unit.workspace.test_index` tests their use.


OLD = 1_000_000_000


def write(root: Path, *files: str) -> Path:
    """Files with the given contents (`path=content`), all old enough for their times to be trusted."""
    for file in files:
        path, _, content = file.partition("=")
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).write_text(content)
    for path in (root, *root.rglob("*")):
        os.utime(path, (OLD, OLD))
    return root


def found(root: Path) -> list[tuple[str, str, str]]:
    """Name, folder below the root, and kind of each package."""
    packages = crawl(str(root)).packages
    return [(package.name, os.path.relpath(package.path, root), package.kind) for package in packages]


@pytest.mark.parametrize(("files", "packages"), [
    (["a/package.xml=<name>x</name>"], [("x", "a", WET)]),
    (["package.xml=<name>x</name>", "a/package.xml=<name>y</name>"], [("x", ".", WET)]),
    (["b/package.xml=", "a/package.xml="], [("a", "a", WET), ("b", "b", WET)]),
    (["a/b/c/d/package.xml=<name>x</name>"], [("x", "a/b/c/d", WET)]),
    (["a/manifest.xml="], [("a", "a", DRY)]),
    (["a/manifest.xml=", "a/b/manifest.xml=", "a/c/package.xml="], [("a", "a", DRY)]),
    (["a/manifest.xml=", "a/package.xml=<name>x</name>"], [("x", "a", WET)]),
    (["a/package.xml=<name>x</name><export><metapackage/></export>"], [("x", "a", META)]),
    (["a/package.xml=<name>x</name><!-- <metapackage/> -->"], [("x", "a", WET)]),
    (["a/package.xml=", "a/CATKIN_IGNORE="], []), (["a/manifest.xml=", "a/AMENT_IGNORE="], []),
    (["a/COLCON_IGNORE=", "a/b/package.xml="], []), (["a/rospack_nosubdirs=", "a/b/package.xml="], []),
    (["a/package.xml=", "a/rospack_nosubdirs="], [("a", "a", WET)]), ([".hidden/a/package.xml="], []),
    (["a/package.xml/inside="], []), (["a/readme="], []),
])  # fmt: skip
def test_a_tree_has_these_packages(tmp_path, files: list[str], packages: list[tuple[str, str, str]]) -> None:
    assert found(write(tmp_path / "root", *files)) == packages


def test_a_folder_that_does_not_exist_has_no_packages(tmp_path: Path) -> None:
    assert crawl(str(tmp_path / "nowhere")).packages == ()


@pytest.mark.needs("named pipes")
@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes on this system")
def test_a_manifest_that_is_a_pipe_does_not_block(tmp_path: Path) -> None:
    for name in ("package.xml", "manifest.xml"):
        (tmp_path / name.partition(".")[0]).mkdir()
        os.mkfifo(tmp_path / name.partition(".")[0] / name)
    assert crawl(str(tmp_path)).packages == ()


@pytest.mark.parametrize(("change", "is_current"), [
    ("nothing", True), ("a file is edited", True), ("a manifest is edited", False),
    ("a package is added", False), ("a package is removed", False), ("a folder is marked", False),
])  # fmt: skip
def test_a_crawl_detects_that_it_is_outdated(tmp_path: Path, change: str, is_current: bool) -> None:
    root = write(
        tmp_path / "root", "a/package.xml=<name>a</name>", "a/x.txt=1", "group/b/package.xml=<name>b</name>"
    )
    seen = crawl(str(root))
    if change == "a file is edited":
        (root / "a" / "x.txt").write_text("2")
    elif change == "a manifest is edited":
        (root / "a" / "package.xml").write_text("<name>c</name>")
    elif change == "a package is added":
        (root / "c").mkdir()
    elif change == "a package is removed":
        (root / "a" / "package.xml").unlink()
    elif change == "a folder is marked":
        (root / "group" / "CATKIN_IGNORE").touch()
    assert seen.is_current() is is_current


TEXT = st.text(st.characters(blacklist_categories=("Cs",)), min_size=1)


@given(
    root=st.text("/ab c", min_size=1),
    folders=st.lists(st.tuples(TEXT, st.integers(0, 10**19))),
    packages=st.lists(st.tuples(TEXT, TEXT, st.integers(0, 10**19), st.sampled_from([WET, META, DRY]))),
)
def test_a_crawl_is_read_back_as_it_was_or_not_written(
    root: str, folders: list[tuple[str, int]], packages: list[tuple[str, str, int, str]]
) -> None:
    crawled = Crawl(root, tuple(folders), tuple(CrawledPackage(*package) for package in packages))
    text = dump(crawled)
    if text is None:
        return
    again = load(text, root)
    assert again.folders == crawled.folders
    assert [(p.name, p.path, p.manifest_ns, p.kind) for p in again.packages] == packages


@given(st.text())
def test_a_damaged_cache_is_refused(text: str) -> None:
    loaded = load(text, "/root")
    assert loaded is None or loaded.root == "/root"


@pytest.mark.parametrize(
    "text", ["", "x\n", "1\n/root\n", "0\n/elsewhere\n", "0\n/root\n5\t/p\tname\n", "1\n/root\nx\t/folder\n"]
)
def test_these_caches_are_refused(text: str) -> None:
    loaded = load(text, "/root")
    assert loaded is None or not loaded.packages
