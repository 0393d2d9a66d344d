"""Find the sources given on a command line: folders, git repositories, `.rosinstall` and `.repos` files."""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_file
from pipros.basics.printable import printable
from pipros.safe import yaml

WHEEL_REPOSITORIES = 500
"""Maximum number of repositories in one `.rosinstall` or `.repos` file. Beyond it, `pipros install` refuses
the file.
"""

_URL = re.compile(r"(?:https?|ssh|git|file)://[^\s\x00-\x1f]+|[\w.-]+@[\w.-]+:[^\s\x00-\x1f]+", re.ASCII)
_VERSION = re.compile(r"(?!-)[\w./+-]+", re.ASCII)
_LISTS = (".rosinstall", ".repos")
_CLONE_LIMIT_S = 900.0
_PROTOCOLS = "file:git:http:https:ssh"


class BadSource(PiprosError):
    """A source does not exist, is invalid, or cannot be fetched."""


@dataclass(frozen=True, slots=True)
class Repository:
    """A git repository and its branch, tag or commit; an empty `version` means its default branch."""

    url: str
    version: str = ""

    @property
    def name(self) -> str:
        """The last part of the URL, without `.git`."""
        return re.split(r"[/:]", self.url.rstrip("/"))[-1].removesuffix(".git") or "repository"


def read_repository(text: str) -> Repository | None:
    """Return the repository given by a command-line argument, or None if the argument is not a URL.

    As in pip, `git+https://…` is accepted, and `URL@VERSION` selects a branch, tag or commit.

    Raises:
        BadSource: the version contains characters that names of branches, tags and commits cannot have.
    """
    text = text.removeprefix("git+")
    start = text.rfind("@")
    if start > max(text.rfind("/"), text.rfind(":")) and _URL.fullmatch(text[:start]):
        return _checked(Repository(text[:start], text[start + 1 :]))
    return Repository(text) if _URL.fullmatch(text) else None


def read_repositories(file: Path) -> list[Repository]:
    """Return the repositories in a `.rosinstall` or `.repos` file.

    Raises:
        BadSource: the file has another format, too many repositories, or a repository that does not use git.
        YamlError, OSError: the file cannot be read.
    """
    content = yaml.load_texts(read_file(file), str(file))
    found = _of_rosinstall(content, file) if file.suffix == ".rosinstall" else _of_repos(content, file)
    limit = WHEEL_REPOSITORIES
    if len(found) > limit:
        raise BadSource(f"{file} lists {len(found)} repositories; the limit is {limit}")
    return found


def _of_rosinstall(content: object, file: Path) -> list[Repository]:
    if not isinstance(content, list):
        raise BadSource(
            f"{file}: expected a list of repositories such as - git: {{uri: URL, local-name: NAME}}"
        )
    found = []
    for number, item in enumerate(content, 1):
        if not isinstance(item, dict) or len(item) != 1:
            raise BadSource(f"{file}: item {number} must have one key, such as git")
        ((kind, values),) = item.items()
        found.append(_repository(kind, values, "uri", file, f"item {number}"))
    return found


def _of_repos(content: object, file: Path) -> list[Repository]:
    listed = content.get("repositories") if isinstance(content, dict) else None
    if not isinstance(listed, dict):
        raise BadSource(f"{file}: missing required key 'repositories'")
    return [
        _repository(values.get("type") if isinstance(values, dict) else None, values, "url", file, str(name))
        for name, values in listed.items()
    ]


def _repository(kind: object, values: object, key: str, file: Path, item: str) -> Repository:
    place = f"{file}: {printable(item)}"
    if kind != "git":
        raise BadSource(f"{place} is of type [{printable(kind)}]; only git is supported")
    url = values.get(key) if isinstance(values, dict) else None
    if not isinstance(values, dict) or not isinstance(url, str) or not _URL.fullmatch(url):
        raise BadSource(f"{place}: {key} must be the URL of a repository, got [{printable(url)}]")
    return _checked(Repository(url, str(values.get("version") or "")), place)


def _checked(repository: Repository, place: str = "") -> Repository:
    if repository.version and not _VERSION.fullmatch(repository.version):
        text = f"[{printable(repository.version)}] is not a branch, tag or commit"
        raise BadSource(f"{place}: {text}" if place else text)
    return repository


def clone(repository: Repository, folder: Path) -> Path:
    """Clone a repository below a folder, and return the path. Each git command may take up to 15 minutes.

    Raises:
        BadSource: git is not installed, or failed; the message contains the end of its output.
    """
    target = folder / f"{len(list(folder.iterdir()))}-{repository.name}"
    _git(repository, ["clone", "--quiet", "--", repository.url, str(target)])
    if repository.version:
        _git(repository, ["-C", str(target), "checkout", "--quiet", "--detach", _commit(repository, target)])
    return target


def _commit(repository: Repository, target: Path) -> str:
    """Return the commit of a branch, a tag or an abbreviated commit."""
    for name in (f"refs/remotes/origin/{repository.version}", repository.version):
        try:
            text = _git(
                repository, ["-C", str(target), "rev-parse", "--verify", "--quiet", f"{name}^{{commit}}"]
            )
        except BadSource:
            continue
        return text.strip()
    raise BadSource(f"{repository.url} has no branch, tag or commit [{repository.version}]")


def _git(repository: Repository, words: Sequence[str]) -> str:
    environment = {**os.environ, "GIT_ALLOW_PROTOCOL": _PROTOCOLS, "GIT_TERMINAL_PROMPT": "0"}
    try:
        ended = subprocess.run(  # noqa: S603
            ["git", *words],  # noqa: S607
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=_CLONE_LIMIT_S,
            check=False,
        )
    except FileNotFoundError:
        raise BadSource(f"git is not installed; it is needed for {repository.url}") from None
    except subprocess.TimeoutExpired:
        raise BadSource(f"git did not finish within {_CLONE_LIMIT_S:.0f} s: {repository.url}") from None
    if ended.returncode != 0:
        raise BadSource(f"git failed for {repository.url}: {' '.join(ended.stderr.split()[-40:])}")
    return ended.stdout


def source_folders(words: Sequence[str], clones: Path) -> list[Path]:
    """Return the folders given on the command line. Repositories are cloned into subfolders of `clones`.

    Raises:
        BadSource: an argument is neither a folder, nor a URL, nor a list of repositories; or git failed.
    """
    folders = []
    for word in words:
        path = Path(word)
        if path.is_dir():
            folders.append(path)
        elif path.suffix in _LISTS and path.is_file():
            folders += [clone(repository, clones) for repository in read_repositories(path)]
        else:
            repository = read_repository(word)
            if repository is None:
                raise BadSource(
                    f"[{printable(word)}] must be a folder, the URL of a git repository, or a .rosinstall or "
                    ".repos file"
                )
            folders.append(clone(repository, clones))
    return folders
