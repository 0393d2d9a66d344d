"""Environments that contain both pipros and genuine ROS 2 from PyPI."""

import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

from tests.support.environments import REPOSITORY, ROOTS, VENV_BIN
from tests.support.ros2_wheels import environment

_REQUIRED = ("catkin_pkg", "dateutil", "distro", "docutils", "packaging", "pyparsing", "rospkg", "websockets")
"""The modules of pipros's requirements that the environment of ROS 2 lacks."""


def shared_environment(distro: str, folder: Path) -> Path:
    """Create an environment with a distribution and pipros in `folder`, and return its folder of programs.

    It has what pip would install: the wheels, pipros as an editable distribution, and its requirements.
    """
    made = environment(distro)
    # Temporary files may be in another file system, to which there are no hard links.
    option = "-al" if made.stat().st_dev == folder.parent.stat().st_dev else "-a"
    subprocess.run(["cp", option, made, folder], check=True)
    site = folder / "lib" / f"python{sys.version_info.major}.{sys.version_info.minor}" / "site-packages"
    for name in _REQUIRED:
        module = find_spec(name)
        assert module is not None
        assert module.origin is not None
        source = Path(module.origin)
        source = source.parent if source.stem == "__init__" else source
        (site / source.name).symlink_to(source)
    (site / "_pipros.pth").write_text("\n".join(map(str, ROOTS)) + "\n")
    shutil.copy(REPOSITORY / "packages" / "pipros" / "pipros.pth", site)
    programs = folder / "bin"
    for program in VENV_BIN.glob("*ros*"):
        text = program.read_bytes()
        if text.startswith(b"#!") and b"import main" in text:
            first = b"#!%b/python\n" % bytes(programs)
            (programs / program.name).write_bytes(first + text.partition(b"\n")[2])
            (programs / program.name).chmod(0o755)
    return programs
