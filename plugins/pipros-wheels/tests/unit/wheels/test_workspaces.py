"""Workspaces of the shapes that public repositories have: the files of their wheels, and what is said."""

import re
import shutil
import subprocess
import zipfile
from pathlib import Path

import pytest

from pipros.basics.errors import PiprosError
from pipros_wheels.sources import Repository, read_repositories, read_repository, source_folders
from pipros_wheels.wheel_build import WheelOptions, build_wheels, source_packages
from tests.support.constants import Constants
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
def test_the_wheels_of_a_workspace_have_exactly_these_files(name: str, tmp_path: Path, monkeypatch) -> None:
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


# Folders, git repositories and lists of repositories on the command line.


needs_git = pytest.mark.skipif(shutil.which("git") is None, reason="needs git")


@pytest.fixture
def repository(tmp_path: Path) -> str:
    """The URL of a repository with a tag, a branch, and a later commit."""
    folder = tmp_path / "arm.git"
    folder.mkdir()

    def git(*words: str) -> None:
        own = ("-c", "user.name=a", "-c", "user.email=a@example.org", "-c", "init.defaultBranch=main")
        subprocess.run(["git", *own, *words], cwd=folder, check=True, capture_output=True)

    git("init")
    for text in ("first", "second"):
        (folder / "file").write_text(text)
        git("add", "file")
        git("commit", "-m", text)
        if text == "first":
            git("tag", "v1")
            git("branch", "old")
    return f"file://{folder}"


@pytest.mark.parametrize(("text", "url", "version"), [
    ("https://example.org/a/b.git", "https://example.org/a/b.git", ""),
    ("git+https://example.org/a/b@noetic-devel", "https://example.org/a/b", "noetic-devel"),
    ("git@example.org:a/b.git", "git@example.org:a/b.git", ""),
    ("ssh://git@example.org/a/b@1.0", "ssh://git@example.org/a/b", "1.0"),
])  # fmt: skip
def test_urls_of_repositories(text: str, url: str, version: str) -> None:
    assert read_repository(text) == Repository(url, version)


@pytest.mark.parametrize(
    "text", ["a/b", "ext::sh -c id", "--upload-pack=id", "ftp://example.org/a", "https://a b"]
)
def test_other_words_are_refused(text: str, tmp_path: Path) -> None:
    assert read_repository(text) is None
    with pytest.raises(PiprosError, match="must be a folder, the URL of a git repository, or"):
        source_folders([text], tmp_path)


@needs_git
@pytest.mark.parametrize(("version", "content"), [("", "second"), ("@v1", "first"), ("@old", "first")])
def test_a_repository_is_cloned(repository: str, tmp_path: Path, version: str, content: str) -> None:
    clones = tmp_path / "clones"
    clones.mkdir()
    (folder,) = source_folders([f"{repository}{version}"], clones)
    assert (folder / "file").read_text() == content


@needs_git
def test_a_version_that_does_not_exist_is_named(repository: str, tmp_path: Path) -> None:
    clones = tmp_path / "clones"
    clones.mkdir()
    with pytest.raises(PiprosError, match=r"has no branch, tag or commit \[gone\]"):
        source_folders([f"{repository}@gone"], clones)
    with pytest.raises(PiprosError, match="git failed for file:///nowhere"):
        source_folders(["file:///nowhere/at/all"], clones)


LISTS = {
    "a.rosinstall": "- git: {local-name: arm, uri: 'https://example.org/arm.git', version: v1}\n"
    "- git: {local-name: hand, uri: 'https://example.org/hand'}\n",
    "a.repos": "repositories:\n  arm: {type: git, url: 'https://example.org/arm.git', version: v1}\n"
    "  hand: {type: git, url: 'https://example.org/hand'}\n",
}


@pytest.mark.parametrize("name", LISTS)
def test_lists_of_repositories(name: str, tmp_path: Path) -> None:
    file = tmp_path / name
    file.write_text(LISTS[name])
    assert read_repositories(file) == [
        Repository("https://example.org/arm.git", "v1"),
        Repository("https://example.org/hand"),
    ]


@pytest.mark.parametrize(("name", "text", "message"), [
    ("a.rosinstall", "git: x", "expected a list of repositories"),
    ("a.rosinstall", "- git: {uri: a}\n  hg: b", "item 1 must have one key"),
    ("a.rosinstall", "- hg: {uri: 'https://example.org/a'}", r"item 1 is of type \[hg\]; only git"),
    ("a.rosinstall", "- git: {local-name: a}", r"uri must be the URL of a repository, got \[None\]"),
    (
        "a.rosinstall",
        "- git: {uri: '--config=x'}",
        r"uri must be the URL of a repository, got \[--config=x\]",
    ),
    ("a.repos", "arm: {}", "missing required key 'repositories'"),
    ("a.repos", "repositories: {a: 1}", r"a is of type \[None\]"),
    ("a.repos", "repositories: {a: {type: git, url: 'https://e.org/a', version: -x}}", "is not a branch"),
    ("a.repos", "repositories: {a: ", "a.repos"),
])  # fmt: skip
def test_malformed_lists_are_refused(name: str, text: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / name
    file.write_text(text)
    with pytest.raises(PiprosError, match=message):
        read_repositories(file)


def test_lists_have_a_limit(tmp_path: Path, constants: Constants) -> None:
    constants(WHEEL_REPOSITORIES=1)
    file = tmp_path / "a.repos"
    file.write_text(LISTS["a.repos"])
    with pytest.raises(PiprosError, match="lists 2 repositories; the limit is 1"):
        read_repositories(file)
