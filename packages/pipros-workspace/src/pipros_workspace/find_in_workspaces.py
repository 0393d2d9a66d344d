"""`find_files` with the signature of catkin's Python function `find_in_workspaces`."""

from __future__ import annotations

from collections.abc import Iterable, MutableMapping
from pathlib import Path

from pipros.basics.input_file import read_text
from pipros_workspace.find_files import WrongFolders, find_files
from pipros_workspace.overlays import MARKER, BuiltWorkspace, built_workspaces


def workspaces() -> list[str]:
    """Return the built workspaces in `CMAKE_PREFIX_PATH`, topmost overlay first."""
    return [str(workspace.prefix) for workspace in built_workspaces()]


def source_paths(workspace: str) -> list[str]:
    """Return the source folders that a workspace was built from, or an empty list for an install space.

    Raises:
        ValueError: the folder is not a workspace.
    """
    marker = Path(workspace, MARKER)
    if not marker.is_file():
        raise ValueError(f'Not a catkin workspace: "{workspace}", missing file {marker}')
    return [path for path in read_text(marker).split(";") if path]


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
    """Return the existing paths `workspace/folder/project/path`; see `pipros_workspace.find_files`.

    Args:
        search_dirs: the folders; by default, all allowed folders.
        project: a package.
        path: a file or folder in the package.
        _workspaces: the workspaces to search instead of the workspaces in `CMAKE_PREFIX_PATH`.
        considered_paths: a list to which all checked paths are appended.
        first_matching_workspace_only, first_match_only: whether to stop at the first workspace with a match,
            or at the first match.
        workspace_to_source_spaces: known source folders by workspace. Missing entries are added.
        source_path_to_packages: accepted for compatibility; has no effect.

    Raises:
        ValueError: a search folder is not allowed, or a folder is not a workspace.
    """
    del source_path_to_packages
    known = {} if workspace_to_source_spaces is None else workspace_to_source_spaces
    spaces = []
    for workspace in workspaces() if _workspaces is None else _workspaces:
        if workspace not in known:
            known[workspace] = source_paths(workspace)
        spaces.append(BuiltWorkspace(Path(workspace), tuple(map(Path, known[workspace]))))
    try:
        found = find_files(
            spaces,
            project or "",
            path or "",
            list(search_dirs or ()),
            only_first_workspace=first_matching_workspace_only,
            only_first=first_match_only,
        )
    except WrongFolders as error:
        raise ValueError(str(error)) from None
    if considered_paths is not None:
        considered_paths += found.considered
    return found.existing
