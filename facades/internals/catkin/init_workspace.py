"""`catkin.init_workspace`: the top-level `CMakeLists.txt` of a source folder."""

from __future__ import annotations

import os

from catkin.workspace import get_source_paths as get_source_paths
from catkin.workspace import get_workspaces as get_workspaces
from pipros.basics.lazy_names import star_names as _star_names
from pipros.cli.catkin_init_workspace import main as _main

_star_names(__name__, "shutil sys")


def init_workspace(workspace_dir: str) -> None:
    """Write the top-level `CMakeLists.txt` of a source folder, and print what was done.

    Raises:
        RuntimeError: the file already exists, or the folder does not exist.
    """
    file = os.path.join(workspace_dir, "CMakeLists.txt")
    if os.path.lexists(file):
        raise RuntimeError(f'File "{file}" already exists')
    if not os.path.isdir(workspace_dir):
        raise RuntimeError(f'Could not write "{file}": the folder does not exist')
    if _main([workspace_dir]):
        raise RuntimeError(f'Could not write "{file}"')
