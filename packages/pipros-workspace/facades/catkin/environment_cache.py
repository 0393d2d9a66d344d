"""Stand-in for the module that genuine catkin's CMake code imports, for example during `catkin build`."""

from __future__ import annotations

import sys
from typing import NoReturn


def generate_environment_script(env_script: str) -> NoReturn:  # noqa: ARG001
    """Exit with instructions, because genuine catkin needs modules that only genuine ROS installs."""
    sys.exit(
        f"genuine catkin was started with pipros's Python ({sys.executable}), "
        "which lacks catkin's modules. Build with catkin_make, or use genuine ROS's Python: "
        "catkin build --cmake-args -DPYTHON_EXECUTABLE=/usr/bin/python3"
    )
