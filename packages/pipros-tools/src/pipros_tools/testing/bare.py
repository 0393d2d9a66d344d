"""Run a test program as a unittest case, without a ROS system."""

from __future__ import annotations

import os
import subprocess
import sys
import unittest
from collections.abc import Sequence
from pathlib import Path

from pipros.basics.input_file import read_file
from pipros_tools.testing.result_paths import XML_OUTPUT_FLAG, prepare_path, results_file
from pipros_tools.testing.results import Suite
from pipros_tools.testing.rostest import TestProgramTimedOut
from pipros_tools.testing.xunit import parse_suites
from pipros_workspace.program_start import command_of, environment_of

# unittest's reports omit the frames of modules that define this variable.
__unittest = True


class BareTest:
    """A test program, and the suites from its result file."""

    def __init__(
        self,
        file: Path,
        arguments: Sequence[str],
        package: str,
        name: str,
        time_limit_s: float,
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
        """Return a test case that passes if the program exits and has written its results.

        If `text` is set, the program need not write results.
        """
        owner = self

        def run_test(case: unittest.TestCase) -> None:
            owner.run_once(case)

        kind = type(
            "BareTestCase", (unittest.TestCase,), {"runTest": run_test, "__module__": "rosunit.baretest"}
        )
        made: unittest.TestCase = kind()
        return made

    def run_once(self, case: unittest.TestCase) -> None:
        """Run the program until it exits.

        Raises:
            TestProgramTimedOut: the program exceeded its time limit.
            NoPlaceForResults: the result file cannot be written.
            AssertionError: the program cannot be started or wrote no results.
            UnreadableResults: the program wrote an invalid result file.
        """
        results = results_file(self._package, self._name)
        prepare_path(results)
        if not os.access(self._file, os.X_OK) and self._file.suffix != ".py":
            case.fail(f"test [{self._name}]: [{self._file}] does not exist or is not executable")
        arguments = [
            *self._arguments,
            XML_OUTPUT_FLAG + str(results),
            *(["--text"] if self._text else []),
        ]
        environment = environment_of(self._file, os.environ)
        if self._file.suffix == ".py" and not os.access(self._file, os.X_OK):
            command = [sys.executable, str(self._file), *arguments]
        else:
            command = command_of(self._file, arguments, variables=environment)
        try:
            subprocess.run(  # noqa: S603
                command, timeout=self._time_limit_s, env=environment, check=False
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
