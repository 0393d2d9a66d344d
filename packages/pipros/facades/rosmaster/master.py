"""`rosmaster.master`: an in-process master, for rostest and other code."""

from __future__ import annotations

from pipros.basics.env import DEFAULT_MASTER_PORT
from pipros.master import master

NUM_WORKERS = 3

__all__ = ["DEFAULT_MASTER_PORT", "NUM_WORKERS", "Master"]


class Master:
    """A ROS master. `start()` returns once the master accepts calls at `uri`."""

    def __init__(self, port: int = DEFAULT_MASTER_PORT, num_workers: int = NUM_WORKERS) -> None:
        """Set the port. `num_workers` is accepted for compatibility and has no effect."""
        self.port = port
        self.num_workers = num_workers
        self.uri: str | None = None
        self._master: master.Master | None = None

    def start(self) -> None:
        self._master = master.Master(port=self.port)
        self._master.start()
        self.port = self._master.port
        self.uri = self._master.uri

    @property
    def master_node(self) -> master.Master | None:
        """The server, or None before `start` and after `stop`."""
        return self._master

    @property
    def handler(self) -> master.Master | None:
        """The same as `master_node`; `pipros.master.api.MasterApi` handles the calls."""
        return self._master

    def ok(self) -> bool:
        """Return whether the master is running."""
        return self._master is not None

    def stop(self) -> None:
        master, self._master = self._master, None
        if master is not None:
            master.stop()
