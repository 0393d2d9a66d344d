"""Well-known packages and commands that pipros does not include, and advice on what to use instead.

This is the only such table: `rosrun`, `roslaunch`, `$(find)`, `rospack`, `roscd`, `rosmsg` and imports take
their advice from it.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping

from pipros.basics.windows import SETUP_FILE

# Imports that fail import this module, so each function imports the modules that only it needs.

_NAMES = """
    apriltag_ros ar_track_alvar aruco_ros audio_capture audio_play camera_info_manager
    carrot_planner cartographer_ros cv_camera darknet_ros depth_image_proc diff_drive_controller
    effort_controllers explore_lite filters find_object_2d freenect_launch gazebo gazebo_plugins
    gazebo_ros gazebo_ros_control global_planner hector_mapping hls_lfcd_lds_driver hokuyo_node
    image_proc image_publisher image_rotate joint_state_controller joint_trajectory_controller
    jsk_pcl_ros jsk_perception jsk_topic_tools mavros mavros_extras move_group
    moveit_ros_benchmarks moveit_ros_move_group moveit_ros_visualization moveit_ros_warehouse moveit_servo
    moveit_setup_assistant octomap_server
    opencv_apps openni2_camera openni2_launch position_controllers realsense2_camera
    robot_pose_ekf robot_pose_publisher ros_control rosserial_server rotate_recovery rtabmap_ros rtabmap_slam
    slam_karto spatio_temporal_voxel_layer stereo_image_proc teb_local_planner
    spacenav_node turtlebot3_gazebo uvc_camera velocity_controllers velodyne_driver
    velodyne_laserscan velodyne_pointcloud vesc_driver video_stream_opencv vrpn_client_ros web_video_server
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

_PYTHON_SOURCES = """
    ANYbotics/grid_map: grid_map_msgs
    OctoMap/octomap_msgs: octomap_msgs
    ROBOTIS-GIT/DynamixelSDK: dynamixel_sdk
    ROBOTIS-GIT/turtlebot3: turtlebot3_bringup turtlebot3_description turtlebot3_example
    ROBOTIS-GIT/turtlebot3: turtlebot3_navigation turtlebot3_slam turtlebot3_teleop
    ROBOTIS-GIT/turtlebot3_msgs: turtlebot3_msgs
    cartographer-project/cartographer_ros: cartographer_ros_msgs
    clearpathrobotics/robot_upstart: robot_upstart
    eric-wieser/ros_numpy: ros_numpy
    frankaemika/franka_ros: franka_msgs
    introlab/rtabmap_ros: rtabmap_msgs
    jsk-ros-pkg/jsk_common: dynamic_tf_publisher jsk_tools
    jsk-ros-pkg/jsk_common_msgs: jsk_footstep_msgs jsk_gui_msgs jsk_hark_msgs posedetection_msgs
    jsk-ros-pkg/jsk_recognition: jsk_recognition_msgs
    leggedrobotics/darknet_ros: darknet_ros_msgs
    mavlink/mavros: mavros_msgs
    moveit/moveit_msgs: moveit_msgs
    pal-robotics/aruco_ros: aruco_msgs
    ros-drivers/audio_common: audio_common_msgs sound_play
    ros-drivers/nmea_msgs: nmea_msgs
    ros-drivers/nmea_navsat_driver: libnmea_navsat_driver nmea_navsat_driver
    ros-drivers/rosserial: rosserial_msgs rosserial_python
    ros-drivers/velodyne: velodyne_msgs
    ros-geographic-info/geographic_info: geodesy
    ros-geographic-info/unique_identifier: unique_id
    ros-industrial/industrial_core: industrial_msgs
    ros-industrial/ros_canopen: can_msgs
    ros-industrial/ur_msgs: ur_msgs
    ros-perception/image_pipeline: camera_calibration
    ros-perception/radar_msgs: radar_msgs
    ros-perception/vision_msgs: vision_msgs
    ros-simulation/gazebo_ros_pkgs: gazebo_msgs
    ros-teleop/teleop_tools: joy_teleop key_teleop mouse_teleop teleop_tools_msgs
    ros/executive_smach: executive_smach smach smach_ros
    ros/kdl_parser: kdl_parser_py
    splintered-reality/py_trees_ros: py_trees_ros
    stonier/py_trees_msgs: py_trees_msgs
    swri-robotics/gps_umd: gps_common
    swri-robotics/marti_messages: marti_can_msgs marti_common_msgs marti_dbw_msgs marti_nav_msgs
    swri-robotics/marti_messages: marti_perception_msgs marti_sensor_msgs marti_status_msgs
    swri-robotics/marti_messages: marti_visualization_msgs
    turtlebot/turtlebot: turtlebot_teleop
    uos/rospy_message_converter: rospy_message_converter
    wg-perception/object_recognition_msgs: object_recognition_msgs
    wg-perception/people: people_msgs
    : turtlesim_cleaner
"""

