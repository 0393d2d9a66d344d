"""`script/release` refuses unfinished trees, and the metadata has the addresses of the repository."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from pipros.safe import yaml
from tests.support.environments import REPOSITORY, TESTS

pytestmark = pytest.mark.skipif(shutil.which("git") is None, reason="needs git")

CHANGELOG = "# Changelog\n\n## [Unreleased]\n\n### Fixed\n\n## [1.2.0] - 2026-01-02\n\n- A line.\n"


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """Create a repository with a version, a changelog and `script/release`."""
    (tmp_path / "script").mkdir()
    shutil.copy(REPOSITORY / "script" / "release", tmp_path / "script")
    (tmp_path / "pyproject.toml").write_text('[project]\nversion = "1.2.0"\n')
    (tmp_path / "CHANGELOG.md").write_text(CHANGELOG)
    git(tmp_path, "init", "--quiet")
    commit(tmp_path)
    return tmp_path


def git(tree: Path, *words: str) -> None:
    person = ("-c", "user.name=Developer", "-c", "user.email=developer@example.org")
    subprocess.run(["git", *person, *words], cwd=tree, check=True, capture_output=True)


def commit(tree: Path) -> None:
    git(tree, "add", "--all")
    git(tree, "commit", "--quiet", "--message", "A state")


def release(tree: Path, *options: str) -> tuple[int, str]:
    """Run `script/release` with a Python that fails, so that it ends before it installs anything."""
    ended = subprocess.run(
        [tree / "script" / "release", *options],
        env={"PATH": "/usr/bin:/bin", "PYTHON": "false"},
        capture_output=True,
        text=True,
    )
    return ended.returncode, ended.stdout + ended.stderr


@pytest.mark.parametrize("options", [(), ("--dry-run",)])
def test_a_tree_with_changes_is_refused(tree: Path, options: tuple[str, ...]) -> None:
    (tree / "new.py").write_text("")

    code, said = release(tree, *options)

    assert (code, said) == (
        1,
        "script/release: the tree has changes; commit or remove them first:\nscript/release: ?? new.py\n",
    )


@pytest.mark.parametrize("options", [(), ("--dry-run",)])
def test_a_version_without_a_section_in_the_changelog_is_refused(
    tree: Path, options: tuple[str, ...]
) -> None:
    (tree / "pyproject.toml").write_text('[project]\nversion = "1.3.0"\n')
    commit(tree)

    code, said = release(tree, *options)

    assert code == 1
    assert 'CHANGELOG.md has no section "## [1.3.0] - DATE"' in said


def test_unreleased_lines_are_refused(tree: Path) -> None:
    (tree / "CHANGELOG.md").write_text(CHANGELOG.replace("### Fixed\n", "### Fixed\n\n- A defect.\n"))
    commit(tree)

    code, said = release(tree)

    assert code == 1
    assert "the section Unreleased of CHANGELOG.md has 1 lines" in said


def test_a_section_without_a_date_is_refused(tree: Path) -> None:
    (tree / "CHANGELOG.md").write_text(CHANGELOG.replace("2026-01-02", "not yet released"))
    commit(tree)

    code, said = release(tree)

    assert (code, said) == (
        1,
        "script/release: CHANGELOG.md says that 1.2.0 is not yet released; set the date\n",
    )


def test_a_version_that_is_tagged_is_refused(tree: Path) -> None:
    git(tree, "tag", "v1.2.0")

    code, said = release(tree)

    assert code == 1
    assert "v1.2.0 exists already" in said


@pytest.mark.parametrize("options", [(), ("--dry-run",)])
def test_a_clean_tree_is_built(tree: Path, options: tuple[str, ...]) -> None:
    code, said = release(tree, *options)

    assert (code, said) == (1, "\n-- building 1.2.0\n")


def test_an_unknown_option_is_refused(tree: Path) -> None:
    assert release(tree, "--fast") == (2, "script/release: the only option is --dry-run, got --fast\n")


def metadata(folder: Path, repository: str) -> dict[str, Any]:
    """Return the metadata that a build would have with this address of the repository."""
    (folder / "script").mkdir()
    for hook in ("metadata_hook.py", "build_rooms.py", "merge_packages.py"):
        shutil.copy(REPOSITORY / "script" / hook, folder / "script")
    (folder / "packages").symlink_to(REPOSITORY / "packages")
    shutil.copy(REPOSITORY / "README.md", folder)
    text = (REPOSITORY / "pyproject.toml").read_text()
    (folder / "pyproject.toml").write_text(
        re.sub(r'^repository = ".*"$', f'repository = "{repository}"', text, flags=re.MULTILINE)
    )
    words = [sys.executable, "-m", "hatchling", "metadata"]
    ended = subprocess.run(words, cwd=folder, check=True, capture_output=True, text=True)
    result: dict[str, Any] = json.loads(ended.stdout)
    return result


RELATIVE = re.compile(r"\]\((?!https?:|#)[^)]*\)")


def test_the_address_of_the_repository_makes_all_links_absolute(tmp_path: Path) -> None:
    made = metadata(tmp_path, "https://forge.example/someone/pipros/")

    assert made["urls"]["Source"] == "https://forge.example/someone/pipros"
    assert made["urls"]["Issues"] == "https://forge.example/someone/pipros/issues"
    text = made["readme"]["text"]
    assert RELATIVE.findall(text) == []
    assert f"](https://forge.example/someone/pipros/raw/v{made['version']}/docs/scene.png)" in text
    assert f"](https://forge.example/someone/pipros/blob/v{made['version']}/docs/choose.md)" in text


def test_without_an_address_the_readme_is_unchanged(tmp_path: Path) -> None:
    made = metadata(tmp_path, "")

    assert "urls" not in made
    assert made["readme"] == {"content-type": "text/markdown", "text": (REPOSITORY / "README.md").read_text()}


def test_the_bug_form_requires_the_output_of_the_doctor() -> None:
    form = yaml.load((REPOSITORY / ".github" / "ISSUE_TEMPLATE" / "bug.yml").read_text())

    (field,) = [part for part in form["body"] if "`pipros doctor`" in part["attributes"]["label"]]
    assert field["validations"]["required"] is True


def test_the_watched_versions_of_vendored_libraries_are_those_in_the_tree() -> None:
    watched = json.loads((TESTS / "page" / "package.json").read_text())["dependencies"]
    table = re.findall(
        r"^\| \[[^\]]*\]\([^)]*\) \| ([\d.]+) \| .*npm package `(\w+)`",
        (REPOSITORY / "THIRD_PARTY.md").read_text(),
        re.MULTILINE,
    )

    assert {name: version for version, name in table} == watched
