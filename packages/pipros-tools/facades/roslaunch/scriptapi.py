"""`ROSLaunch`, which launches individual nodes from a script."""

from __future__ import annotations

from typing import Any

from roslaunch.core import Master, Node, RLException
from roslaunch.parent import ROSLaunchParent
from roslaunch.rlutil import get_or_generate_uuid

__all__ = ["Master", "Node", "RLException", "ROSLaunch"]


class ROSLaunch:
    """Launcher for individual nodes. `stop` ends all of them.

    >>> launch = ROSLaunch()                                            # doctest: +SKIP
    >>> launch.start()                                                  # doctest: +SKIP
    >>> process = launch.launch(Node("rospy_tutorials", "talker.py"))   # doctest: +SKIP
    >>> process.stop()                                                  # doctest: +SKIP
    """

    def __init__(self) -> None:
        self._files: list[str] = []
        self._texts: list[str] = []
        self.parent = ROSLaunchParent(
            get_or_generate_uuid(None, False), self._files, roslaunch_strs=self._texts, show_summary=False
        )
        self.started = False

    def load(self, f: str) -> None:
        """Add a launch file. Call this method before `start`."""
        self._files.append(f)

    def load_str(self, s: str) -> None:
        """Add a launch file, given as a string. Call this method before `start`."""
        self._texts.append(s)

    def start(self) -> None:
        """Start a master unless one responds, and launch the loaded files."""
        self.parent.start(auto_terminate=False)
        self.started = True

    def launch(self, node: Node) -> Any:
        """Start a node and return its process, which has `is_alive`, `stop`, `exit_code`, `pid` and `name`.

        Raises:
            RLException: the node cannot be started, or `start` was not called.
            ValueError: the argument is not a Node.
        """
        if not self.started or self.parent.runner is None:
            raise RLException("please start ROSLaunch first")
        if not isinstance(node, Node):
            raise ValueError("arg must be of type Node")
        process, is_started = self.parent.runner.launch_node(node)
        if not is_started:
            raise RLException(f"failed to launch {node.package}/{node.type}")
        return process

    def spin(self) -> None:
        """Block until the launch is over."""
        self.parent.spin()

    def spin_once(self) -> bool:
        """Return False if the launch is over."""
        return self.parent.spin_once()

    def stop(self) -> None:
        """Stop everything that was started."""
        self.parent.shutdown()
