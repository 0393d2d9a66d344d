"""What pipros's own plugins provide, for advice where one of them is needed and not installed.

A test of the tree compares this table with the plugins.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from pipros.basics.plugin_folders import plugin_folders

NOT_INSTALLED = 127
"""The exit code of a shell that does not find a command."""


class KnownPlugin(NamedTuple):
    """A plugin of pipros.

    Attributes:
        purpose: what it is for, in a few words.
        commands: its programs, its subcommands of `pipros`, and those that it adds to other programs.
        packages: the ROS packages that it ships, separated by spaces.
        extras: the extras of its distribution, separated by spaces.
    """

    purpose: str
    commands: tuple[str, ...] = ()
    packages: str = ""
    extras: str = ""

    @property
    def distribution(self) -> str:
        """The name of its distribution."""
        return f"pipros-{next(name for name, each in PLUGINS.items() if each is self)}"


PLUGINS = {
    "assistants": KnownPlugin("tools for assistants", ("pipros mcp",)),
    "data": KnownPlugin("bags as tables", ("pipros dataset", "rosbag query", "rosbag table")),
    "fleet": KnownPlugin("masters joined over a network", ("pipros fleet",)),
    "robot": KnownPlugin(
        "perception and navigation",
        packages=(
            "amcl costmap_2d depth_image_proc depthimage_to_laserscan dwa_local_planner explore_lite "
            "gmapping hector_mapping image_proc imu_complementary_filter imu_filter_madgwick "
            "kobuki_safety_controller laser_assembler laser_filters laser_scan_matcher move_base navfn "
            "pcl_ros pointcloud_to_laserscan robot_localization robot_pose_ekf rplidar_ros "
            "stereo_image_proc urg_node yocs_cmd_vel_mux yocs_velocity_smoother"
        ),
        extras="drivers",
    ),
    "ros2": KnownPlugin(
        "the gateway to ROS 2", ("pipros port", "pipros ros2"), packages="pipros", extras="jazzy kilted zenoh"
    ),
    "tab": KnownPlugin("ROS in a browser tab"),
    "wheels": KnownPlugin(
        "wheels of ROS packages, for pip", ("pipros index", "pipros install", "pipros wheel", "rosdep")
    ),
}
"""The plugins by name: `pipros-NAME` installs `pipros_NAME`."""


def why_no_command(command: str) -> str | None:
    """Return which plugin has a command such as `pipros fleet`, and what installs it.

    Return None if no known plugin has it, or if this plugin is installed.
    """
    return _why(command, lambda plugin: command in plugin.commands)


def why_no_package(package: str) -> str | None:
    """Return the same for a ROS package."""
    return _why(package, lambda plugin: package in plugin.packages.split())


def why_no_module(name: str) -> str | None:
    """Return the same for an import of `pipros_NAME`."""
    return _why(name, lambda plugin: name == plugin.distribution.replace("-", "_"))


def distribution_of_package(package: str) -> str | None:
    """Return the distribution of the plugin that ships a ROS package, or None."""
    return next((each.distribution for each in PLUGINS.values() if package in each.packages.split()), None)


def _why(what: str, has_it: Callable[[KnownPlugin], bool]) -> str | None:
    from pipros.basics.extras import install_command

    plugin = next(filter(has_it, PLUGINS.values()), None)
    if plugin is None or plugin.distribution.replace("-", "_") in plugin_folders():
        return None
    name, purpose = plugin.distribution, plugin.purpose
    return f"{what} belongs to {name} ({purpose}), which is not installed. Try: {install_command(name)}"
