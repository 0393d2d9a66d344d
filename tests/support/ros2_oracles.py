"""Genuine ROS 2 for tests of the gateway: relocatable builds, unpacked once per machine.

The archives are in `shared/oracles` beside the repository. `python -m tests.support.ros2_oracles` prints the
Debian packages that the builds need at run time, if there are archives.
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

from tests.support.environments import REPOSITORY
from tests.support.once import machine_folder, make_once

ARCHIVES = REPOSITORY.parent / "shared" / "oracles"
PYTHON = "/usr/bin/python3"
PACKAGES = (
    "iproute2 libddsc0debian libfastcdr1 libfastrtps2.9 libyaml-0-2 python3-argcomplete python3-numpy "
    "python3-packaging python3-psutil python3-yaml"
)
INSTALL = f"apt-get install --no-install-recommends {PACKAGES}"
_FILES = {
    "/usr/lib/x86_64-linux-gnu/libddsc.so.0debian": "libddsc0debian",
    "/usr/lib/x86_64-linux-gnu/libfastcdr.so.1": "libfastcdr1",
    "/usr/lib/x86_64-linux-gnu/libfastrtps.so.2.9": "libfastrtps2.9",
    "/usr/lib/python3/dist-packages/numpy": "python3-numpy",
    "/usr/lib/python3/dist-packages/packaging": "python3-packaging",
    "/usr/lib/python3/dist-packages/yaml": "python3-yaml",
}


@dataclass(frozen=True, slots=True)
class Ros2:
    """A distribution with one of its middlewares.

    Attributes:
        is_found: whether a gateway finds the nodes without settings; see docs/ros2.md.
    """

    distro: str
    rmw: str
    is_found: bool = True

    def __str__(self) -> str:
        return f"{self.distro}-{self.rmw}"

    @property
    def archive(self) -> Path:
        return ARCHIVES / f"ros2-{self.distro}-bookworm.tar.xz"

    def environment(self) -> dict[str, str]:
        """Return the variables of a shell that has sourced the build. The first call unpacks the archive."""
        folder = machine_folder(f"ros2_{self.distro}", [self.archive])
        make_once(folder, lambda: shutil.unpack_archive(self.archive, folder, filter="data"))
        root = folder / self.distro
        return {
            "AMENT_PREFIX_PATH": str(root),
            "HOME": str(folder),
            "LD_LIBRARY_PATH": str(root / "lib"),
            "PATH": f"{root / 'bin'}:/usr/bin:/bin",
            "PYTHONPATH": str(root / "lib" / "python3.11" / "site-packages"),
            "PYTHONUNBUFFERED": "1",
            "RMW_IMPLEMENTATION": f"rmw_{self.rmw}_cpp",
            "ROS_DISTRO": self.distro,
            "ROS_PYTHON_VERSION": "3",
            "ROS_VERSION": "2",
        }


ALL = (Ros2("humble", "fastrtps"), Ros2("humble", "cyclonedds", is_found=False), Ros2("jazzy", "cyclonedds"))


def missing() -> list[str]:
    """Return the files and Debian packages that the builds need and this machine lacks."""
    archives = sorted({str(each.archive) for each in ALL if not each.archive.exists()})
    return archives + sorted(package for path, package in _FILES.items() if not Path(path).exists())


if __name__ == "__main__":
    print(PACKAGES if any(each.archive.exists() for each in ALL) else "")
