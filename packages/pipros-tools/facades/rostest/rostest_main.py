"""The command `rostest`."""

from __future__ import annotations

import os
import socket
import sys
from pathlib import Path

from pipros.basics.lazy_names import star_names as _star_names
from pipros.basics.replaced_file import write_whole as _write_whole
from rosgraph import roslogging
from rostest.rostest_parent import ROSTestLaunchParent
from rostest.rostestutil import (
    createXMLRunner,
    printRostestSummary,
    rostest_name_from_path,
    test_failure_junit_xml,
    xmlResultsFile,
)

__all__ = [
    "ROS_TEST_RESULTS_DIR",
    "ROSTestLaunchParent",
    "configure_logging",
    "createXMLRunner",
    "printRostestSummary",
    "rostest_name_from_path",
    "rostestmain",
    "write_bad_filename_failure",
    "xmlResultsFile",
]

_star_names(__name__, "logging os rosgraph roslaunch rospkg rostest sys time unittest")


ROS_TEST_RESULTS_DIR = "ROS_TEST_RESULTS_DIR"


def configure_logging() -> str | None:
    """Open the log file of a rostest. Print and return its path.

    Return None if its folder cannot be created.
    """
    file = roslogging.configure_logging(
        "rostest", filename=f"rostest-{socket.gethostname()}-{os.getpid()}.log"
    )
    if file:
        print(f"... logging to {file}")
    return file


def write_bad_filename_failure(test_file: str, results_file: str, outname: str) -> None:
    """Write a result file that reports a missing launch file."""
    path = Path(results_file)
    path.parent.mkdir(parents=True, exist_ok=True)
    _write_whole(path, test_failure_junit_xml(outname, f"rostest file [{test_file}] does not exist"))


def rostestmain() -> None:
    """Run the command with the command line of this process. Exit the process on failure."""
    from pipros_tools.cli.rostest import main

    code = main()
    if code:
        sys.exit(code)
