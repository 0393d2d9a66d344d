"""`rosunit file [arguments]`: runs one test program without a ROS system, and collects its results."""

from __future__ import annotations

import os
import subprocess
import sys
import unittest
from collections.abc import Sequence
from optparse import OptionParser
from pathlib import Path

from pipros.cli.program import run
from pipros.cli.streams import command
from pipros.input_file import read_file
from pipros.interrupts import accept_ctrl_c
from pipros.testing.program import make_xml_runner
from pipros.testing.result_paths import XML_OUTPUT_FLAG, prepare_path, results_file
from pipros.testing.results import Suite, Totals
from pipros.testing.rostest import TestProgramTimedOut
from pipros.testing.summary import runner_summary
from pipros.testing.xunit import parse_suites
from pipros.workspace.index import PackageIndex
from pipros.workspace.interpreter import command_of, program_environment

# unittest leaves the frames of modules with this variable out of its reports.
__unittest = True

COULD_NOT_RUN = 1
CASES_FAILED = 2


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Returns 0 when all passed, 1 when the test could not run, 2 when cases of it failed."""
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
    # Everything after the file is for the test program, options included.
    parser.disable_interspersed_args()
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
        test = _BareTest(file, words[1:], package, name, options.time_limit or None, text=options.text_mode)
        return _run_as_text(test) if options.text_mode else _run(test, package, name)

    return run(body)


class _BareTest:
    """A test program, and the suites in its result file."""

    def __init__(
        self,
        file: Path,
        arguments: Sequence[str],
        package: str,
        name: str,
        time_limit_s: float | None,
        *,
        text: bool,
    ) -> None:
        self._file = file.absolute()
        self._arguments = arguments
        self._package = package
        self._name = name
        self._time_limit_s = time_limit_s
        self._text = text
        self.suites: list[Suite] = []

    def case(self) -> unittest.TestCase:
        """A case that passes when the program ended and wrote its results."""
        owner = self

        def run_test(case: unittest.TestCase) -> None:
            owner.run_once(case)

        kind = type(
            "BareTestCase", (unittest.TestCase,), {"runTest": run_test, "__module__": "rosunit.baretest"}
        )
        made: unittest.TestCase = kind()
        return made

    def run_once(self, case: unittest.TestCase) -> None:
        results = results_file(self._package, self._name)
        prepare_path(results)
        if not os.access(self._file, os.X_OK) and self._file.suffix != ".py":
            case.fail(f"test [{self._name}]: [{self._file}] does not exist or is not executable")
        command = [
            *command_of(self._file, [*self._arguments, XML_OUTPUT_FLAG + str(results)]),
            *(["--text"] if self._text else []),
        ]
        if self._file.suffix == ".py" and not os.access(self._file, os.X_OK):
            command.insert(0, sys.executable)
        try:
            subprocess.run(  # noqa: S603
                command, timeout=self._time_limit_s, env=program_environment(os.environ), check=False
            )
        except subprocess.TimeoutExpired:
            raise TestProgramTimedOut("test max time allotted") from None
        except OSError as error:
            case.fail(f"test [{self._name}] failed to launch: {error.strerror}")
        if self._text:
            return
        if not results.is_file():
            case.fail(f"test [{self._name}] did not generate test results")
        self.suites = parse_suites(read_file(results), str(results))


def _run(test: _BareTest, package: str, name: str) -> int:
    wrapper = results_file(package, name, is_rostest=True)
    result = make_xml_runner(package, name, wrapper, is_rostest=True).run(unittest.TestSuite([test.case()]))
    suites = [(f"{package}.rosunit-{name}", suite) for suite in test.suites]
    print(runner_summary(Suite("rosunit", tuple(result.cases)), suites, "ROSUNIT"))
    if not result.wasSuccessful():
        return COULD_NOT_RUN
    return 0 if Totals.of(test.suites).passed else CASES_FAILED


def _run_as_text(test: _BareTest) -> int:
    unittest.TextTestRunner(stream=sys.stdout, verbosity=2).run(test.case())
    print("WARNING: overall test result is not accurate when --text is enabled")
    return 0


def _package_of(file: Path) -> str | None:
    found = PackageIndex.from_environment().containing(file.absolute())
    return found.name if found else None


if __name__ == "__main__":
    sys.exit(main())
