"""The command `rostest`."""

from __future__ import annotations

import sys
from pathlib import Path

from rostest.rostest_parent import ROSTestLaunchParent
from rostest.rostestutil import (
    createXMLRunner,
    printRostestSummary,
    rostest_name_from_path,
    test_failure_junit_xml,
    xmlResultsFile,
)

__all__ = [
    "ROSTestLaunchParent",
    "createXMLRunner",
    "printRostestSummary",
    "rostest_name_from_path",
    "rostestmain",
    "write_bad_filename_failure",
    "xmlResultsFile",
]


def write_bad_filename_failure(test_file: str, results_file: str, outname: str) -> None:
    """Writes a result file that says that a launch file does not exist."""
    path = Path(results_file)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(test_failure_junit_xml(outname, f"rostest file [{test_file}] does not exist"))


def rostestmain() -> None:
    """The command, with the command line of this process. Ends the process when it fails."""
    from pipros.cli.rostest import main

    code = main()
    if code:
        sys.exit(code)
