"""pyright, the type checker inside many editors: where it is, and how to get it."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

from tests.support.npm import INSTALL, MODULES

__all__ = ["INSTALL", "find_pyright"]


def find_pyright() -> str | None:
    """Return the path of the program, in this virtual environment or else on the PATH."""
    places = (MODULES / ".bin", Path(sys.prefix) / "bin", os.environ.get("PATH", os.defpath))
    return shutil.which("pyright", path=os.pathsep.join(map(str, places)))
