"""Find pyright, the type checker in many editors, and say how to install it."""

import os
import shutil
import sys
from pathlib import Path

from tests.support.npm import INSTALL, MODULES

__all__ = ["INSTALL", "find_pyright"]


def find_pyright() -> str | None:
    """Return the path of pyright in this virtual environment or on PATH; None if it is not installed."""
    places = (MODULES / ".bin", Path(sys.prefix) / "bin", os.environ.get("PATH", os.defpath))
    return shutil.which("pyright", path=os.pathsep.join(map(str, places)))
