"""What the pyproject.toml files of pipros and its plugins say."""

import sys
from pathlib import Path
from typing import Any

from tests.support.environments import REPOSITORY

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


def load_toml(file: Path) -> dict[str, Any]:
    """Return the content of a TOML file."""
    return tomllib.loads(file.read_text(encoding="utf-8"))


PROJECT = load_toml(REPOSITORY / "pyproject.toml")
PLUGIN_PROJECTS = {
    file.parent.name: load_toml(file) for file in sorted(REPOSITORY.glob("plugins/*/pyproject.toml"))
}
"""The projects of the plugins, by the names of their folders."""

PROGRAMS: dict[str, str] = PROJECT["project"]["scripts"]
"""All programs of the distribution, and the functions that run them."""

EXTRAS: dict[str, list[str]] = PROJECT["project"]["optional-dependencies"]
"""All extras of pipros, and their requirements."""
