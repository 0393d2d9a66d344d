"""Tests that need rooms which the tested installation or the source tree lacks; see `script/rooms`."""

from __future__ import annotations

import re
import runpy
from functools import cache
from pathlib import Path

from tests.support.environments import REPOSITORY

PACKAGES = {
    "pipros-assistants": ("assistants",),
    "pipros-bridges": ("bridges",),
    "pipros-data": ("data",),
    "pipros-fleet": ("fleet",),
    "pipros-page": ("web",),
    "pipros-robot": ("navigation", "perception", "simulation"),
    "pipros-ros2": ("ros2",),
    "pipros-tab": ("tab",),
    "pipros-wheels": ("wheels",),
}
"""The folders of `packages` that can be deleted, with their rooms."""

DELETED = [name for name in PACKAGES if not (REPOSITORY / "packages" / name).is_dir()]
DELETED_ROOMS = {room for name in DELETED for room in PACKAGES[name]}


def names_deleted_room(text: str) -> bool:
    """Return whether a text contains a module of a room whose folder was deleted.

    A test that uses only its commands has a comment `# needs the rooms: NAME, NAME`.
    """
    names = "|".join(DELETED_ROOMS)
    ways = rf"\bpipros[./](?:{names})\b|^# needs the rooms: .*\b(?:{names})\b"
    return bool(names) and re.search(ways, text, re.MULTILINE) is not None


@cache
def _needs_absent_room() -> re.Pattern[str] | None:
    """Return a pattern for what only absent rooms have: modules, commands, packages and limits."""
    import pipros

    installed = {file.parent.name for file in Path(pipros.__file__).parent.glob("*/room.py")}
    words: list[str] = []
    for file in sorted(REPOSITORY.glob("packages/*/src/pipros/*/room.py")):
        room = runpy.run_path(str(file))["ROOM"]
        if room.name in installed:
            continue
        words += [rf"pipros[./]{room.name}\b", rf"unit/{room.name}/"]
        words += [rf'[ "(`]{re.escape(name)}[ "`]' for name in room.programs]
        words += [rf"pipros\W+{name}\b" for name in room.subcommands]
        named = (name.rpartition("/")[2] for name in (*room.share, *room.facades))
        words += [rf"\b{name}\b" for name in named if name != "pipros"]  # every test names it
    return re.compile("|".join(words)) if words else None


def is_needed_by(path: Path) -> bool:
    """Return whether a test file uses something that only an absent room has."""
    pattern = _needs_absent_room()
    if path.suffix != ".py" or (pattern is None and not DELETED):
        return False
    text = f"{path.relative_to(REPOSITORY)}\n{path.read_text(encoding='utf-8')}"
    return names_deleted_room(text) or (pattern is not None and pattern.search(text) is not None)
