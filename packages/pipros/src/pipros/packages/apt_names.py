"""Find the apt packages that contain genuine programs and nodelets, if the running distribution has them.

Debian has fewer ROS 1 packages than Noetic for Ubuntu 20.04, and under different names. The tables were taken
from the file lists of Debian 12's packages; Debian 13 and 14 have packages with the same names.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_text

OS_RELEASE = "/etc/os-release"

PROGRAM_PACKAGES: Mapping[str, str] = {
    "camera_calibration": "ros-camera-calibration",
    "image_proc": "ros-image-proc",
    "image_publisher": "ros-image-publisher",
    "image_rotate": "ros-image-rotate",
    "nodelet": "libnodeletlib-tools",
    "opencv_apps": "ros-opencv-apps",
    "pcl_ros": "pcl-ros-tools",
    "stereo_image_proc": "ros-stereo-image-proc",
}
"""Debian's packages that contain the programs of ROS packages, by ROS package."""

PLUGIN_PACKAGES: Mapping[str, str] = {
    "depth_image_proc": "libdepth-image-proc-dev",
    "image_proc": "libimage-proc-dev",
    "image_publisher": "libimage-publisher-dev",
    "image_rotate": "libimage-rotate-dev",
    "image_view": "libimage-view-dev",
    "opencv_apps": "libopencv-apps-dev",
    "pcl_ros": "libpcl-ros-dev",
    "stereo_image_proc": "libstereo-image-proc-dev",
}
"""Debian's packages that contain the nodelet descriptions of ROS packages, by ROS package."""


class AptDistribution(NamedTuple):
    """The running Linux distribution.

    Attributes:
        name: the name for messages to users.
        is_noetics: whether Noetic's own packages were built for this distribution.
        is_debian: whether Debian's packages can be installed on this distribution.
    """

    name: str
    is_noetics: bool = False
    is_debian: bool = False


def running_distribution() -> AptDistribution:
    """Return the distribution that this machine's `os-release` file names."""
    try:
        text = read_text(OS_RELEASE, errors="replace")
    except (PiprosError, OSError):
        return AptDistribution("This system")
    pairs = (line.partition("=") for line in text.splitlines())
    values = {name: value.strip("\"'") for name, _, value in pairs}
    name = values.get("NAME", "This system").removesuffix(" GNU/Linux")
    if "focal" in (values.get("VERSION_CODENAME"), values.get("UBUNTU_CODENAME")):
        return AptDistribution(name, is_noetics=True)
    family = [values.get("ID", ""), *values.get("ID_LIKE", "").split()]
    return AptDistribution(name, is_debian="debian" in family)


def how_to_have(programs: Sequence[str], plugins: Sequence[str] = ()) -> str:
    """Return a sentence that says how to install ROS packages here, or where else they can run.

    Args:
        programs: packages whose programs are needed.
        plugins: packages whose nodelets are needed.
    """
    noetic = " ".join(f"ros-noetic-{name.replace('_', '-')}" for name in (*programs, *plugins))
    here = running_distribution()
    graph = "with this machine's ROS_MASTER_URI, it joins the same graph."
    if here.is_noetics:
        return f"Install it (apt-get install {noetic}), or run it on another machine: {graph}"
    known = [
        *((name, PROGRAM_PACKAGES.get(name) or PLUGIN_PACKAGES.get(name)) for name in programs),
        *((name, PLUGIN_PACKAGES.get(name)) for name in plugins),
    ]
    missing = [name for name, package in known if package is None or not here.is_debian]
    if not missing:
        names = " ".join(str(package) for _, package in known)
        return f"{here.name} has it: apt-get install {names}"
    return (
        f"{here.name} has no package for {' or '.join(missing)}. Run it where ROS 1 Noetic is installed "
        f"(Ubuntu 20.04: apt-get install {noetic}): {graph}"
    )
