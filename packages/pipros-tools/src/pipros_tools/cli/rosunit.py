"""`rosunit file [arguments]`: runs one test program without a ROS system, and collects its results."""

from __future__ import annotations

import sys
import unittest
from collections.abc import Sequence
from optparse import OptionParser
from pathlib import Path

from pipros.basics.interrupts import accept_ctrl_c
from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import run
from pipros_tools.testing.bare import BareTest
from pipros_tools.testing.result_paths import results_file
from pipros_tools.testing.results import Suite, Totals
from pipros_tools.testing.script_runner import make_xml_runner
from pipros_tools.testing.summary import runner_summary
from pipros_workspace.index import PackageIndex

# unittest omits the stack frames of modules with this variable from its reports.
__unittest = True

COULD_NOT_RUN = 1
CASES_FAILED = 2


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run the program. Return 0 if all tests passed, 1 if it could not run, 2 if test cases failed.

    With `--text`, return 0 whenever the program's package is known.
    """
    accept_ctrl_c()
    parser = OptionParser(usage="usage: %prog [options] <file> [test args...]", prog="rosunit")
    parser.add_option(
        *("-t", "--text"),
        action="store_true",
        dest="text_mode",
        default=False,
        help="Run with stdout output instead of XML output",
    )
    parser.add_option(
        "--time-limit", metavar="TIME_LIMIT", type="float", default=60, help="Set time limit for test"
    )
    parser.add_option("--name", metavar="TEST_NAME", dest="test_name", help="Test name")
    parser.add_option("--package", metavar="PACKAGE_NAME", dest="pkg", help="Package name (optional)")
    options, words = parser.parse_args(list(sys.argv[1:] if argv is None else argv))
    if not words:
        parser.error("You must supply a test file.")
    file = Path(words[0])

    def body() -> int:
        package = options.pkg or _package_of(file)
        if not package:
            print(
                f"Error: failed to determine package name for file '{file}'; maybe you should supply the "
                "--package argument to rosunit?"
            )
            return COULD_NOT_RUN
        name = options.test_name or file.stem
        test = BareTest(file, words[1:], package, name, options.time_limit or 60.0, text=options.text_mode)
        return _run_as_text(test) if options.text_mode else _run(test, package, name)

    return run(body)


def _run(test: BareTest, package: str, name: str) -> int:
    wrapper = results_file(package, name, is_rostest=True)
    result = make_xml_runner(package, name, wrapper, is_rostest=True).run(unittest.TestSuite([test.case()]))
    suites = [(f"{package}.{results_file(package, name).stem}", suite) for suite in test.suites]
    print(runner_summary(Suite("rosunit", tuple(result.cases)), suites, "ROSUNIT"))
    if not result.wasSuccessful():
        return COULD_NOT_RUN
    return 0 if Totals.of(test.suites).passed else CASES_FAILED


def _run_as_text(test: BareTest) -> int:
    unittest.TextTestRunner(stream=sys.stdout, verbosity=2).run(test.case())
    print("WARNING: overall test result is not accurate when --text is enabled")
    return 0


def _package_of(file: Path) -> str | None:
    found = PackageIndex.from_environment().containing(file.absolute())
    return found.name if found else None


if __name__ == "__main__":
    sys.exit(main())
