"""Format a robot's tree as text, as in `check_urdf` and `urdf_to_graphviz`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from pipros_libraries.robot_model.urdf import Joint, Robot
from pipros_libraries.transforms.pose import roll_pitch_yaw

_DEEPEST: Final = 200
"""Depth from which lines are not indented further, so that the text of a long chain stays short."""


def tree_lines(robot: Robot) -> list[str]:
    """Return the links of a robot as an indented tree, in the format of `check_urdf`."""
    children = _children(robot)
    lines = [
        f"robot name is: {robot.name}",
        "---------- Successfully Parsed XML ---------------",
        f"root Link: {robot.root} has {len(children.get(robot.root, ()))} child(ren)",
    ]
    lines += [
        f"{'    ' * min(depth, _DEEPEST)}child({number}):  {joint.child}"
        for depth, number, joint in _walk(robot, children)
    ]
    return lines


def dot_lines(robot: Robot) -> list[str]:
    """Return a graph of links (boxes) and joints (ellipses) in Graphviz's DOT language.

    The edge from a parent link to a joint is labelled with the joint's origin.
    """
    joints = [joint for _, _, joint in _walk(robot, _children(robot))]
    lines = ["digraph G {", "node [shape=box];"]
    for link in (robot.root, *(joint.child for joint in joints)):
        lines.append(f"{_quoted(link)} [label={_quoted(link)}];")
    lines.append("node [shape=ellipse, color=blue, fontcolor=blue];")
    for joint in joints:
        place = " ".join(f"{value:g}" for value in joint.origin[:3])
        angles = " ".join(f"{value:g}" for value in roll_pitch_yaw(joint.origin))
        name = _quoted(joint.name)
        lines.append(f'{_quoted(joint.parent)} -> {name} [label="xyz: {place} \\nrpy: {angles}"]')
        lines.append(f"{name} -> {_quoted(joint.child)}")
    return [*lines, "}"]


def _children(robot: Robot) -> dict[str, list[Joint]]:
    """Return the child joints of each link, sorted by name as in urdfdom."""
    children: dict[str, list[Joint]] = {}
    for joint in sorted(robot.joints, key=lambda joint: joint.name):
        children.setdefault(joint.parent, []).append(joint)
    return children


def _walk(robot: Robot, children: dict[str, list[Joint]]) -> Iterator[tuple[int, int, Joint]]:
    """Yield the depth, number among siblings, and joint of each link below the root, depth first."""
    waiting = [(1, number, joint) for number, joint in enumerate(children.get(robot.root, ()), 1)][::-1]
    while waiting:
        depth, number, joint = waiting.pop()
        yield depth, number, joint
        below = enumerate(children.get(joint.child, ()), 1)
        waiting += [(depth + 1, number, joint) for number, joint in below][::-1]


def _quoted(name: str) -> str:
    return '"' + name.replace("\\", "\\\\").replace('"', '\\"') + '"'
