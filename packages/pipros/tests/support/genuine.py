"""Genuine ROS 1 from Debian's packages: check whether it is installed, and say how to install it."""

import os
from functools import cache
from pathlib import Path

_NAMES = """
camera-calibration-parsers-tools catkin image-transport-tools joint-state-publisher libactionlib-dev
libbondcpp-dev libcamera-info-manager-dev libdepth-image-proc-dev
libdynamic-reconfigure-config-init-mutex-dev libimage-proc-dev libnodeletlib-dev libnodeletlib-tools
libpcl-ros-dev libroscpp-dev libstereo-image-proc-dev libtf2-eigen-dev liburdf-dev pcl-ros-tools pkg-config
python3-actionlib python3-actionlib-tools python3-angles python3-bond python3-bondpy
python3-camera-calibration python3-camera-calibration-parsers python3-cv-bridge python3-diagnostic-analysis
python3-diagnostic-common-diagnostics python3-diagnostic-msgs python3-diagnostic-updater
python3-dynamic-reconfigure python3-geometry-msgs python3-image-geometry python3-interactive-markers
python3-laser-geometry python3-message-filters python3-nav-msgs python3-nose python3-paramiko python3-psutil
python3-rosbag python3-rosclean python3-rosdep2 python3-roslaunch python3-rosmsg python3-rosnode
python3-rosparam python3-rospy python3-rosservice python3-rostest python3-rostopic python3-roswtf
python3-sensor-msgs python3-smclib python3-std-srvs python3-tf python3-tf-conversions
python3-tf2-geometry-msgs python3-tf2-kdl python3-tf2-ros python3-tf2-sensor-msgs python3-topic-tools
python3-visualization-msgs ros-camera-calibration ros-core-dev ros-image-proc ros-image-rotate
ros-message-generation ros-message-runtime ros-robot-state-publisher ros-sensor-msgs ros-stereo-image-proc
rosbash rospack-tools tf-tools tf2-tools topic-tools
"""
PACKAGES = " ".join(_NAMES.split())
INSTALL = f"apt-get install --no-install-recommends {PACKAGES}"

OTHER_PROGRAMS = "fish git iproute2 libpython3-dev nftables openssh-client openssh-server systemd zsh"
"""Debian packages with programs or headers, other than those of ROS, that a few tests need."""

_INSTALLED = Path("/var/lib/dpkg/info")


@cache
def missing_packages() -> list[str]:
    """Return the Debian packages of ROS that interop tests need and this machine lacks."""
    names = {file.stem.partition(":")[0] for file in _INSTALLED.glob("*.md5sums")}
    return [name for name in PACKAGES.split() if name not in names]


def is_required() -> bool:
    """Return True in continuous integration, where a missing peer is a failure instead of a skip."""
    return os.environ.get("CI", "").lower() in ("1", "true")


if __name__ == "__main__":
    print(PACKAGES, OTHER_PROGRAMS)
