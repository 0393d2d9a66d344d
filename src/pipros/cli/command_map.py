"""Lists all commands by purpose."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Iterable

import pipros

COMMANDS: dict[str, dict[str, str]] = {
    "Run": {
        "roscore": "start a master, the parameter server and /rosout",
        "rosmaster": "start a master alone",
        "rosrun": "run one program of a package",
        "roslaunch": "run the nodes of a launch file, with parameters and remappings",
        "roslaunch-check": "check launch files without starting anything",
        "roslaunch-deps": "list the packages that launch files need",
        "roslaunch-logs": "print the folder with the logs of the running system",
        "roslaunch-complete": "print the arguments of a launch file",
    },
    "Inspect and control a running system": {
        "rostopic": "list, print, measure and publish topics",
        "rosnode": "list, describe, ping and end nodes",
        "rosservice": "list, describe and call services",
        "rosparam": "list, read, set, save and load parameters",
        "rosconsole": "print log messages, and set logger levels",
        "rosgraph": "print which nodes are connected, after each change",
    },
    "See a running system in a browser": {
        "rqt_graph": "the graph, live, or as a picture",
        "rqt_topic": "topics with rates and their newest messages",
        "rqt_plot": "numeric fields as curves",
        "rqt_console": "log messages, with filters",
        "rqt_logger_level": "the logger levels of nodes",
        "rqt_top": "CPU and memory usage of nodes",
        "rqt_image_view": "images",
        "rqt_bag": "bags on a timeline",
        "rqt_tf_tree": "coordinate frames",
        "rviz": "robots, sensors and maps in 3D, from .rviz files",
        "rqt_robot_monitor": "diagnostics",
        "rqt_reconfigure": "parameters of dynamic_reconfigure",
        "rqt_service_caller": "list and call services",
        "rqt_publisher": "publish messages",
        "rqt": "all of these on one page",
        "pipros graph": "the same as rqt_graph",
        "pipros serve": "the page, and servers for rosbridge and Foxglove, on one port",
        "pipros clients": "list the clients of these servers",
        "pipros fleet": "join masters over a network; run, inspect and secure such a fleet",
        "pipros foxglove": "serve the system to Foxglove and Lichtblick",
        "pipros ros2": "connect the system to ROS 2 nodes",
    },
    "Find out what is wrong": {
        "pipros doctor": "check the environment, every node, topic and service, and say what to do",
        "roswtf": "Noetic's checks, with its messages",
        "rosclean": "report the size of log files, and delete them",
    },
    "Record and play": {
        "rosbag": "record, play, describe, repair and filter bag files",
    },
    "Look up messages, services and actions": {
        "rosmsg": "show, find and list messages",
        "rossrv": "show, find and list services",
        "rosaction": "show, find and list actions",
        "rosmsg-proto": "print a prototype of a message to fill in",
        "pipros stubs": "write type stubs for editors",
    },
    "Look at robot descriptions": {
        "check_urdf": "check a URDF, and print the tree of its links",
        "urdf_to_graphviz": "draw its links and joints",
        "urdf_to_graphiz": "the same, by its former name",
    },
    "Make packages and workspaces": {
        "catkin_create_pkg": "create a package",
        "catkin_init_workspace": "create the CMakeLists.txt of a workspace",
        "catkin_make": "build a workspace, install it, run its tests",
        "catkin_make_isolated": "build each package of a workspace in isolation",
        "catkin_find": "find files of packages in built workspaces",
        "catkin_topological_order": "list packages in the order of their dependencies",
        "pipros env": "print what the setup files of a workspace would set",
    },
    "Find packages": {
        "rospack": "find packages and their dependencies",
        "rosstack": "find stacks and their dependencies",
        "rosversion": "print the version of a package, or of the distribution",
        "pipros version": "print the versions of pipros and of Python",
    },
    "Test": {
        "rostest": "run the tests of a launch file, each with its own master",
        "rosunit": "run one test program without a ROS system",
        "catkin_test_results": "summarize test results",
    },
}
"""Headings, each with commands and their purposes. Only installed commands are printed."""


def installed_commands() -> set[str]:
    """Return the commands that the installed distribution provides."""
    try:
        points = importlib.metadata.distribution("pipros").entry_points
    except importlib.metadata.PackageNotFoundError:  # the command runs from a source tree
        return {name for commands in COMMANDS.values() for name in commands}
    return {point.name for point in points if point.group == "console_scripts"}


def command_map(subcommands: Iterable[str]) -> str:
    """Return a list of the installed commands, under headings. Commands not in `COMMANDS` come last.

    `subcommands` are the subcommands of `pipros`.
    """
    installed = installed_commands() | {f"pipros {name}" for name in subcommands}
    width = max(len(name) for name in installed)
    lines = [f"pipros {pipros.__version__}: ROS 1 from pip. Type a command with -h for its usage."]
    listed: set[str] = {"pipros", "pipros-complete"}
    for heading, commands in COMMANDS.items():
        present = {name: purpose for name, purpose in commands.items() if name in installed}
        listed |= present.keys()
        if present:
            lines += ["", f"{heading}:"]
            lines += [f"  {name:{width}}  {purpose}" for name, purpose in present.items()]
    others = sorted(installed - listed)
    if others:
        lines += ["", "Also there:", *(f"  {name}" for name in others)]
    return "\n".join(lines)
