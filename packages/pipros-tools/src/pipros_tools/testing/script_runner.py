"""Run Python test scripts: run the cases, write the result file, and print the summary.

`python -m pipros_tools.testing.script_runner PATH RESULTS` runs `unittest` cases without pytest, as nose did
for `catkin_add_nosetests`. PATH is a test file, or a folder with modules `test*.py`; RESULTS is the result
file.
"""

from __future__ import annotations

import os
import sys
import unittest
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

from pipros_tools.testing.result_paths import XML_OUTPUT_FLAG, results_file
from pipros_tools.testing.results import Outcome
from pipros_tools.testing.runner import XmlRunner, case_name
from pipros_tools.testing.summary import unittest_summary

Tests = type[unittest.TestCase] | unittest.TestSuite | ModuleType | str


def load_suite(tests: Tests) -> unittest.TestSuite:
    """Return the suite for a TestCase class, a module, a suite, or the dotted name of one of these."""
    if isinstance(tests, unittest.TestSuite):
        return tests
    loader = unittest.TestLoader()
    if isinstance(tests, str):
        return loader.loadTestsFromName(tests)
    if isinstance(tests, ModuleType):
        return loader.loadTestsFromModule(tests)
    return loader.loadTestsFromTestCase(tests)


def make_xml_runner(
    package: str, test_name: str, file: str | Path | None = None, *, is_rostest: bool = False
) -> XmlRunner:
    """Return a runner that writes to `file`, by default in the test results folder. Print the path."""
    name = os.path.basename(test_name)  # as in Noetic, unlike in the names of other result files
    path = Path(file) if file else results_file(package, name, is_rostest=is_rostest)
    print(f"[ROSUNIT] Outputting test results to {path}", flush=True)
    return XmlRunner(path)


def run_program(package: str, test_name: str, tests: Tests, argv: Sequence[str]) -> bool:
    """Run the tests in a script and print their summary. Return True if all passed.

    Args:
        argv: the script's command line. `--gtest_output=xml:FILE` sets the result file. `--text`
            selects unittest's own report on stderr, without a result file.
    """
    suite = load_suite(tests)
    result: unittest.TestResult
    if "--text" in argv:
        result = unittest.TextTestRunner(verbosity=2).run(suite)
        errors, failures = _names(result.errors), _names(result.failures)
    else:
        named = [arg.removeprefix(XML_OUTPUT_FLAG) for arg in argv if arg.startswith(XML_OUTPUT_FLAG)]
        ran = make_xml_runner(package, test_name, named[-1] if named else None).run(suite)
        result, errors, failures = ran, ran.names(Outcome.ERROR), ran.names(Outcome.FAILURE)
    print(unittest_summary(result.testsRun, errors, failures), flush=True)
    return result.wasSuccessful()


def _names(broken: Sequence[tuple[unittest.TestCase, str]]) -> list[str]:
    return [case_name(test) for test, _ in broken]


def exit_unless(passed: bool) -> None:
    """Exit with code 1 unless the tests passed."""
    if not passed:
        sys.exit(1)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the tests in a file or folder and write a result file. Return 0 if all passed, otherwise 1."""
    path, results = map(Path, sys.argv[1:] if argv is None else argv)
    folder, pattern = (path, "test*.py") if path.is_dir() else (path.parent, path.name)
    suite = unittest.TestLoader().discover(str(folder), pattern)
    return 0 if XmlRunner(results).run(suite).wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
