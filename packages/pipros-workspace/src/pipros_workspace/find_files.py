"""Find packages' files and folders in a chain of workspaces, for `catkin_find`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pipros.basics.errors import PiprosError
from pipros.packages.crawl import DRY, crawl
from pipros_workspace.overlays import BuiltWorkspace

_WITHOUT_PROJECT = ("bin", "etc", "include", "lib", "share")
_WITH_PROJECT = ("etc", "include", "libexec", "share")


class WrongFolders(PiprosError):
    """A search folder is unknown, is not allowed with a project, or requires one."""


@dataclass(slots=True)
class FoundFiles:
    """The result of a search.

    Attributes:
        existing: the paths found, in order.
        considered: all paths that were checked.
    """

    existing: list[str] = field(default_factory=list)
    considered: list[str] = field(default_factory=list)


def find_files(
    workspaces: Sequence[BuiltWorkspace],
    project: str = "",
    path: str = "",
    folders: Sequence[str] = (),
    *,
    only_first_workspace: bool = False,
    only_first: bool = False,
) -> FoundFiles:
    """Return the paths `<workspace>/<folder>/<project>/<path>` that exist.

    Args:
        workspaces: the workspaces, topmost first. For `share`, packages' source folders are searched, too.
        project: a package; empty for paths outside packages.
        path: a path below the project's folder; empty for the folder itself.
        folders: `bin`, `etc`, `include`, `lib`, `libexec` or `share`; if empty, all allowed folders.
            `libexec` includes `lib/<project>`.
        only_first_workspace: whether to stop at the first workspace with a match.
        only_first: whether to stop at the first match.

    Raises:
        WrongFolders: a folder is unknown, is not allowed with a project, or requires one.
    """
    result = FoundFiles()
    for workspace in workspaces:
        for candidate in _candidates(workspace, project, path, _checked(folders, project)):
            result.considered.append(candidate)
            if os.path.exists(candidate):
                result.existing.append(candidate)
                if only_first:
                    return result
        if only_first_workspace and result.existing:
            break
    return result


def _checked(folders: Sequence[str], project: str) -> list[str]:
    unknown = ", ".join(
        f'"{folder}"' for folder in folders if folder not in (*_WITHOUT_PROJECT, *_WITH_PROJECT)
    )
    if unknown:
        raise WrongFolders(f"Unsupported search folders: {unknown}")
    possible = _WITH_PROJECT if project else _WITHOUT_PROJECT
    wrong = ", ".join(f'"{folder}"' for folder in folders if folder not in possible)
    if wrong:
        raise WrongFolders(
            f"Searching {'for' if project else 'without'} a project can not be combined with the search "
            f"folders:{wrong}"
        )
    found = list(folders or possible)
    if "libexec" in found:
        found.insert(found.index("libexec"), "lib")
    return found


def _candidates(workspace: BuiltWorkspace, project: str, path: str, folders: Sequence[str]) -> list[str]:
    candidates = []
    for folder in folders:
        base = os.path.join(workspace.prefix, folder)
        if base == "/usr/etc":
            base = "/etc"
        candidates.append(os.path.join(*filter(None, (base, project, path))))
        if project and folder == "share":
            for source in workspace.sources:
                package = _source_folder(source, project)
                if package is not None:
                    candidates.append(os.path.join(package, path) if path else package)
    return candidates


def _source_folder(source: Path, project: str) -> str | None:
    packages = crawl(str(source)).packages
    matching = [found.path for found in packages if found.name == project and found.kind != DRY]
    return matching[0] if matching else None
