"""Well-known packages and commands that pipros does not include, and advice on what to use instead.

`rosrun`, `roslaunch`, `rosmsg` and imports of messages give the same advice.
"""

from __future__ import annotations

from collections.abc import Iterable

from pipros.basics.rooms import all_offered, offered
from pipros.packages.nodelets import package_of

_NAMES = """
    carrot_planner cartographer_ros depth_image_proc
    explore_lite filters freenect_launch gazebo gazebo_plugins
    gazebo_ros gazebo_ros_control global_planner hector_mapping hls_lfcd_lds_driver hokuyo_node
    image_proc image_publisher image_rotate mavros move_group
    moveit_ros_move_group moveit_ros_visualization moveit_setup_assistant octomap_server
    opencv_apps openni2_camera openni2_launch realsense2_camera
    robot_pose_ekf rosserial_server rotate_recovery rtabmap_ros
    slam_karto spatio_temporal_voxel_layer stereo_image_proc teb_local_planner
    turtlebot3_gazebo uvc_camera velodyne_driver
    velodyne_pointcloud web_video_server
"""

COMPILED = frozenset(_NAMES.split())
"""Noetic packages whose programs are mostly C++."""

_STARTING = {
    "hector_slam_launch": "hector_mapping",
    "husky_gazebo": "Gazebo",
}
"""Packages with launch files, and the C++ programs that the launch files start."""

_PACKAGE_OF_COMMAND = {
    "gazebo": "gazebo_ros",
    "gzclient": "gazebo_ros",
    "gzserver": "gazebo_ros",
}
_PYPI = {"catkin": "catkin-tools"}
"""Noetic commands, and the PyPI distributions that contain them."""

_PYTHON_NAMES = """
    executive_smach ros_numpy rosserial_python smach smach_ros sound_play
    turtlebot3_bringup turtlebot3_description turtlebot3_example turtlebot3_msgs
    turtlebot3_navigation turtlebot3_slam turtlebot3_teleop turtlebot_teleop turtlesim_cleaner
"""

_PYTHON = frozenset(_PYTHON_NAMES.split())
"""Packages from Noetic and from courses that do not contain C++ programs."""

_SOURCES = dict.fromkeys(("executive_smach", "smach", "smach_ros"), "https://github.com/ros/executive_smach")
"""Addresses of the packages' source repositories."""

_DESKTOP = {
    "moveit_commander": "moveit_commander calls a library in C++ and plans with move_group, also in C++",
    "smach_viewer": "smach_viewer needs wxPython, which pip cannot install without a compiler",
}
"""Packages whose Python programs need other software, and explanations for users."""

_QT_NAMES = """
    rqt_action rqt_bag_plugins rqt_common_plugins rqt_controller_manager rqt_dep
    rqt_joint_trajectory_controller rqt_launch rqt_msg rqt_nav_view rqt_pose_view rqt_py_console
    rqt_robot_dashboard rqt_robot_plugins rqt_runtime_monitor rqt_rviz rqt_shell rqt_srv
    rqt_web
"""

_QT = frozenset(_QT_NAMES.split())
"""rqt plugins that pipros does not replace."""


def why_no_command(name: str) -> str | None:
    """Return advice on a command that the shell did not find, or None if the command is unknown."""
    if name in _PYPI:
        return f"{name} is not part of pipros, but is on PyPI: pip install {_PYPI[name]}"
    return why_not_here(_PACKAGE_OF_COMMAND.get(name, ""))


def why_not_here(package: str, programs: Iterable[str] | None = None) -> str | None:
    """Return why pipros lacks a program and how to install it, or None if the package is unknown.

    Args:
        programs: the package's programs that were found on this machine; None if the package itself was not
            found. If any of them is not a `.cfg` file, nothing is missing, and the result is None.
    """
    is_here = any(not name.endswith(".cfg") for name in programs or ())  # `.cfg` files are also executable
    if package in _PYTHON and programs is None:
        where = f"git clone {_SOURCES[package]}" if package in _SOURCES else "git clone them"
        return (
            f"{package} does not come with pipros, but needs no compiler: its sources on ROS_PACKAGE_PATH "
            f"are enough. {where} into the src folder of a workspace."
        )
    if package in _DESKTOP and not is_here:
        return (
            f"{_DESKTOP[package]}. Run it where ROS 1 is installed: with this machine's ROS_MASTER_URI, it "
            "joins the same graph."
        )
    if package in _QT and not is_here:
        return (
            f"{package} is a plugin for a Qt desktop, and does not come with pipros: "
            f"{offered('rqt_plugins') or 'it shows no Qt plugins.'}"
        )
    if (package not in COMPILED and package not in _STARTING) or is_here:
        return None
    what = f"The programs of {package} are written in C++, and are not part of pipros, which is pure Python."
    if package in _STARTING:
        what = f"{package} starts programs in C++, which are not part of pipros: {_STARTING[package]}."
    instead = next((each[package] for each in all_offered("instead") if package in each), "")
    here = f" On this machine, {instead}" if instead else ""
    from pipros.packages.apt_names import how_to_have

    return f"{what} {how_to_have([package])}{here}"


def why_no_nodelet(plugin: str) -> str:
    """Return why pipros cannot load a nodelet, and how to install the C++ plugin."""
    from pipros.packages.apt_names import how_to_have

    what = f"The nodelet {plugin} is a C++ plugin, which pipros, being pure Python, cannot load."
    return f"{what} {how_to_have(['nodelet'], [package_of(plugin)])}"
