"""Tests that need plugins which the tested installation or the source tree lacks; see `script/plugins`."""

import importlib.util
import re
from functools import cache
from pathlib import Path

from pipros.basics.plugin_table import PLUGINS
from tests.support.environments import REPOSITORY

DELETED = [name for name in PLUGINS if not (REPOSITORY / "plugins" / f"pipros-{name}").is_dir()]
"""The plugins whose folders were deleted."""

ABSENT = [name for name in PLUGINS if importlib.util.find_spec(f"pipros_{name}") is None]
"""The plugins that are not installed."""


@cache
def _needs_absent_plugin() -> re.Pattern[str] | None:
    """Return a pattern for what only absent plugins have: modules, folders, commands and packages.

    A test that shows in no other way what it needs has a comment `# needs the plugins: NAME, NAME`.
    """
    words: list[str] = []
    for name in ABSENT:
        plugin = PLUGINS[name]
        words += [rf"\bpipros_{name}\b", rf"plugins/pipros-{name}\b", rf"# needs the plugins: .*\b{name}\b"]
        words += [rf'[ "(`]{re.escape(each)}[ "`]' for each in plugin.commands if " " not in each]
        words += [each.replace(" ", r"\W+") + r"\b" for each in plugin.commands if " " in each]
        words += [rf"\b{each}\b" for each in plugin.packages.split() if each != "pipros"]
    return re.compile("|".join(words)) if words else None


def is_needed_by(path: Path) -> bool:
    """Return whether a test file uses something that only an absent plugin has."""
    pattern = _needs_absent_plugin()
    if path.suffix != ".py" or pattern is None:
        return False
    return pattern.search(f"{path.relative_to(REPOSITORY)}\n{path.read_text(encoding='utf-8')}") is not None
