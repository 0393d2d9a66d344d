#!/usr/bin/env python3
"""Join the folders of `packages` in `build`, as one wheel would: run it after a folder was added or removed.

Each package has a part of `pipros`, of the facades and of `tests`. `build/src`, `build/facades`,
`build/internals` and `build/tests` contain links to all parts, and an editable installation refers to them. A
folder that only one package has is one link, so that new files in it are found at once.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path

INTERNALS = "pipros-internals"
Tree = dict[str, "Path | Tree"]


def roots(packages: Path) -> Iterator[tuple[str, Path]]:
    """Yield the name in `build` of each part of a package, and its folder."""
    for package in sorted(packages.iterdir()):
        for part in ("src", "facades", "tests", "benchmarks"):
            if (package / part).is_dir():
                yield "internals" if package.name == INTERNALS and part == "facades" else part, package / part


def merged(folders: list[Path]) -> Tree:
    """Return the entries of all folders: what has one source, or a tree if several folders have it.

    Raises:
        ValueError: two folders have the same file.
    """
    found: dict[str, list[Path]] = {}
    for folder in folders:
        for entry in folder.iterdir():
            if entry.name != "__pycache__":
                found.setdefault(entry.name, []).append(entry)
    tree: Tree = {}
    for name, entries in found.items():
        if len(entries) == 1:
            tree[name] = entries[0]
        elif name == "conftest.py":
            continue  # pytest reads each where it is, and nothing imports one
        elif all(entry.is_dir() for entry in entries):
            tree[name] = merged(entries)
        else:
            raise ValueError(f"packages: several have the same file: {', '.join(map(str, entries))}")
    return tree


def write(tree: Mapping[str, Path | Tree], folder: Path) -> None:
    """Make a folder contain links to a tree, and nothing else. What is right already stays."""
    if folder.is_symlink():
        folder.unlink()
    folder.mkdir(parents=True, exist_ok=True)
    for entry in folder.iterdir():
        is_link = isinstance(tree.get(entry.name), Path)
        if entry.name != "__pycache__" and (entry.name not in tree or is_link != entry.is_symlink()):
            shutil.rmtree(entry) if entry.is_dir() and not entry.is_symlink() else entry.unlink()
    for name, source in tree.items():
        target = folder / name
        if not isinstance(source, Path):
            write(source, target)
            continue
        wanted = os.path.relpath(source, folder)
        if target.is_symlink() and os.readlink(target) == wanted:
            continue
        target.unlink(missing_ok=True)
        try:
            target.symlink_to(wanted, target_is_directory=source.is_dir())
        except OSError:  # Windows allows links only to some users: a copy must be renewed
            shutil.copytree(source, target) if source.is_dir() else shutil.copy(source, target)


def merge(repository: Path) -> None:
    """Join the packages of a repository."""
    parts: dict[str, list[Path]] = {}
    for name, folder in roots(repository / "packages"):
        parts.setdefault(name, []).append(folder)
    for name, folders in parts.items():
        write(merged(folders), repository / "build" / name)


if __name__ == "__main__":
    merge(Path(__file__).resolve().parents[1])
