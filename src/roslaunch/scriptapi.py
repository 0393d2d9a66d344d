"""`ROSLaunch`: launches single nodes from a script."""

from __future__ import annotations

from roslaunch.core import Node, RLException
from roslaunch.parent import ROSLaunchParent
from roslaunch.pmon import Process
from roslaunch.rlutil import get_or_generate_uuid


class ROSLaunch:
    """Launches nodes one by one; `stop` ends them all.

    >>> launch = ROSLaunch()                                            # doctest: +SKIP
    >>> launch.start()                                                  # doctest: +SKIP
    >>> process = launch.launch(Node("rospy_tutorials", "talker.py"))   # doctest: +SKIP
    >>> process.stop()                                                  # doctest: +SKIP
    """

    def __init__(self) -> None:
        self._files: list[str] = []
        self._texts: list[str] = []
        self.parent: ROSLaunchParent | None = None
        self.started = False

    def load(self, f: str) -> None:
        """Adds a launch file; to be called before `start`."""
        self._files.append(f)

    def load_str(self, s: str) -> None:
        """Adds a launch file as text; to be called before `start`."""
        self._texts.append(s)

    def start(self) -> None:
        """Starts a master, unless one answers, and what was loaded."""
        run_id = get_or_generate_uuid(None, False)
        self.parent = ROSLaunchParent(run_id, self._files, roslaunch_strs=self._texts, show_summary=False)
        self.parent.start(auto_terminate=False)
        self.started = True

    def launch(self, node: Node) -> Process:
        """Starts a node.

        Raises:
            RLException: it cannot be started, or `start` was not called.
        """
        if self.parent is None:
            raise RLException("please start ROSLaunch first")
        run = self.parent.session.run
        try:
            process = run.start(node.to_model())
        except Exception as error:
            raise RLException(f"failed to launch {node.package}/{node.type}: {error}") from error
        return Process(process, run, node.package)

    def spin(self) -> None:
        """Waits until the launch is over."""
        self._running.spin()

    def spin_once(self) -> bool:
        return self._running.spin_once()

    def stop(self) -> None:
        """Ends all nodes."""
        if self.parent is not None:
            self.parent.shutdown()

    @property
    def _running(self) -> ROSLaunchParent:
        if self.parent is None:
            raise RLException("please start ROSLaunch first")
        return self.parent
