"""The names of genuine `rosunit` that test scripts use; the work is done in `pipros.testing`."""

from __future__ import annotations

import sys
import unittest
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pipros.env import Environment
from pipros.testing import program, result_paths
from pipros.testing.result_paths import XML_OUTPUT_FLAG
from pipros.testing.runner import XmlRunner
from pipros.testing.summary import unittest_summary

__all__ = [
    "XML_OUTPUT_FLAG",
    "create_xml_runner",
    "print_unittest_summary",
    "rostest_name_from_path",
    "unitrun",
    "xml_results_file",
]


def unitrun(
    package: str,
    test_name: str,
    test: program.Tests,
    sysargs: Sequence[str] | None = None,
    coverage_packages: Sequence[str] | None = None,  # noqa: ARG001
) -> None:
    """Runs tests that need no ROS; ends the process with 1 when they do not pass.

    `coverage_packages` is accepted for genuine's sake; `coverage run` measures any test script.
    """
    program.exit_unless(
        program.run_program(package, test_name, test, sys.argv if sysargs is None else sysargs)
    )


def create_xml_runner(
    test_pkg: str, test_name: str, results_file: str | None = None, is_rostest: bool = False
) -> XmlRunner:
    """A unittest runner that leaves an xUnit file."""
    return program.make_xml_runner(test_pkg, test_name, results_file, is_rostest=is_rostest)


def print_unittest_summary(result: unittest.TestResult) -> None:
    """Prints how many tests ran, and which had errors and failures."""
    names: list[list[str]] = [
        [test.id().rpartition(".")[2] for test, _ in broken] for broken in (result.errors, result.failures)
    ]
    print(unittest_summary(result.testsRun, *names))


def xml_results_file(
    test_pkg: str, test_name: str, is_rostest: bool = False, env: dict[str, Any] | None = None
) -> str:
    """The path of a test's result file."""
    return str(
        result_paths.results_file(
            test_pkg, test_name, is_rostest=is_rostest, environment=Environment.from_os(env)
        )
    )


def rostest_name_from_path(pkg_dir: str, test_file: str) -> str:
    """The name of a launch file among the results of its package."""
    return result_paths.rostest_name(Path(pkg_dir), Path(test_file))
