"""Real clients for bridges: roslib for Node.js and browsers, two versions of roslibpy, and Foxglove's client.

`python -m tests.support.bridge_clients` installs them into `.venv`.
"""

import shutil
import subprocess
import sys
from pathlib import Path

INSTALL = ".venv/bin/python -m tests.support.bridge_clients"
ROSLIBPY = {"2": "roslibpy>=2,<3", "1.8": "roslibpy==1.8.*"}
"""Versions of roslibpy that are tested: the newest one, and the last one based on Twisted."""

_CLIENTS = Path(sys.prefix) / "clients"
MODULES = _CLIENTS / "node_modules"
_ROSLIB = "roslib@2"
_FOXGLOVE = {
    "@foxglove/ws-protocol": "0.8", "@foxglove/rosmsg": "5", "@foxglove/rosmsg-serialization": "2", "ws": "8",
}  # fmt: skip
"""Foxglove's implementation of its protocol, its decoder for ROS 1 messages, and a WebSocket library."""


def roslib() -> Path:
    """Return the path of the roslib file that Node.js and browsers import."""
    return MODULES / "roslib" / "dist" / "RosLib.js"


def roslibpy_python(version: str) -> Path:
    """Return the Python interpreter of the virtual environment with a version of roslibpy."""
    return _CLIENTS / f"roslibpy-{version}" / "bin" / "python"


def missing() -> list[str]:
    """Return what the tests of rosbridge need and this machine lacks."""
    lacking = [] if shutil.which("node") else ["node"]
    lacking += [] if roslib().exists() else ["roslib"]
    return lacking + [f"roslibpy {each}" for each in ROSLIBPY if not _has_roslibpy(each)]


def missing_foxglove() -> list[str]:
    """Return what Foxglove's client needs and this machine lacks."""
    lacking = [] if shutil.which("node") else ["node"]
    return lacking + [name for name in _FOXGLOVE if not (MODULES / name).is_dir()]


def _has_roslibpy(version: str) -> bool:
    folder = roslibpy_python(version).parent.parent
    return any(folder.glob("lib/python*/site-packages/roslibpy"))


def install() -> None:
    """Install the missing clients. Node.js must be installed."""
    if not roslib().exists() or missing_foxglove():
        options = ("--no-save", "--no-package-lock", "--prefix", str(_CLIENTS))
        packages = [_ROSLIB, *(f"{name}@{version}" for name, version in _FOXGLOVE.items())]
        subprocess.run(["npm", "install", *options, *packages], check=True)
    for version, requirement in ROSLIBPY.items():
        if not _has_roslibpy(version):
            python = roslibpy_python(version)
            subprocess.run([sys.executable, "-m", "venv", str(python.parent.parent)], check=True)
            subprocess.run([str(python), "-m", "pip", "install", "--quiet", requirement], check=True)


if __name__ == "__main__":
    install()