_PYTHON = {
    name: repository.strip()
    for repository, _, names in (line.partition(":") for line in _PYTHON_SOURCES.strip().splitlines())
    for name in names.split()
}
"""Packages that consist of Python or of definitions, and their repositories on GitHub; '' if unknown."""

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


_EXPORT = "rosbag export writes the images of a bag"
_DISPLAYS = "a display of the type Map shows the same costmap"
_PROGRAMS: Mapping[str, Mapping[str, str]] = {
    "amcl": dict.fromkeys(("basic_localization.py", "set_pose.py"), ""),
    "controller_manager": dict.fromkeys(
        ("controller_group", "unspawner"), "rosrun controller_manager controller_manager stop NAME stops one"
    ),
    "costmap_2d": dict.fromkeys(("costmap_2d_cloud", "costmap_2d_markers"), _DISPLAYS),
    "gmapping": {"slam_gmapping_replay": "rosbag play --clock BAG and rosrun gmapping slam_gmapping do it"},
    "image_view": {
        **dict.fromkeys(("extract_images", "image_saver", "video_recorder"), _EXPORT),
        "stereo_view": "rosrun image_view image_view and disparity_view show its images",
    },
    "joy": {"joy_remap.py": ""},
    "laser_assembler": dict.fromkeys(
        ("merge_clouds", "periodic_snapshotter", "point_cloud2_assembler", "point_cloud_assembler"),
        "rosrun laser_assembler laser_scan_assembler assembles scans",
    ),
    "laser_filters": {
        "generic_laser_filter_node": "rosrun laser_filters scan_to_scan_filter_chain has replaced it"
    },
    "map_server": {"crop_map": ""},
    "pcl_ros": dict.fromkeys(("bag_to_pcd", "convert_pcd_to_image", "convert_pointcloud_to_image"), ""),
    "pointcloud_to_laserscan": {"laserscan_to_pointcloud_node": ""},
    "robot_localization": {"robot_localization_listener_node": ""},
    "rosunit": {"pycoverage_to_html.py": "coverage html writes such a report"},
    "rplidar_ros": {"rplidarNodeClient": "rostopic echo scan prints the scans"},
    "twist_mux": dict.fromkeys(("joystick_relay.py", "twist_marker"), ""),
    "urg_node": dict.fromkeys(("getID", "set_urg_ip.py"), ""),
    "xacro": {"xacro.py": "rosrun xacro xacro is its name since Noetic"},
}
"""Programs of Noetic that pipros's packages lack, and what to use instead; '' for the genuine package."""


def why_no_command(name: str) -> str | None:
    """Return advice on a command that the shell did not find, or None if the command is unknown."""
    from pipros.basics import plugin_table

    if why := plugin_table.why_no_command(name):
        return why
    if name == "xacro":
        from pipros.basics.extras import install_command

        return f"xacro is not installed. It comes from PyPI: {install_command('urdf')}"
    if name in _PYPI:
        return f"{name} is not part of pipros, but is on PyPI: pip install {_PYPI[name]}"
    for package, lacking in _PROGRAMS.items():
        if name in lacking:
            return why_not_here(package, (), name)
    return why_not_here(_PACKAGE_OF_COMMAND.get(name, ""))


