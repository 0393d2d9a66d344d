"""Output functions of rostest, and rosunit functions under the names that rostest gives them."""

from __future__ import annotations

import sys
import unittest

import rosunit
from pipros.basics.lazy_names import star_names as _star_names
from rosunit.junitxml import Result, test_failure_junit_xml, test_success_junit_xml

__all__ = [
    "createXMLRunner",
    "getErrors",
    "printRostestSummary",
    "printSummary",
    "printlog",
    "printlogerr",
    "rostest_name_from_path",
    "test_failure_junit_xml",
    "test_success_junit_xml",
    "xmlResultsFile",
]

_star_names(__name__, "logging os rosunit sys")

rostest_name_from_path = rosunit.rostest_name_from_path
printSummary = rosunit.print_unittest_summary  # noqa: N816  # Noetic's name
createXMLRunner = rosunit.create_xml_runner  # noqa: N816
xmlResultsFile = rosunit.xml_results_file  # noqa: N816

_latest: list[unittest.TestResult] = []


def printlog(msg: str, *args: object) -> None:
    """Print to standard output; `args` are the arguments for `%` formatting."""
    print(f"[ROSTEST]{msg % args if args else msg}")


def printlogerr(msg: str, *args: object) -> None:
    """Print to standard error; `args` are the arguments for `%` formatting."""
    print(f"[ROSTEST]{msg % args if args else msg}", file=sys.stderr)


def printRostestSummary(result: unittest.TestResult, rostest_results: Result) -> None:
    """Print the result of each test case, and the programs that could not run."""
    _latest[:] = [result]
    rosunit.print_runner_summary(result, rostest_results, runner_name="ROSTEST")


def getErrors() -> object:
    """Return the errors in the last printed result, or None if no result was printed."""
    return _latest[0].errors if _latest else None
