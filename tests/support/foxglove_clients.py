"""Foxglove's own client library for Node.js, and its decoder of ROS 1 messages, in a folder of their own.

python -m tests.support.foxglove_clients prints the command that installs them, if they are missing.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

_FOLDER = Path(sys.prefix) / "clients" / "foxglove"
_PACKAGES = "@foxglove/ws-protocol@0.8 @foxglove/rosmsg@5 @foxglove/rosmsg-serialization@2 ws@8"
INSTALL = f"npm install --no-save --no-package-lock --prefix .venv/clients/foxglove {_PACKAGES}"
MODULES = _FOLDER / "node_modules"


def missing() -> list[str]:
    """What this machine lacks."""
    wanted = [f"@foxglove/{name}" for name in ("ws-protocol", "rosmsg", "rosmsg-serialization")] + ["ws"]
    lacking = [name for name in wanted if not (MODULES / name).is_dir()]
    return lacking if shutil.which("node") else ["node", *lacking]


if __name__ == "__main__":
    print(INSTALL if missing() else "")
