"""`catkin.cmake`: the location of catkin's CMake modules."""

from catkin.find_in_workspaces import find_in_workspaces as find_in_workspaces
from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "os")


def get_cmake_path() -> str:
    """Return the folder of genuine catkin's CMake modules, which pipros itself does not use.

    Raises:
        RuntimeError: no workspace in `CMAKE_PREFIX_PATH` contains a genuine catkin.
    """
    found = find_in_workspaces(["share"], "catkin", "cmake")
    if not found:
        raise RuntimeError("Could not determine catkin cmake path: no genuine catkin in CMAKE_PREFIX_PATH")
    return found[0]
