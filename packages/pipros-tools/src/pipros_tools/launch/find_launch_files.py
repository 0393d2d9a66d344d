"""Find the launch files given on a command line as `package file.launch` or as paths."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from pipros.basics.errors import NotFound
from pipros.basics.similar_names import similar_names
from pipros.packages.well_known import why_not_here
from pipros_tools.launch.model import LaunchError
from pipros_workspace.index import Package, PackageIndex

STDIN = "-"


class NoSuchFiles(LaunchError):
    """Files given on the command line do not exist; `files` lists them."""

    def __init__(self, files: Sequence[str]) -> None:
        self.files = tuple(files)
        super().__init__(f"The following input files do not exist: {', '.join(files)}")


def resolve_files(words: Sequence[str], index: PackageIndex) -> list[str]:
    """Return the paths of the launch files; `-` (standard input) is kept.

    Raises:
        LaunchError: a file is missing or ambiguous. The text is Noetic's.
    """
    if not words:
        return []
    first, *rest = words
    if not rest:
        if first != STDIN and not os.path.isfile(first):
            folder, name = os.path.split(first)
            hints = [f"[{first}] is not a launch file name", _similar(name, Path(folder).glob("*.launch"))]
            raise LaunchError("\n".join(filter(None, hints)))
        return [first]
    if not os.path.isfile(first) and first != STDIN:
        resolved = [find_in_package(first, rest[0], index), *rest[1:]]
    else:
        resolved = [first, *rest]
    missing = [file for file in resolved if file != STDIN and not os.path.isfile(file)]
    if missing:
        raise NoSuchFiles(missing)
    return resolved


def find_in_package(package_name: str, name: str, index: PackageIndex) -> str:
    """Return the path of the only file in a package that has the given name.

    A path such as `launch/x.launch` is relative to the package's folder.

    Raises:
        LaunchError: the package is unknown, or does not contain exactly one such file.
    """
    nothing = (
        f"[{name}] is neither a launch file in package [{package_name}] nor is [{package_name}] "
        "a launch file name"
    )
    try:
        package = index.find(package_name)
    except NotFound:
        reason = why_not_here(package_name)
        suggestion = similar_names(package_name, [package.name for package in index])
        hints = [nothing, reason] if reason else [nothing, suggestion, index.advice]
        raise LaunchError("\n".join(filter(None, hints))) from None
    matches = _matches(package, name)
    if not matches:
        hints = [nothing, _similar(name, map(Path, _launch_files(package)))]
        raise LaunchError("\n".join(filter(None, hints)))
    if len(matches) > 1:
        listing = "\n".join(f"- {match}" for match in matches)
        raise LaunchError(
            f"multiple files named [{name}] in package [{package_name}]:\n{listing}\n"
            "Please specify full path instead"
        )
    return matches[0]


def _similar(name: str, files: Iterable[Path]) -> str:
    """Return a question that suggests files with similar names, also to a name without `.launch`."""
    known = [file.name for file in files]
    return similar_names(name, known) or similar_names(f"{name}.launch", known)


def _matches(package: Package, name: str) -> list[str]:
    direct = os.path.join(package.path, name.replace("/", os.sep))
    if os.path.dirname(name):
        return [direct] if os.path.isfile(direct) else []
    matches: dict[str, str] = {}
    for folder, files in _walk(package):
        if name in files:
            path = os.path.join(folder, name)
            matches.setdefault(os.path.realpath(path), path)
    return list(matches.values())


def _launch_files(package: Package) -> set[str]:
    """Return the names of the launch files and tests in a package."""
    return {file for _, files in _walk(package) for file in files if file.endswith((".launch", ".test"))}


def _walk(package: Package) -> Iterator[tuple[str, list[str]]]:
    """Yield each folder of a package, except hidden ones, with the names of its files."""
    for folder, folders, files in os.walk(package.path):
        folders[:] = sorted(sub for sub in folders if not sub.startswith("."))
        yield folder, files
