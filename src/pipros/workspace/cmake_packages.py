"""What catkin, and packages that CMake finds, set for a package without compiled code."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping

from pipros.workspace.project import PYTHON_DESTINATION


def usual_variables(name: str, folder: str) -> dict[str, str]:
    """What a package finds set; the lists of libraries and folders for a compiler are empty."""
    return {
        "CATKIN_PACKAGE_BIN_DESTINATION": f"lib/{name}",
        "CATKIN_PACKAGE_LIB_DESTINATION": "lib",
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
        "CMAKE_SYSTEM_NAME": {"darwin": "Darwin", "win32": "Windows"}.get(sys.platform, "Linux"),
        "CMAKE_VERSION": "3.16.3",
        "CMAKE_INSTALL_BINDIR": "bin",
        "CMAKE_INSTALL_LIBDIR": "lib",
        "CMAKE_INSTALL_DATADIR": "share",
        "CMAKE_INSTALL_SYSCONFDIR": "etc",
        ("WIN32" if os.name == "nt" else "UNIX"): "1",
    }


# Packages that bring no commands which a package without compiled code would call.
HARMLESS_PACKAGES = frozenset(
    ("Boost", "Threads", "PythonInterp", "PythonLibs", "Python", "Python2", "Python3", "Eigen3", "OpenCV")
)
HARMLESS_MODULES = frozenset(
    ("CMakeParseArguments", "CTest", "GNUInstallDirs", "CheckCXXCompilerFlag", "CheckCCompilerFlag")
)
FOUND_VARIABLES: Mapping[str, Mapping[str, str]] = {
    "PythonInterp": {"PYTHONINTERP_FOUND": "1", "PYTHON_VERSION_MAJOR": "3"},
    "Python3": {"Python3_EXECUTABLE": sys.executable, "Python3_Interpreter_FOUND": "1"},
    "Python": {"Python_EXECUTABLE": sys.executable, "Python_Interpreter_FOUND": "1"},
}
