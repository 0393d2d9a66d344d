"""Drop-in replacement for Noetic's rosmaster; a facade of `pipros.master`."""

from __future__ import annotations

from pipros.basics.lazy_names import star_names as _star_names
from rosmaster.main import rosmaster_main
from rosmaster.master import DEFAULT_MASTER_PORT

__all__ = ["DEFAULT_MASTER_PORT", "rosmaster_main"]

_star_names(__name__, "rosmaster.exceptions rosmaster.main rosmaster.master")
