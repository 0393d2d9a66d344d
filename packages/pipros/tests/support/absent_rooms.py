"""Tests that need rooms which the tested installation lacks; see `script/rooms`."""

from __future__ import annotations

import re
import runpy
from functools import cache
from pathlib import Path

from tests.support.environments import REPOSITORY


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
        words += [rf"\b{name.rpartition('/')[2]}\b" for name in (*room.share, *room.facades)]
    return re.compile("|".join(words)) if words else None


def is_needed_by(path: Path) -> bool:
    """Return whether a test file uses something that only an absent room has."""
    pattern = _needs_absent_room()
    if pattern is None or path.suffix != ".py":
        return False
    text = f"{path.relative_to(REPOSITORY)}\n{path.read_text(encoding='utf-8')}"
    return pattern.search(text) is not None
