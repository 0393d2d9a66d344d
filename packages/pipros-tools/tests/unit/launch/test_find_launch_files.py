from __future__ import annotations

from pathlib import Path

import pytest

from pipros_tools.launch.find_launch_files import NoSuchFiles, resolve_files
from pipros_tools.launch.model import LaunchError
from pipros_workspace.index import SHARED_PACKAGES, PackageIndex


@pytest.fixture
def index(tmp_path: Path) -> PackageIndex:
    package = tmp_path / "talkers"
    for path in ("launch/a.launch", "launch/twice.launch", "more/twice.launch", ".git/hidden.launch"):
        (package / path).parent.mkdir(parents=True, exist_ok=True)
        (package / path).touch()
    (package / "package.xml").write_text("<package><name>talkers</name></package>")
    return PackageIndex([tmp_path])


def test_launch_files_are_found_by_package_and_by_path(index: PackageIndex, tmp_path: Path) -> None:
    found = str(tmp_path / "talkers" / "launch" / "a.launch")
    assert resolve_files(["talkers", "a.launch"], index) == [found]
    assert resolve_files(["talkers", "launch/a.launch"], index) == [found]
    assert resolve_files([found], index) == [found]
    assert resolve_files([found, found], index) == [found, found]
    assert resolve_files(["talkers", "a.launch", found], index) == [found, found]
    assert (resolve_files(["-"], index), resolve_files([], index)) == (["-"], [])


@pytest.mark.parametrize(("words", "complaint"), [
    (["nope.launch"], r"^\[nope.launch\] is not a launch file name"),
    (
        ["talkers", "nope.launch"],
        r"^\[nope.launch\] is neither a launch file in package \[talkers\] nor is \[talkers\] a launch",
    ),
    (["nope", "a.launch"], r"^\[a.launch\] is neither a launch file in package \[nope\]"),
    (["talkers", "hidden.launch"], "is neither"),
    (["talkers", "twice.launch"], r"^multiple files named \[twice.launch\] in package \[talkers\]:\n- "),
])  # fmt: skip
def test_launch_files_that_are_not_found_are_refused_in_noetics_words(
    index: PackageIndex, words: list[str], complaint: str
) -> None:
    with pytest.raises(LaunchError, match=complaint):
        resolve_files(words, index)


def test_without_folders_to_search_the_error_says_what_to_set() -> None:
    with pytest.raises(LaunchError, match=r"launch file name\nROS_PACKAGE_PATH lists no workspace: "):
        resolve_files(["nope", "a.launch"], PackageIndex([SHARED_PACKAGES]))


@pytest.mark.parametrize(("words", "suggestion"), [
    (["talkers", "twice.lauch"], r"launch file name\nDid you mean twice.launch\?$"),
    (["talker", "a.launch"], r"launch file name\nDid you mean talkers\?$"),
])  # fmt: skip
def test_similar_names_are_suggested(index: PackageIndex, words: list[str], suggestion: str) -> None:
    with pytest.raises(LaunchError, match=suggestion):
        resolve_files(words, index)


def test_all_missing_files_are_named(index: PackageIndex) -> None:
    with pytest.raises(NoSuchFiles) as error:
        resolve_files(["talkers", "a.launch", "x", "y"], index)
    assert error.value.files == ("x", "y")
