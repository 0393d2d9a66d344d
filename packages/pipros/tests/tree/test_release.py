"""`script/release` refuses unfinished trees, and sets the version of all projects."""

import json
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from pipros.safe import yaml
from tests.support.environments import REPOSITORY, file_of_tests
from tests.support.project import PLUGIN_PROJECTS, PROJECT

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
        [tree / "script" / "release", *options], env={"PATH": "/usr/bin:/bin", "PYTHON": "false"},
        capture_output=True, text=True,
    )  # fmt: skip
    return ended.returncode, ended.stdout + ended.stderr


def committed(file: str, text: str) -> Callable[[Path], None]:
    def change(tree: Path) -> None:
        (tree / file).write_text(text)
        commit(tree)

    return change


REFUSED: dict[str, tuple[Callable[[Path], object], str]] = {
    "changes": (
        lambda tree: (tree / "new.py").write_text(""),
        "script/release: the tree has changes; commit or remove them first:\nscript/release: ?? new.py\n",
    ),
    "no section for the version": (
        committed("pyproject.toml", '[project]\nversion = "1.3.0"\n'),
        'CHANGELOG.md has no section "## [1.3.0] - DATE"',
    ),
    "unreleased lines": (
        committed("CHANGELOG.md", CHANGELOG.replace("### Fixed\n", "### Fixed\n\n- A defect.\n")),
        "the section Unreleased of CHANGELOG.md has 1 lines",
    ),
    "a section without a date": (
        committed("CHANGELOG.md", CHANGELOG.replace("2026-01-02", "not yet released")),
        "script/release: CHANGELOG.md says that 1.2.0 is not yet released; set the date\n",
    ),
}


# A dry run may have unreleased lines, and no date yet.
@pytest.mark.parametrize(
    ("fault", "options"),
    [*((fault, ()) for fault in REFUSED), *((fault, ("--dry-run",)) for fault in list(REFUSED)[:2])],
)
def test_an_unfinished_tree_is_refused(tree: Path, fault: str, options: tuple[str, ...]) -> None:
    change, complaint = REFUSED[fault]
    change(tree)
    code, said = release(tree, *options)
    assert (code, complaint in said) == (1, True), said


def test_a_version_that_is_tagged_is_refused(tree: Path) -> None:
    git(tree, "tag", "v1.2.0")
    code, said = release(tree)
    assert (code, "v1.2.0 exists already" in said) == (1, True), said


@pytest.mark.parametrize("options", [(), ("--dry-run",)])
def test_a_clean_tree_is_built(tree: Path, options: tuple[str, ...]) -> None:
    code, said = release(tree, *options)

    assert (code, said) == (1, "\n-- building 1.2.0\n")


def test_an_unknown_option_is_refused(tree: Path) -> None:
    assert release(tree, "--fast") == (2, "script/release: the only option is --dry-run, got --fast\n")


def test_a_version_is_set_in_all_projects_and_their_pins(tree: Path) -> None:
    names = ["pyproject.toml", "packages/pipros/src/pipros/__init__.py"]
    names += [f"plugins/{name}/pyproject.toml" for name in PLUGIN_PROJECTS]
    for name in names:
        (tree / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(REPOSITORY / name, tree / name)
    before = PROJECT["project"]["version"]
    assert release(tree, "--set", "7.8.9") == (0, "")
    for name in names:
        text = (tree / name).read_text()
        assert text == (REPOSITORY / name).read_text().replace(f'"{before}"', '"7.8.9"').replace(
            f"=={before}", "==7.8.9"
        )
        assert "7.8.9" in text


def test_the_bug_form_requires_the_output_of_the_doctor() -> None:
    form = yaml.load((REPOSITORY / ".github" / "ISSUE_TEMPLATE" / "bug.yml").read_text())

    (field,) = [part for part in form["body"] if "`pipros doctor`" in part["attributes"]["label"]]
    assert field["validations"]["required"] is True


def test_the_watched_versions_of_vendored_libraries_are_those_in_the_tree() -> None:
    watched = json.loads(file_of_tests("page/package.json").read_text())["dependencies"]
    table = re.findall(
        r"^\| \[[^\]]*\]\([^)]*\) \| ([\d.]+) \| .*npm package `(\w+)`",
        (REPOSITORY / "THIRD_PARTY.md").read_text(),
        re.MULTILINE,
    )

    assert {name: version for version, name in table} == watched


def test_the_changelog_names_the_commit_that_set_the_version_of_each_release() -> None:
    """The newest release may lack it: the commit's hash is known only afterwards."""
    changelog = (REPOSITORY / "CHANGELOG.md").read_text()
    releases = re.findall(
        r"^## \[(\d[\d.]*)\] - \d{4}-\d\d-\d\d\n\n(?:Commit ([0-9a-f]{8,})\.\n)?", changelog, re.MULTILINE
    )

    assert len(releases) >= 2
    assert [version for version, commit in releases[1:] if not commit] == []
    shallow = subprocess.run(
        ["git", "rev-parse", "--is-shallow-repository"], cwd=REPOSITORY, capture_output=True, text=True
    )
    if shallow.stdout.strip() != "false":
        pytest.skip("the history is shallow, or not here: git fetch --unshallow")
    for version, commit in releases:
        if commit:
            assert f'\nversion = "{version}"\n' in shown(f"{commit}:pyproject.toml")
            assert f'\nversion = "{version}"\n' not in shown(f"{commit}~:pyproject.toml")


def shown(name: str) -> str:
    return subprocess.run(
        ["git", "show", name], cwd=REPOSITORY, capture_output=True, text=True, check=True
    ).stdout
