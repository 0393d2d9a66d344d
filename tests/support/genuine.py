"""Genuine ROS 1 from Debian's packages: is it there, and what to do when it is not."""

from __future__ import annotations

import os
from pathlib import Path

_NEEDED = {
    "/usr/bin/rosmaster": "python3-rosmaster",
    "/usr/bin/roslaunch": "python3-roslaunch",
    "/usr/lib/python3/dist-packages/paramiko/__init__.py": "python3-paramiko",
    "/usr/bin/rostest": "python3-rostest",
    "/usr/bin/rostopic": "python3-rostopic",
    "/usr/bin/rosnode": "python3-rosnode",
    "/usr/bin/rosparam": "python3-rosparam",
    "/usr/bin/rosclean": "python3-rosclean",
    "/usr/bin/rospack": "rospack-tools",
    "/usr/bin/roswtf": "python3-roswtf",
    "/usr/lib/python3/dist-packages/rosdep2/__init__.py": "python3-rosdep2",
    "/usr/bin/nosetests3": "python3-nose",
    "/usr/bin/pkg-config": "pkg-config",
    "/usr/bin/rosrun": "rosbash",
    "/usr/bin/catkin_make": "catkin",
    "/usr/lib/python3/dist-packages/rospy/__init__.py": "python3-rospy",
    "/usr/lib/python3/dist-packages/rosunit/__init__.py": "python3-rosunit",
    "/usr/lib/python3/dist-packages/tf/__init__.py": "python3-tf",
    "/usr/lib/python3/dist-packages/tf2_geometry_msgs/__init__.py": "python3-tf2-geometry-msgs",
    "/usr/lib/python3/dist-packages/tf2_sensor_msgs/__init__.py": "python3-tf2-sensor-msgs",
    "/usr/lib/python3/dist-packages/tf_conversions/__init__.py": "python3-tf-conversions",
    "/usr/lib/python3/dist-packages/message_filters/__init__.py": "python3-message-filters",
    "/usr/lib/python3/dist-packages/actionlib/__init__.py": "python3-actionlib",
    "/usr/lib/python3/dist-packages/dynamic_reconfigure/__init__.py": "python3-dynamic-reconfigure",
    "/usr/lib/python3/dist-packages/diagnostic_updater/__init__.py": "python3-diagnostic-updater",
    "/usr/lib/tf2_ros/static_transform_publisher": "tf2-tools",
    "/usr/include/ros/ros.h": "libroscpp-dev",
    "/usr/share/message_generation/package.xml": "ros-message-generation",
    "/usr/share/message_runtime/package.xml": "ros-message-runtime",
    "/usr/include/std_msgs/String.h": "libstd-msgs-dev",
}
PACKAGES = (
    "ros-core-dev python3-rospy python3-rostest python3-roslaunch python3-rostopic python3-rosnode "
    "python3-rosservice python3-rosparam python3-rosmsg python3-rosbag rosbash libroscpp-dev catkin "
    "ros-message-generation ros-message-runtime python3-sensor-msgs python3-geometry-msgs python3-nav-msgs "
    "python3-std-srvs python3-diagnostic-msgs python3-tf2-ros python3-actionlib topic-tools "
    "python3-tf python3-tf2-geometry-msgs python3-tf2-sensor-msgs python3-message-filters tf2-tools "
    "python3-dynamic-reconfigure python3-diagnostic-updater python3-tf-conversions "
    "python3-paramiko python3-nose python3-rosdep2 python3-rosclean python3-roswtf rospack-tools pkg-config"
)
INSTALL = f"apt-get install --no-install-recommends {PACKAGES}"

OTHER_PROGRAMS = "fish git iproute2 openssh-client openssh-server zsh"
"""Debian packages of programs that are no ROS, and that single tests need."""


def missing_packages() -> list[str]:
    """The Debian packages that interop tests need and this machine lacks; empty when all is there."""
    return sorted({package for path, package in _NEEDED.items() if not Path(path).exists()})


def is_required() -> bool:
    """True in continuous integration, where a missing peer is a failure, not a reason to leave tests out."""
    return os.environ.get("CI", "").lower() in ("1", "true")


if __name__ == "__main__":
    print(PACKAGES, OTHER_PROGRAMS)
