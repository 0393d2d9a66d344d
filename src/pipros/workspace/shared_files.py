"""Finds files of packages in built workspaces and in their sources, as `catkin_find` does."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, MutableMapping
from pathlib import Path

from pipros.workspace.index import PackageIndex
from pipros.workspace.overlays import MARKER, built_workspaces

GLOBAL_FOLDERS = ("bin", "etc", "include", "lib", "share")
PROJECT_FOLDERS = ("etc", "include", "libexec", "share")


def workspaces() -> list[str]:
    """The built workspaces of `CMAKE_PREFIX_PATH`, the topmost overlay first."""
    return [str(workspace.prefix) for workspace in built_workspaces()]


def source_paths(workspace: str) -> list[str]:
    """The source folders that a workspace was built from; none for an install space.

    Raises:
        ValueError: it is not a workspace.
    """
    marker = Path(workspace, MARKER)
    if not marker.is_file():
        raise ValueError(f'Not a catkin workspace: "{workspace}", missing file {marker}')
    return [path for path in marker.read_text("utf-8").split(";") if path]


def find_in_workspaces(
    search_dirs: Iterable[str] | None = None,
    project: str | None = None,
    path: str | None = None,
    _workspaces: Iterable[str] | None = None,
    considered_paths: list[str] | None = None,
    first_matching_workspace_only: bool = False,
    first_match_only: bool = False,
    workspace_to_source_spaces: MutableMapping[str, list[str]] | None = None,
    source_path_to_packages: MutableMapping[str, dict[str, str]] | None = None,
) -> list[str]:
    """The paths that exist of `workspace/folder/project/path`, for each workspace and folder.

    For a project, `share` also means its folder among the sources, and `libexec` that of its programs.

    Args:
        search_dirs: folders to look in; by default all of `PROJECT_FOLDERS` or `GLOBAL_FOLDERS`.
        project: a package.
        path: a file or folder in it.
        considered_paths: where to add the paths that were looked at.
        first_matching_workspace_only, first_match_only: when to stop.
        workspace_to_source_spaces, source_path_to_packages: what earlier calls found out.

    Raises:
        ValueError: a folder cannot be searched so, or a folder is not a workspace.
    """
    folders = _checked(list(search_dirs or ()), project)
    sources = {} if workspace_to_source_spaces is None else workspace_to_source_spaces
    packages = {} if source_path_to_packages is None else source_path_to_packages
    found: list[str] = []
    considered = considered_paths if considered_paths is not None else []
    for workspace in workspaces() if _workspaces is None else _workspaces:
        before = len(found)
        for candidate in _candidates(workspace, folders, project, path, sources, packages):
            considered.append(candidate)
            if os.path.exists(candidate):
                found.append(candidate)
                if first_match_only:
                    return found
        if first_matching_workspace_only and len(found) > before:
            break
    return found


def _checked(folders: list[str], project: str | None) -> list[str]:
    unknown = [folder for folder in folders if folder not in (*GLOBAL_FOLDERS, *PROJECT_FOLDERS)]
    if unknown:
        listed = ", ".join(f'"{folder}"' for folder in unknown)
        raise ValueError(f"Unsupported search folders: {listed}")
    possible = PROJECT_FOLDERS if project else GLOBAL_FOLDERS
    wrong = ", ".join(f'"{folder}"' for folder in folders if folder not in possible)
    if wrong and project:
        raise ValueError(f"Searching for a project can not be combined with the search folders:{wrong}")
    if wrong:
        raise ValueError(f"Searching without a project can not be combined with the search folders:{wrong}")
    folders = folders or list(possible)
    if "libexec" in folders:
        folders.insert(folders.index("libexec"), "lib")
    return folders


def _candidates(
    workspace: str,
    folders: Iterable[str],
    project: str | None,
    path: str | None,
    sources: MutableMapping[str, list[str]],
    packages: MutableMapping[str, dict[str, str]],
) -> Iterator[str]:
    parts = [part for part in (project, path) if part]
    for folder in folders:
        here = os.path.join(workspace, folder)
        yield os.path.join("/etc" if here == "/usr/etc" else here, *parts)
        if project and folder == "share":
            if workspace not in sources:
                sources[workspace] = source_paths(workspace)
            for source in sources[workspace]:
                if source not in packages:
                    packages[source] = {
                        package.name: str(package.path) for package in PackageIndex([Path(source)])
                    }
                if project in packages[source]:
                    yield os.path.join(packages[source][project], *([path] if path else []))
