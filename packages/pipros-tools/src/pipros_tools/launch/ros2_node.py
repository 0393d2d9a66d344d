"""Nodes of launch files that are scripts for rclpy: their arguments, and the Python that runs them.

rclpy reads no parameters of a ROS 1 master, so those of the launch file become arguments. ROS 2's format of
arguments is described in https://design.ros2.org/articles/ros_command_line_arguments.html.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from importlib.util import find_spec
from typing import Any

from pipros_tools.launch.model import LaunchNode

ARGUMENT = "ros2_python"
"""The argument of a launch file that names the Python with rclpy."""


def ros2_arguments(node: LaunchNode, params: Mapping[str, Any]) -> list[str]:
    """Return the arguments that give a node for rclpy its name, remappings and private parameters.

    Dictionaries become names with dots; `/use_sim_time` becomes the node's own.

    Args:
        params: the parameters of the launch, by full name.

    Raises:
        ValueError: ROS 2 has no parameter for a value; the message names it.
    """
    words = ["--ros-args", "-r", f"__node:={node.name}"]
    if node.namespace != "/":
        words += ["-r", f"__ns:={node.namespace.rstrip('/')}"]
    for source, target in node.remappings:
        words += ["-r", f"{source}:={target}"]
    for name, value in ros2_params(node, params):
        words += ["-p", f"{name}:={ros2_yaml(name, value)}"]
    return words


def why_no_rclpy() -> str | None:
    """Return advice if this Python has no rclpy."""
    if find_spec("rclpy") is not None:
        return None
    return (
        f"It imports rclpy, which this Python lacks. Name the one that has it: <arg name='{ARGUMENT}' "
        f"default='/path/to/ros2/bin/python'/> in the launch file, {ARGUMENT}:=... in the command, or the "
        "first line of the script"
    )


def ros2_params(node: LaunchNode, params: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the names and values of a node's private parameters in ROS 2."""
    private = f"{node.full_name}/"
    if params.get("/use_sim_time") is True and f"{private}use_sim_time" not in params:
        yield "use_sim_time", True
    for key, value in params.items():
        if key == node.full_name and isinstance(value, Mapping):
            yield from _flat("", value)
        elif key.startswith(private):
            yield from _flat(key[len(private) :].replace("/", "."), value)


def _flat(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    if not isinstance(value, Mapping):
        yield name, value
        return
    for key, inner in value.items():
        yield from _flat(f"{name}.{key}" if name else str(key), inner)


def ros2_yaml(name: str, value: Any) -> str:
    """Return the value of a parameter as `--ros-args` reads it.

    Raises:
        ValueError: ROS 2 has no parameter for it.
    """
    if isinstance(value, (list, tuple)):
        kinds = {type(each) for each in value}
        if kinds == {int, float}:
            value, kinds = [float(each) for each in value], {float}
        if len(kinds) <= 1 and kinds <= {bool, int, float, str}:
            return f"[{', '.join(map(_scalar, value))}]"
    elif isinstance(value, (bool, int, float, str)):
        return _scalar(value)
    raise ValueError(
        f"ROS 2 has no parameter for the value of ~{name}: it must be a truth value, a number, a text, "
        "or a list of one of these"
    )


def _scalar(value: bool | float | str) -> str:
    """Return the value in YAML: JSON, but for numbers that JSON lacks."""
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else f"{'-' if value < 0 else ''}.inf"
    return json.dumps(value, ensure_ascii=False)