def why_not_here(package: str, programs: Iterable[str] | None = None, program: str = "") -> str | None:
    """Return why pipros lacks a package or program and how to get it, or None if nothing is known about it.

    Args:
        programs: the package's programs that were found on this machine; None if the package itself was not
            found. If any of them is not a `.cfg` file, the package is here, and only `program` is missing.
        program: the program that was requested.
    """
    from pipros.basics.plugin_table import why_no_package

    if programs is None and (why := why_no_package(package)):
        return why
    if programs is not None and program in _PROGRAMS.get(package, ()):
        from pipros.packages.apt_names import how_to_have

        advice = f"{_PROGRAMS[package][program]}." if _PROGRAMS[package][program] else how_to_have([package])
        return f"pipros's {package} does not include {program}: {advice}"
    is_here = any(not name.endswith(".cfg") for name in programs or ())  # `.cfg` files are also executable
    if package in _PYTHON and programs is None:
        repository = _PYTHON[package]
        where = f"https://github.com/{repository} (a branch for ROS 1)" if repository else "them"
        return (
            f"{package} does not come with pipros, but needs no compiler: its sources on ROS_PACKAGE_PATH "
            f"are enough. git clone {where} into the src folder of a workspace."
        )
    if package in _DESKTOP and not is_here:
        return (
            f"{_DESKTOP[package]}. Run it where ROS 1 is installed: with this machine's ROS_MASTER_URI, it "
            "joins the same graph."
        )
    if package in _QT and not is_here:
        from pipros.basics.plugins import offered

        return (
            f"{package} is a plugin for a Qt desktop, and does not come with pipros: "
            f"{offered('rqt_plugins') or 'it shows no Qt plugins.'}"
        )
    if (package not in COMPILED and package not in _STARTING) or is_here:
        return None
    what = f"The programs of {package} are written in C++, and are not part of pipros, which is pure Python."
    if package in _STARTING:
        what = f"{package} starts programs in C++, which are not part of pipros: {_STARTING[package]}."
    from pipros.basics.plugins import all_offered
    from pipros.packages.apt_names import how_to_have

    instead = next((each[package] for each in all_offered("instead") if package in each), "")
    here = f" On this machine, {instead}" if instead else ""
    return f"{what} {how_to_have([package])}{here}"


def advice_on(package: str) -> str:
    """Return advice on a missing package of messages: how to get it, or the places that were searched."""
    from pipros.packages.installed_packages import find_of_ros2

    if folder := find_of_ros2(package):
        return f"{folder} is a package of ROS 2"
    path = os.environ.get("ROS_PACKAGE_PATH")
    searched = f"ROS_PACKAGE_PATH is {path}" if path else "ROS_PACKAGE_PATH is not set"
    if reason := why_not_here(package):
        return reason
    return f"{similar_packages(package)} {searched}; is {SETUP_FILE} of its workspace sourced?".lstrip()


def similar_packages(package: str) -> str:
    """Return a question that suggests packages with similar names; empty if there are none."""
    from pipros.basics.similar_names import similar_names
    from pipros.packages import SHARES
    from pipros.packages.package_folders import PackageFolders

    roots = [*os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep), *SHARES]
    return similar_names(package, PackageFolders([each for each in roots if os.path.isdir(each)]).by_name())


def why_no_nodelet(plugin: str) -> str:
    """Return why pipros cannot load a nodelet, and how to install the C++ plugin."""
    from pipros.packages.apt_names import how_to_have
    from pipros.packages.nodelets import package_of

    what = f"The nodelet {plugin} is a C++ plugin, which pipros, being pure Python, cannot load."
    return f"{what} {how_to_have(['nodelet'], [package_of(plugin)])}"
