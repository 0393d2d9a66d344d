"""What CMake code of genuine catkin imports if it runs in the environment of pipros, as by `catkin build`."""

from __future__ import annotations

import sys
from typing import NoReturn


def generate_environment_script(env_script: str) -> NoReturn:  # noqa: ARG001
    """Ends with what to do: the message generators of genuine ROS, which come next, need their own Python."""
    sys.exit(
        f"genuine catkin was started with the Python of pipros ({sys.executable}), which lacks its modules. "
        "Build with catkin_make, or name the Python of genuine ROS: "
        "catkin build --cmake-args -DPYTHON_EXECUTABLE=/usr/bin/python3"
    )
