"""`catkin.workspace`: built workspaces and their source folders."""

from pipros.basics.lazy_names import star_names as _star_names
from pipros.workspace.find_in_workspaces import source_paths as get_source_paths
from pipros.workspace.find_in_workspaces import workspaces as get_workspaces
from pipros.workspace.overlays import MARKER as CATKIN_MARKER_FILE

__all__ = ["CATKIN_MARKER_FILE", "get_source_paths", "get_workspaces"]

_star_names(__name__, "os")
