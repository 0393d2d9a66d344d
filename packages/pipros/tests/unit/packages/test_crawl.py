"""The results of a crawl and their cache. `tests.unit.workspace.test_index` tests their use."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros.packages.crawl import DRY, META, WET, Crawl, CrawledPackage, crawl, dump, load

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


@pytest.mark.parametrize(
    ("files", "packages"),
    [
        (["a/package.xml=<name>x</name>"], [("x", "a", WET)]),
        (["package.xml=<name>x</name>", "a/package.xml=<name>y</name>"], [("x", ".", WET)]),
        (["b/package.xml=", "a/package.xml="], [("a", "a", WET), ("b", "b", WET)]),
        (["a/b/c/d/package.xml=<name>x</name>"], [("x", "a/b/c/d", WET)]),
        (["a/manifest.xml="], [("a", "a", DRY)]),
        (["a/manifest.xml=", "a/b/manifest.xml=", "a/c/package.xml="], [("a", "a", DRY)]),
        (["a/manifest.xml=", "a/package.xml=<name>x</name>"], [("x", "a", WET)]),
        (["a/package.xml=<name>x</name><export><metapackage/></export>"], [("x", "a", META)]),
        (["a/package.xml=<name>x</name><!-- <metapackage/> -->"], [("x", "a", WET)]),
        (["a/package.xml=", "a/CATKIN_IGNORE="], []),
        (["a/manifest.xml=", "a/AMENT_IGNORE="], []),
        (["a/COLCON_IGNORE=", "a/b/package.xml="], []),
        (["a/rospack_nosubdirs=", "a/b/package.xml="], []),
        (["a/package.xml=", "a/rospack_nosubdirs="], [("a", "a", WET)]),
        ([".hidden/a/package.xml="], []),
        (["a/package.xml/inside="], []),
        (["a/readme="], []),
    ],
)
def test_a_tree_has_these_packages(
    tmp_path: Path, files: list[str], packages: list[tuple[str, str, str]]
) -> None:
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


@pytest.mark.parametrize(
    ("change", "is_current"),
    [
        ("nothing", True),
        ("a file is edited", True),
        ("a manifest is edited", False),
        ("a package is added", False),
        ("a package is removed", False),
        ("a folder is marked", False),
    ],
)
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
    assert again is not None
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
