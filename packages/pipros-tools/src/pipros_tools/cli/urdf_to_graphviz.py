"""`urdf_to_graphviz`: draws the links and joints of a robot description, with Graphviz if it is installed."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from pipros.basics.replaced_file import write_whole
from pipros_libraries.robot_model.urdf import Robot
from pipros_libraries.robot_model.urdf_text import dot_lines
from pipros_tools.cli.check_urdf import FAILED, read_robot_file
from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import CommandError, run
from pipros_tools.graph.drawing.node_graph import Arrow, Key, NodeGraph, Vertex
from pipros_tools.graph.drawing.pdf import to_pdf
from pipros_tools.graph.drawing.scene import Scene, draw

USAGE = (
    "Usage: urdf_to_graphviz FILE [OUTPUT]: writes OUTPUT.gv and OUTPUT.pdf; without OUTPUT, both are named "
    "after the robot"
)
DOT_S = 60.0
"""Maximum run time of Graphviz."""
_DOT_LINKS = 1000
"""Maximum number of links that Graphviz draws, whose time grows with the square of their number."""


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Write the drawing, and return the exit code."""
    return _run(argv)


@command
def graphiz(argv: Sequence[str] | None = None) -> int:
    """Run the command under its former name, `urdf_to_graphiz`."""
    print("WARNING: urdf_to_graphiz is deprecated; use urdf_to_graphviz", file=sys.stderr)
    return _run(argv)


def _run(argv: Sequence[str] | None) -> int:
    arguments = list(sys.argv[1:] if argv is None else argv)
    return run(lambda: _draw(arguments), error_code=FAILED)


def _draw(arguments: list[str]) -> int:
    if len(arguments) not in (1, 2) or arguments[0] in ("-h", "--help"):
        print(USAGE, file=sys.stderr)
        return FAILED
    robot = read_robot_file(arguments[0])
    if len(arguments) == 1 and Path(robot.name).name != robot.name:
        raise CommandError(f"the robot's name, {robot.name!r}, cannot be used as a file name: add OUTPUT")
    output = arguments[1] if len(arguments) == 2 else robot.name
    drawing, pdf = f"{output}.gv", f"{output}.pdf"
    try:
        write_whole(Path(drawing), ("\n".join(dot_lines(robot)) + "\n").encode())
    except OSError as error:
        raise CommandError(f"cannot write {drawing}: {error.strerror}") from None
    print(f"Created file {drawing}")
    dot = shutil.which("dot") if len(robot.links) <= _DOT_LINKS else None
    try:
        write_whole(Path(pdf), _drawn(dot, Path(drawing)) if dot else to_pdf(_scene_of(robot)))
    except OSError as error:
        raise CommandError(f"cannot write {pdf}: {error.strerror}") from None
    except subprocess.SubprocessError as error:
        raise CommandError(f"cannot draw {pdf}: {error}") from None
    print(f"Created file {pdf}")
    return 0


def _drawn(dot: str, drawing: Path) -> bytes:
    words = [dot, "-Tpdf", str(drawing.resolve())]
    return subprocess.run(words, stdout=subprocess.PIPE, check=True, timeout=DOT_S).stdout  # noqa: S603


def _scene_of(robot: Robot) -> Scene:
    """Lay out the links as boxes, with the joints between them."""
    links = {name: Key("topic", name) for name in robot.links}
    joints = {joint: Key("node", joint.name) for joint in robot.joints}
    arrows = [
        arrow
        for joint, key in joints.items()
        for arrow in (Arrow(links[joint.parent], key, ""), Arrow(key, links[joint.child], ""))
    ]
    keys = (*links.values(), *joints.values())
    return draw(NodeGraph({key: Vertex(key) for key in keys}, tuple(arrows)))
