"""Variables that catkin and CMake set before they read a package's `CMakeLists.txt`."""

from __future__ import annotations

import platform
import sys

from pipros.basics.windows import ON_WINDOWS
from pipros.workspace.catkin.project import PYTHON_DESTINATION


def package_variables(name: str, folder: str) -> dict[str, str]:
    """Return the variables for a package. Compiler variables are omitted, so they expand to empty strings."""
    system = {"darwin": "Darwin", "win32": "Windows"}.get(sys.platform, "Linux")
    return {
        "CATKIN_PACKAGE_BIN_DESTINATION": f"lib/{name}",
        "CATKIN_PACKAGE_LIB_DESTINATION": "lib",
        "CATKIN_PACKAGE_LIBEXEC_DESTINATION": f"lib/{name}",
        "CATKIN_PACKAGE_SHARE_DESTINATION": f"share/{name}",
        "CATKIN_PACKAGE_INCLUDE_DESTINATION": f"include/{name}",
        "CATKIN_PACKAGE_PYTHON_DESTINATION": f"{PYTHON_DESTINATION}/{name}",
        "CATKIN_PACKAGE_ETC_DESTINATION": f"etc/{name}",
        "CATKIN_GLOBAL_BIN_DESTINATION": "bin",
        "CATKIN_GLOBAL_LIB_DESTINATION": "lib",
        "CATKIN_GLOBAL_LIBEXEC_DESTINATION": "lib",
        "CATKIN_GLOBAL_SHARE_DESTINATION": "share",
        "CATKIN_GLOBAL_INCLUDE_DESTINATION": "include",
        "CATKIN_GLOBAL_PYTHON_DESTINATION": PYTHON_DESTINATION,
        "CATKIN_GLOBAL_ETC_DESTINATION": "etc",
        "PYTHON_INSTALL_DIR": PYTHON_DESTINATION,
        "PYTHON_EXECUTABLE": sys.executable,
        "CMAKE_SOURCE_DIR": folder,
        "CMAKE_CURRENT_SOURCE_DIR": folder,
        "CMAKE_SYSTEM_NAME": system,
        "CMAKE_SYSTEM_PROCESSOR": platform.machine(),
        "CMAKE_HOST_SYSTEM_NAME": system,
        "CMAKE_HOST_SYSTEM_PROCESSOR": platform.machine(),
        "CMAKE_VERSION": "3.16.3",
        "CMAKE_INSTALL_BINDIR": "bin",
        "CMAKE_INSTALL_LIBDIR": "lib",
        "CMAKE_INSTALL_DATADIR": "share",
        "CMAKE_INSTALL_SYSCONFDIR": "etc",
        ("WIN32" if ON_WINDOWS else "UNIX"): "1",
    }
