"""What pyproject.toml and the rooms say about the distribution."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from pipros.basics.rooms import own_rooms
from tests.support.environments import REPOSITORY

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


def load_toml(file: Path) -> dict[str, Any]:
    """Return the content of a TOML file."""
    return tomllib.loads(file.read_text(encoding="utf-8"))


PROJECT = load_toml(REPOSITORY / "pyproject.toml")
_HOOK = PROJECT["tool"]["hatch"]["metadata"]["hooks"]["custom"]

PROGRAMS: dict[str, str] = _HOOK["scripts"] | {
    name: each.target for room in own_rooms() for name, each in room.programs.items()
}
"""All programs of the distribution, and the functions that run them."""

EXTRAS: dict[str, list[str]] = _HOOK["extras"] | {
    name: list(needed) for room in own_rooms() for name, needed in room.extras.items()
}
"""All extras, and their requirements."""
