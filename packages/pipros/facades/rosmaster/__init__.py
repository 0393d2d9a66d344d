"""Drop-in replacement for Noetic's rosmaster; a facade of `pipros.master`."""

from __future__ import annotations

from rosmaster.main import rosmaster_main
from rosmaster.master import DEFAULT_MASTER_PORT

__all__ = ["DEFAULT_MASTER_PORT", "rosmaster_main"]
