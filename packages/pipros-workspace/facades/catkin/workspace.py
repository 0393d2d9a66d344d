"""`catkin.workspace`: built workspaces and their source folders."""

from pipros_workspace.find_in_workspaces import source_paths as get_source_paths
from pipros_workspace.find_in_workspaces import workspaces as get_workspaces
from pipros_workspace.overlays import MARKER as CATKIN_MARKER_FILE

__all__ = ["CATKIN_MARKER_FILE", "get_source_paths", "get_workspaces"]
