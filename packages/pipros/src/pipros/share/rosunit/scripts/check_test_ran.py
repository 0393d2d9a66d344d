#!/usr/bin/env python3
"""Writes a result file that reports a failure if a test has not written its result file."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import rospkg

import rosunit
import rosunit.junitxml
from pipros.basics.replaced_file import write_whole
from pipros_tools.cli.entry_point import command

USAGE = """\
Usage:
\tcheck_test_ran.py test-file.xml
or
\tcheck_test_ran.py --rostest pkg-name test-file.xml
"""


def main(words: list[str]) -> int:
    files = [word for word in words if word != "--rostest"]
    is_rostest = len(files) < len(words)
    if len(words) != (3 if is_rostest else 1):
        print(USAGE, file=sys.stderr)
        return 64  # EX_USAGE of sysexits.h
    file = files[-1]
    if is_rostest:  # the argument is the test file, not its result file
        folder = rospkg.RosPack().get_path(rospkg.get_package_name(file))
        name = rosunit.rostest_name_from_path(folder, file)
        file = rosunit.xml_results_file(files[0], name, is_rostest=True)
    print(f"Checking for test results in {file}")
    if not os.path.exists(file):
        print("Cannot find results, writing failure results to", file)
        os.makedirs(os.path.dirname(os.path.abspath(file)), exist_ok=True)
        name = os.path.basename(file)
        reason = f"Unable to find test results for {name}, test did not run.\nExpected results in {file}"
        write_whole(Path(file), rosunit.junitxml.test_failure_junit_xml(name, reason))
    return 0


sys.exit(command(main)(sys.argv[1:]))
