"""Commit messages have bodies, the core rests, and the changelog names the commit of each release."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Sequence

import pytest

from pipros.basics.rooms import own_rooms
from tests.support.environments import REPOSITORY

FIRST = "4f7b45882057e8d827e9e65e9774d615523ddc9d"
"""The last commit before the rule about bodies."""
MAX_LINES = 20
"""Lines of `src` and `facades` that a commit may change without a body."""
RESTS_FROM = "b8ad4ccbbaa25d6d016169011cb3e7cc23cf09a9"
"""The last commit before the rule about the finished core."""
ALIVE = ("graph", "health", "policy", "server", *(room.name for room in own_rooms()))
"""Packages that are not finished: rooms, and what grows with them."""
REASON = re.compile(r"^(?:Report|Measured|Security|House): \S", re.MULTILINE)
CHANGELOG = (REPOSITORY / "CHANGELOG.md").read_text()
RELEASES = re.findall(
    r"^## \[(\d[\d.]*)\] - \d{4}-\d\d-\d\d\n\n(?:Commit ([0-9a-f]{8,})\.\n)?", CHANGELOG, re.MULTILINE
)


def git(*words: str) -> str:
    return subprocess.run(["git", *words], cwd=REPOSITORY, capture_output=True, text=True, check=True).stdout


def has_commits(names: Sequence[str]) -> bool:
    """Return True if the history reaches back to all of these commits."""
    if shutil.which("git") is None or not (REPOSITORY / ".git").exists():
        return False
    found = [
        subprocess.run(["git", "cat-file", "-e", f"{name}^{{commit}}"], cwd=REPOSITORY, capture_output=True)
        for name in names
    ]
    return all(ended.returncode == 0 for ended in found)


def needs(*names: str) -> None:
    if not has_commits(names):
        pytest.skip(
            f"the history is shallow, or not here: it lacks one of {', '.join(names)}; git fetch --unshallow"
        )


def without_body(log: str) -> list[str]:
    """Return the commits in the output of `git log` that change too many lines for a message without a body.

    Args:
        log: Output of `git log --numstat --format='%x00%h %s%x01%b%x01'`.
    """
    found = []
    for commit in log.split("\0")[1:]:
        subject, body, numbers = commit.split("\1")
        changed = sum(
            int(count) for line in numbers.splitlines() for count in line.split("\t")[:2] if count.isdecimal()
        )
        if changed > MAX_LINES and not body.strip():
            found.append(f"{subject}: {changed} lines")
    return found


def test_every_larger_commit_says_why() -> None:
    needs(FIRST)

    log = git(
        "log",
        "--no-merges",
        "--numstat",
        "--format=%x00%h %s%x01%b%x01",
        f"{FIRST}..",
        "--",
        "src",
        "facades",
        "packages/*/src",
        "packages/*/facades",
    )

    assert without_body(log) == []


@pytest.mark.parametrize(
    ("body", "numbers", "found"),
    [
        ("", "11\t10\tsrc/a.py\n", ["1234 Do it: 21 lines"]),
        ("\n", "10\t5\tsrc/a.py\n3\t3\tsrc/b.py\n", ["1234 Do it: 21 lines"]),
        ("It failed.\n", "11\t10\tsrc/a.py\n", []),
        ("", "10\t10\tsrc/a.py\n", []),
        ("", "-\t-\tsrc/a.png\n", []),
    ],
)
def test_larger_commits_without_a_body_are_found(body: str, numbers: str, found: list[str]) -> None:
    assert without_body(f"\x001234 Do it\1{body}\1\n{numbers}") == found


def without_reason(log: str) -> list[str]:
    """Return the commits whose body has no reason, from `git log --format='%x00%h %s%x01%b%x01'`."""
    commits = [commit.split("\1") for commit in log.split("\0")[1:]]
    return [subject for subject, body, *_ in commits if not REASON.search(body)]


def test_the_finished_core_changes_only_for_a_reason_in_the_body() -> None:
    needs(RESTS_FROM)
    source = "packages/pipros/src/pipros"
    paths = [source, "packages/pipros/facades", *(f":!{source}/{name}" for name in (*ALIVE, "share"))]

    log = git("log", "--no-merges", "--format=%x00%h %s%x01%b%x01", f"{RESTS_FROM}..", "--", *paths)

    assert without_reason(log) == [], "see CONTRIBUTING: The core rests"


@pytest.mark.parametrize(
    ("body", "is_found"),
    [
        ("It was slow.\n\nMeasured: script/bench client, 1.2 x\n", False),
        ("Report: ros_comm 1234\n", False),
        ("Security: a peer could fill the memory\n", False),
        ("House: moved to its room\n", False),
        ("It reads better.\n", True),
        ("This was measured: nothing\n", True),
        ("Report:\n", True),
    ],
)
def test_commits_without_a_reason_are_found(body: str, is_found: bool) -> None:
    assert bool(without_reason(f"\x001234 Do it\1{body}\1\n")) is is_found


def test_the_changelog_names_the_commit_that_set_the_version_of_each_release() -> None:
    """The newest release may lack it: the commit's hash is known only afterwards."""
    assert len(RELEASES) >= 2
    assert [version for version, commit in RELEASES[1:] if not commit] == []
    needs(*(commit for _, commit in RELEASES if commit))
    for version, commit in RELEASES:
        if commit:
            assert f'\nversion = "{version}"\n' in git("show", f"{commit}:pyproject.toml")
            assert f'\nversion = "{version}"\n' not in git("show", f"{commit}~:pyproject.toml")
