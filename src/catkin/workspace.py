"""`catkin.workspace`: built workspaces and the sources that they were built from."""

from pipros.workspace.overlays import MARKER as CATKIN_MARKER_FILE
from pipros.workspace.shared_files import source_paths as get_source_paths
from pipros.workspace.shared_files import workspaces as get_workspaces

__all__ = ["CATKIN_MARKER_FILE", "get_source_paths", "get_workspaces"]
