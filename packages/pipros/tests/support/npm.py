"""Development tools from npm: their names, their location, and the command that installs them.

They need Node.js. `python -m tests.support.npm` prints the command, or an empty line if all are installed.
"""

import json
import sys
from pathlib import Path

from tests.support.environments import file_of_tests

MODULES = Path(sys.prefix) / "node_modules"
_FILE = file_of_tests("page/package.json")
_LISTED = json.loads(_FILE.read_text())["devDependencies"] if _FILE.exists() else {}
PACKAGES = tuple(f"{name}@{version}" for name, version in _LISTED.items())
"""Installed by one command, because npm removes packages that its command line does not name."""
INSTALL = f"npm install --no-save --no-package-lock --prefix .venv {' '.join(PACKAGES)}"


def missing() -> list[str]:
    """Return the names of the packages that are not in the virtual environment."""
    return [name for name in _LISTED if not (MODULES / name).is_dir()]


if __name__ == "__main__":
    print(INSTALL if missing() else "")
