"""The names of the master that ROS code imports; a facade of `pipros.master`."""

from __future__ import annotations

from pipros.cli.rosmaster import main as rosmaster_main
from pipros.env import DEFAULT_MASTER_PORT

__all__ = ["DEFAULT_MASTER_PORT", "rosmaster_main"]
