#!/usr/bin/env python3
"""Summarizes the test results of a package and of the packages that depend on it.

The exit code is 1 if a test failed.
"""

from __future__ import annotations

import sys
from optparse import OptionParser

import rospkg

from pipros_tools.cli.entry_point import command
from rosunit import junitxml


def main() -> int:
    parser = OptionParser(usage="usage: summarize_results.py [options] package")
    parser.add_option(
        "--nodeps", action="store_true", default=False, help="leave out the packages that depend on it"
    )
    options, packages = parser.parse_args()
    if len(packages) != 1:
        parser.error("Only one package may be specified")
    if not options.nodeps:
        packages += filter(None, rospkg.RosPack().get_depends_on(packages[0], implicit=True))
    result = junitxml.read_all(packages)
    print(summary(result, packages))
    return 1 if result.num_errors or result.num_failures else 0


def summary(result: junitxml.Result, packages: list[str]) -> str:
    has_failed = result.num_errors or result.num_failures
    bad = [case.description for case in result.test_case_results if not case.passed]
    lines = ["-" * 80, "\033[1m[AGGREGATED TEST RESULTS SUMMARY]\033[0m", ""]
    if bad:
        lines += ["ERRORS/FAILURES:", "".join(bad).removesuffix("\n")]
    lines += ["PACKAGES: ", *(f" * {package}" for package in packages), "", "", "SUMMARY"]
    lines.append("\033[1;31m * RESULT: FAIL\033[0m" if has_failed else "\033[32m * RESULT: SUCCESS\033[0m")
    lines.append(f" * TESTS: {result.num_tests}")
    for what, count in (("ERRORS", result.num_errors), ("FAILURES", result.num_failures)):
        line = f" * {what}: {count}"
        lines.append(f"\033[1;31m{line}\033[0m" if count else line)
    return "\n".join(lines) + "\n"


sys.exit(command(main)())
