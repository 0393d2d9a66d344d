"""`rosrun tf view_frames`, `rosrun tf2_tools view_frames.py`: draw the frame tree."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import rospy
import tf2_ros
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.basics.replaced_file import write_whole
from pipros_tools.graph.drawing.node_graph import Arrow, Key, NodeGraph, Vertex
from pipros_tools.graph.drawing.pdf import to_pdf
from pipros_tools.graph.drawing.scene import Scene, draw
from pipros_tools.graph.drawing.svg import to_svg
from rospy.session import session

LISTEN_S = 5.0


def scene_of(edges: Sequence[tuple[str, str, str, float]]) -> Scene:
    """Lay out the frame tree. Each edge is (parent, child, publishing node, rate in Hz)."""
    names = dict.fromkeys(name for parent, child, *_ in edges for name in (parent, child))
    keys = {name: Key("node", name) for name in names}
    arrows = tuple(
        Arrow(keys[parent], keys[child], f"{rate:.1f} Hz {sender}") for parent, child, sender, rate in edges
    )
    return draw(NodeGraph({key: Vertex(key) for key in keys.values()}, arrows))


@exits_after_ctrl_c(130)
def main() -> int:
    """Listen for five seconds, then write frames.gv, frames.svg and frames.pdf to the working directory.

    Graphviz renders the PDF if it is installed. Return the exit code, which is 130 if the node was shut down
    early.
    """
    rospy.init_node("view_frames", anonymous=True)
    buffer = tf2_ros.Buffer(debug=False)
    listener = tf2_ros.TransformListener(buffer)
    print(f"Listening to tf data during {LISTEN_S:.0f} seconds...", flush=True)
    session.wait(LISTEN_S)
    if rospy.is_shutdown():
        return 130
    listener.unregister()
    graph = Path("frames.gv")
    write_whole(graph, buffer._allFramesAsDot(rospy.Time.now()).encode())
    print(f"{graph} generated")
    scene = scene_of(buffer._edges())
    write_whole(Path("frames.svg"), to_svg(scene).encode())
    print("frames.svg generated")
    dot = shutil.which("dot")
    if dot is not None:
        pdf = subprocess.run([dot, "-Tpdf", graph], stdout=subprocess.PIPE, check=True).stdout  # noqa: S603
    else:
        pdf = to_pdf(scene)
    write_whole(Path("frames.pdf"), pdf)
    print("frames.pdf generated")
    return 0
