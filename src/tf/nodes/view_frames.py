"""`rosrun tf view_frames`, `rosrun tf2_tools view_frames.py`: draws the tree of frames."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import rospy
import tf2_ros

LISTEN_S = 5.0


def main() -> int:
    """Listens for five seconds, then writes frames.gv and, where Graphviz is installed, frames.pdf."""
    rospy.init_node("view_frames", anonymous=True)
    buffer = tf2_ros.Buffer(debug=False)
    listener = tf2_ros.TransformListener(buffer)
    print(f"Listening to tf data during {LISTEN_S:.0f} seconds...", flush=True)
    try:
        rospy.rostime.wallsleep(LISTEN_S)
    except KeyboardInterrupt:
        return 130
    listener.unregister()
    graph = Path("frames.gv")
    graph.write_text(buffer._allFramesAsDot(rospy.Time.now()), encoding="utf-8")
    print(f"{graph} generated")
    dot = shutil.which("dot")
    if dot is None:
        print("For frames.pdf install Graphviz, or draw frames.gv with another program.")
        return 0
    subprocess.run([dot, "-Tpdf", str(graph), "-o", "frames.pdf"], check=True)  # noqa: S603
    print("frames.pdf generated")
    return 0
