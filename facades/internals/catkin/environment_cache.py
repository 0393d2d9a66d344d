"""Module that genuine catkin's CMake code imports in pipros's environment, for example in `catkin build`."""

from __future__ import annotations

import sys
from typing import NoReturn


def generate_environment_script(env_script: str) -> NoReturn:  # noqa: ARG001
    """Exit with instructions. Genuine catkin needs modules that are installed only with genuine ROS."""
    sys.exit(
        f"genuine catkin was started with the Python of pipros ({sys.executable}), which lacks its modules. "
        "Build with catkin_make, or name the Python of genuine ROS: "
        "catkin build --cmake-args -DPYTHON_EXECUTABLE=/usr/bin/python3"
    )
