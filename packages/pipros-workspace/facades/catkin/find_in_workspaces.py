"""`catkin.find_in_workspaces`: search for package files in built workspaces."""

from catkin_pkg.packages import find_packages as find_packages

import catkin.workspace  # noqa: F401 # scripts use it as an attribute of `catkin`
from pipros_workspace.find_in_workspaces import find_in_workspaces as find_in_workspaces
from pipros_workspace.find_in_workspaces import source_paths as get_source_paths
from pipros_workspace.find_in_workspaces import workspaces as get_workspaces

__all__ = ["find_in_workspaces", "find_packages", "get_source_paths", "get_workspaces"]
