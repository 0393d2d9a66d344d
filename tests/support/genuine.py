"""Genuine ROS 1 from Debian's packages: check whether it is installed, and say how to install it."""

from __future__ import annotations

import os
from pathlib import Path

_MODULES = {
    "actionlib": "python3-actionlib",
    "angles": "python3-angles",
    "bond": "python3-bond",
    "bondpy": "python3-bondpy",
    "camera_calibration_parsers": "python3-camera-calibration-parsers",
    "cv_bridge": "python3-cv-bridge",
    "diagnostic_analysis": "python3-diagnostic-analysis",
    "diagnostic_common_diagnostics": "python3-diagnostic-common-diagnostics",
    "psutil": "python3-psutil",
    "diagnostic_updater": "python3-diagnostic-updater",
    "dynamic_reconfigure": "python3-dynamic-reconfigure",
    "image_geometry": "python3-image-geometry",
    "interactive_markers": "python3-interactive-markers",
    "laser_geometry": "python3-laser-geometry",
    "message_filters": "python3-message-filters",
    "paramiko": "python3-paramiko",
    "rosdep2": "python3-rosdep2",
    "rospy": "python3-rospy",
    "rosunit": "python3-rosunit",
    "smclib": "python3-smclib",
    "tf": "python3-tf",
    "tf2_kdl": "python3-tf2-kdl",
    "tf2_geometry_msgs": "python3-tf2-geometry-msgs",
    "tf2_sensor_msgs": "python3-tf2-sensor-msgs",
    "tf_conversions": "python3-tf-conversions",
    "topic_tools": "python3-topic-tools",
    "visualization_msgs": "python3-visualization-msgs",
}
_FILES = {
    "/usr/bin/catkin_make": "catkin",
    "/usr/bin/nosetests3": "python3-nose",
    "/usr/bin/pkg-config": "pkg-config",
    "/usr/bin/rosclean": "python3-rosclean",
    "/usr/bin/roslaunch": "python3-roslaunch",
    "/usr/bin/rosmaster": "python3-rosmaster",
    "/usr/bin/rosnode": "python3-rosnode",
    "/usr/bin/rospack": "rospack-tools",
    "/usr/bin/rosparam": "python3-rosparam",
    "/usr/bin/rosrun": "rosbash",
    "/usr/bin/rostest": "python3-rostest",
    "/usr/bin/rostopic": "python3-rostopic",
    "/usr/bin/roswtf": "python3-roswtf",
    "/usr/include/dynamic_reconfigure/server.h": "libdynamic-reconfigure-config-init-mutex-dev",
    "/usr/include/actionlib/action_definition.h": "libactionlib-dev",
    "/usr/include/bondcpp/bond.h": "libbondcpp-dev",
    "/usr/include/camera_info_manager/camera_info_manager.h": "libcamera-info-manager-dev",
    "/usr/include/nodelet/nodelet.h": "libnodeletlib-dev",
    "/usr/include/ros/ros.h": "libroscpp-dev",
    "/usr/include/std_msgs/String.h": "libstd-msgs-dev",
    "/usr/include/tf2_eigen/tf2_eigen.h": "libtf2-eigen-dev",
    "/usr/include/urdf/model.h": "liburdf-dev",
    "/usr/lib/x86_64-linux-gnu/libGeographicLib.so.23": "libgeographiclib23",
    "/usr/lib/x86_64-linux-gnu/libSDL_image-1.2.so.0": "libsdl-image1.2",
    "/usr/lib/x86_64-linux-gnu/liblaser_geometry.so.0d": "liblaser-geometry0d",
    "/usr/include/pcl_ros/filters/voxel_grid.h": "libpcl-ros-dev",
    "/usr/lib/pcl_ros/pcd_to_pointcloud": "pcl-ros-tools",
    "/usr/lib/image_proc/image_proc": "ros-image-proc",
    "/usr/lib/image_rotate/image_rotate": "ros-image-rotate",
    "/usr/lib/nodelet/nodelet": "libnodeletlib-tools",
    "/usr/share/image_proc/nodelet_plugins.xml": "libimage-proc-dev",
    "/usr/lib/tf2_ros/static_transform_publisher": "tf2-tools",
    "/usr/share/message_generation/package.xml": "ros-message-generation",
    "/usr/share/message_runtime/package.xml": "ros-message-runtime",
    "/usr/lib/topic_tools/relay": "topic-tools",
    "/usr/lib/camera_calibration_parsers/convert": "camera-calibration-parsers-tools",
    "/usr/lib/image_transport/republish": "image-transport-tools",
    "/usr/lib/joint_state_publisher/joint_state_publisher": "joint-state-publisher",
    "/usr/lib/robot_state_publisher/robot_state_publisher": "ros-robot-state-publisher",
}
PACKAGES = " ".join(
    (
        "camera-calibration-parsers-tools",
        "catkin",
        "image-transport-tools",
        "joint-state-publisher",
        "libdynamic-reconfigure-config-init-mutex-dev",
        "libactionlib-dev",
        "libbondcpp-dev",
        "libcamera-info-manager-dev",
        "libgeographiclib23",
        "libimage-proc-dev",
        "liblaser-geometry0d",
        "libnodeletlib-dev",
        "libnodeletlib-tools",
        "libpcl-ros-dev",
        "libroscpp-dev",
        "libsdl-image1.2",
        "libtf2-eigen-dev",
        "liburdf-dev",
        "pcl-ros-tools",
        "pkg-config",
        "python3-actionlib",
        "python3-actionlib-tools",
        "python3-angles",
        "python3-bond",
        "python3-bondpy",
        "python3-camera-calibration-parsers",
        "python3-cv-bridge",
        "python3-diagnostic-analysis",
        "python3-diagnostic-common-diagnostics",
        "python3-diagnostic-msgs",
        "python3-diagnostic-updater",
        "python3-dynamic-reconfigure",
        "python3-geometry-msgs",
        "python3-image-geometry",
        "python3-interactive-markers",
        "python3-laser-geometry",
        "python3-message-filters",
        "python3-nav-msgs",
        "python3-nose",
        "python3-paramiko",
        "python3-psutil",
        "python3-rosbag",
        "python3-rosclean",
        "python3-rosdep2",
        "python3-roslaunch",
        "python3-rosmsg",
        "python3-rosnode",
        "python3-rosparam",
        "python3-rospy",
        "python3-rosservice",
        "python3-rostest",
        "python3-rostopic",
        "python3-roswtf",
        "python3-sensor-msgs",
        "python3-smclib",
        "python3-std-srvs",
        "python3-tf",
        "python3-tf-conversions",
        "python3-tf2-geometry-msgs",
        "python3-tf2-kdl",
        "python3-tf2-ros",
        "python3-tf2-sensor-msgs",
        "python3-topic-tools",
        "python3-visualization-msgs",
        "ros-core-dev",
        "ros-image-proc",
        "ros-image-rotate",
        "ros-message-generation",
        "ros-message-runtime",
        "ros-robot-state-publisher",
        "ros-sensor-msgs",
        "rosbash",
        "rospack-tools",
        "tf-tools",
        "tf2-tools",
        "topic-tools",
    )
)
INSTALL = f"apt-get install --no-install-recommends {PACKAGES}"

OTHER_PROGRAMS = "fish git iproute2 nftables openssh-client openssh-server systemd zsh"
"""Debian packages with programs, other than those of ROS, that a few tests need."""


def missing_packages() -> list[str]:
    """Return the Debian packages that interop tests need and this machine lacks."""
    modules = Path("/usr/lib/python3/dist-packages")
    files = {package for path, package in _FILES.items() if not Path(path).exists()}
    return sorted(files | {package for name, package in _MODULES.items() if not (modules / name).is_dir()})


def is_required() -> bool:
    """Return True in continuous integration, where a missing peer is a failure instead of a skip."""
    return os.environ.get("CI", "").lower() in ("1", "true")


if __name__ == "__main__":
    print(PACKAGES, OTHER_PROGRAMS)
