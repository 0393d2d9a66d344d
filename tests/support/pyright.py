"""Find or install pyright, the type checker inside many editors. It needs Node.js."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

INSTALL = "npm install --no-save --no-package-lock --prefix .venv pyright"


def find_pyright() -> str | None:
    """Return pyright's path in this virtual environment, else on the PATH."""
    environment = Path(sys.prefix)
    places = (environment / "node_modules" / ".bin", environment / "bin", os.environ.get("PATH", os.defpath))
    return shutil.which("pyright", path=os.pathsep.join(map(str, places)))


if __name__ == "__main__":
    print("" if find_pyright() else INSTALL)
