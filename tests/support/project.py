"""What pyproject.toml and the rooms say about the distribution."""

from __future__ import annotations

import sys
from typing import Any

from pipros.basics.rooms import own_rooms
from tests.support.environments import REPOSITORY

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

PROJECT: dict[str, Any] = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))
_HOOK = PROJECT["tool"]["hatch"]["metadata"]["hooks"]["custom"]

PROGRAMS: dict[str, str] = _HOOK["scripts"] | {
    name: each.target for room in own_rooms() for name, each in room.programs.items()
}
"""All programs of the distribution, and the functions that run them."""

EXTRAS: dict[str, list[str]] = _HOOK["extras"] | {
    name: list(needed) for room in own_rooms() for name, needed in room.extras.items()
}
"""All extras, and their requirements."""
