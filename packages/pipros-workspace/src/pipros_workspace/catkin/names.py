"""The CMake commands of catkin and ROS packages, and packages that `find_package()` always finds."""

from __future__ import annotations

from collections.abc import Mapping

_MESSAGES = ("message_generation", "genmsg")
_ACTIONS = ("actionlib_msgs", "message_generation", "genmsg", "actionlib")
_ROSTEST = ("rostest",)
_ROSLAUNCH = ("roslaunch",)

CATKIN_COMMANDS: Mapping[str, tuple[str, ...] | None] = {
    "add_message_files": _MESSAGES,
    "add_service_files": _MESSAGES,
    "add_action_files": _ACTIONS,
    "generate_messages": (*_MESSAGES, *_ACTIONS),
    "add_rostest": _ROSTEST,
    "add_rostest_gtest": _ROSTEST,
    "add_rostest_gmock": _ROSTEST,
    "roslaunch_add_file_check": _ROSLAUNCH,
    "generate_dynamic_reconfigure_options": ("dynamic_reconfigure",),
    "catkin_package": None,
    "catkin_package_xml": None,
    "catkin_metapackage": None,
    "catkin_python_setup": None,
    "catkin_install_python": None,
    "catkin_add_gtest": None,
    "catkin_add_gmock": None,
    "catkin_add_nosetests": None,
    "catkin_add_env_hooks": None,
    "catkin_add_executable_with_gtest": None,
    "catkin_download_test_data": None,
    "catkin_download": None,
    "catkin_destinations": None,
    "catkin_workspace": None,
    "list_append_unique": None,
    "find_program_required": None,
    "em_expand": None,
    "debug_message": None,
    "assert": None,
    "class_loader_hide_library_symbols": None,
    "pluginlib_enable_plugin_testing": None,
    "roslint_cpp": None,
    "roslint_python": None,
    "roslint_add_test": None,
    "roslint_custom": None,
}
"""Commands of catkin and of ROS packages, each with the components that define it, the usual component first.

Any one of these components is sufficient; None for commands that need no component.
"""

COMPONENT_COMMANDS: Mapping[str, tuple[str, ...]] = {
    name: components for name, components in CATKIN_COMMANDS.items() if components is not None
}

INTERPRETED_PACKAGES = frozenset(name for names in COMPONENT_COMMANDS.values() for name in names)
"""Packages whose commands have handlers. Their own CMake files, which define these commands, are not run."""

CATKIN_VERSION = "0.8.10"
"""The catkin version that defines these commands; the value of `${catkin_VERSION}`."""

_CORE = """
    catkin cmake_modules cpp_common gencpp geneus genlisp genmsg gennodejs genpy message_filters
    message_generation message_runtime mk rosbag rosbag_storage rosbash rosboost_cfg rosbuild rosclean
    rosconsole roscpp roscpp_serialization roscpp_traits roscreate rosgraph roslang roslaunch roslib roslint
    roslz4 rosmake rosmaster rosmsg rosnode rosout rospack rosparam rospy rosservice rostest rostime rostopic
    rosunit roswtf tf2 tf2_py tf2_ros topic_tools xmlrpcpp actionlib pluginlib class_loader nodelet tf
"""

_COMPILED = """
    bondcpp camera_calibration camera_info_manager collada_parser collada_urdf depth_image_proc
    eigen_conversions eigen_stl_containers geometric_shapes image_proc image_publisher image_rotate image_view
    joint_state_publisher_gui kdl_conversions kdl_parser nodelet_topic_tools pcl_conversions pcl_ros
    python_qt_binding random_numbers ros_environment rosconsole_bridge roslisp rqt_gui_cpp rqt_gui_py
    self_test stereo_image_proc tf2_bullet tf2_eigen urdf urdf_parser_plugin
"""

CORE_PACKAGES = frozenset((*_CORE.split(), *_COMPILED.split()))
"""ROS packages that `find_package()` finds even if they have no folder.

pipros provides substitutes for some of them. The others contain C++ libraries or graphical programs, which
are not needed to build packages without compiled code.
"""
