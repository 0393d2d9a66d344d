"""A list of all commands, by purpose."""

from __future__ import annotations

import importlib.metadata

import pipros
from pipros.basics.plugins import plugins
from pipros_tools.cli.subcommands import subcommands

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
    "Find out what is wrong": {
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
    },
    "Look at robot descriptions": {
        "check_urdf": "check a URDF, and print the tree of its links",
        "urdf_to_graphviz": "draw a graph of a URDF's links and joints",
        "urdf_to_graphiz": "the same, under a former name",
    },
    "Make packages and workspaces": {
        "catkin_create_pkg": "create a package",
        "catkin_init_workspace": "create the CMakeLists.txt of a workspace",
        "catkin_make": "build a workspace, install it, run its tests",
        "catkin_make_isolated": "build each package of a workspace in isolation",
        "catkin_find": "find files of packages in built workspaces",
        "catkin_topological_order": "list packages in the order of their dependencies",
    },
    "Find packages": {
        "rospack": "find packages and their dependencies",
        "rosstack": "find stacks and their dependencies",
        "rosversion": "print the version of a package, or of the distribution",
    },
    "Test": {
        "rostest": "run the tests of a launch file, each with its own master",
        "rosunit": "run one test program without a ROS system",
        "catkin_test_results": "summarize test results",
    },
}
"""Headings, each with ROS programs and their purposes. Only installed programs are printed."""


PLUGINS_AFTER = "Inspect and control a running system"
"""The heading after which the headings of plugins are printed."""


def installed_programs() -> set[str]:
    """Return the programs that the installed distribution provides."""
    try:
        points = importlib.metadata.distribution("pipros").entry_points
    except importlib.metadata.PackageNotFoundError:  # the command runs from a source tree
        ours = {name for commands in COMMANDS.values() for name in commands}
        return ours.union(*(plugin.programs for plugin in plugins()))
    return {point.name for point in points if point.group == "console_scripts"}


def command_map() -> str:
    """Return a list of the installed commands, under headings. Commands without a purpose come last."""
    headings: dict[str, dict[str, str]] = {}
    for heading, commands in COMMANDS.items():
        headings[heading] = dict(commands)
        if heading == PLUGINS_AFTER:
            for plugin in plugins():
                named = {f"pipros {name}": each for name, each in plugin.subcommands.items()}
                named = {**plugin.programs, **named}
                for name, each in named.items():
                    headings.setdefault(each.heading, {})[name] = each.purpose
    installed = installed_programs()
    for name, each in subcommands().items():
        headings.setdefault(each.heading, {})[f"pipros {name}"] = each.purpose
        installed.add(f"pipros {name}")
    width = max(len(name) for name in installed)
    lines = [f"pipros {pipros.__version__}: ROS 1 from pip. Type a command with -h for its usage."]
    listed: set[str] = {"pipros", "pipros-complete"}
    for heading, commands in headings.items():
        present = {name: purpose for name, purpose in commands.items() if name in installed}
        listed |= present.keys()
        if present:
            lines += ["", f"{heading}:"]
            lines += [f"  {name:{width}}  {purpose}" for name, purpose in present.items()]
    others = sorted(installed - listed)
    if others:
        lines += ["", "Also installed:", *(f"  {name}" for name in others)]
    return "\n".join(lines)
