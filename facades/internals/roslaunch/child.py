"""`ROSLaunchChild`: starts nodes for a roslaunch on another machine."""

from __future__ import annotations

import logging

from pipros.basics.lazy_names import star_names as _star_names
from pipros.launch.child import Child
from pipros.launch.console import Console
from pipros.launch.run import RunOptions
from roslaunch.nodeprocess import DEFAULT_TIMEOUT_SIGINT, DEFAULT_TIMEOUT_SIGTERM

__all__ = ["DEFAULT_TIMEOUT_SIGINT", "DEFAULT_TIMEOUT_SIGTERM", "ROSLaunchChild"]

_star_names(__name__, "logging roslaunch traceback")


class ROSLaunchChild:
    """A launch child; `run` returns when the parent shuts it down or all nodes have exited."""

    def __init__(
        self,
        run_id: str,
        name: str,
        server_uri: str,
        sigint_timeout: float = DEFAULT_TIMEOUT_SIGINT,
        sigterm_timeout: float = DEFAULT_TIMEOUT_SIGTERM,
    ) -> None:
        self.logger = logging.getLogger("roslaunch.child")
        self.name = name
        self.server_uri = server_uri
        self.run_id = run_id
        self.sigint_timeout = sigint_timeout
        self.sigterm_timeout = sigterm_timeout
        options = RunOptions(
            is_child=True, sigint_timeout_s=sigint_timeout, sigterm_timeout_s=sigterm_timeout
        )
        self._child = Child(name, server_uri, run_id, options, Console(has_title=False))

    def run(self) -> None:
        """Register with the parent, and start the nodes that it requests. Blocks until shutdown.

        Raises:
            RLException: the parent cannot be reached.
        """
        try:
            self._child.start()
            self._child.wait()
        finally:
            self._child.stop()

    def shutdown(self) -> None:
        """End `run`. Thread-safe."""
        self._child.request_stop()
