"""Run unittest cases like rosunit, with one console line per case and a result file at the end.

Output from the cases is written to the result file, so that the console stays readable. The lines about cases
are written to the stream that was `sys.stdout` at the start of the run.
"""

# ruff: noqa: N802 - these are unittest's method names

from __future__ import annotations

import contextlib
import io
import sys
import time
import traceback
import unittest
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Any, TextIO

from pipros.basics.errors import PiprosError
from pipros_tools.testing.result_paths import prepare_path, write_results
from pipros_tools.testing.results import Case, Outcome, Suite
from pipros_tools.testing.xunit import format_suite

_SEPARATOR = "-" * 80
ErrorInfo = tuple[type[BaseException], BaseException, TracebackType] | tuple[None, None, None]


class CaseResult(unittest.TestResult):
    """A unittest result that prints `[Testcase: name] ... ok` and stores the cases for the result file."""

    def __init__(self, console: TextIO) -> None:
        super().__init__()
        self._console = console
        self._started_at = time.monotonic()
        self.cases: list[Case] = []

    def startTest(self, test: unittest.TestCase) -> None:
        super().startTest(test)
        self._started_at = time.monotonic()

    def addSuccess(self, test: unittest.TestCase) -> None:
        super().addSuccess(test)
        self._pass(test)

    def addSkip(self, test: unittest.TestCase, reason: str) -> None:
        super().addSkip(test, reason)
        self._pass(test)

    def addExpectedFailure(self, test: unittest.TestCase, err: Any) -> None:
        super().addExpectedFailure(test, err)
        self._pass(test)

    def addUnexpectedSuccess(self, test: unittest.TestCase) -> None:
        super().addUnexpectedSuccess(test)
        self._break(test, Outcome.FAILURE, "AssertionError", "passed, but was expected to fail\n")

    def addFailure(self, test: unittest.TestCase, err: Any) -> None:
        super().addFailure(test, err)
        self._break_by(test, Outcome.FAILURE, err)

    def addError(self, test: unittest.TestCase, err: Any) -> None:
        super().addError(test, err)
        self._break_by(test, Outcome.ERROR, err)

    def addSubTest(self, test: unittest.TestCase, subtest: unittest.TestCase, err: Any) -> None:
        super().addSubTest(test, subtest, err)
        if err is not None:
            is_failure = issubclass(err[0], test.failureException)
            self._break_by(subtest, Outcome.FAILURE if is_failure else Outcome.ERROR, err)

    def names(self, outcome: Outcome) -> list[str]:
        """Return the names of the cases with the given outcome, for the summary."""
        return [case.name for case in self.cases if case.outcome is outcome]

    def _pass(self, test: unittest.TestCase) -> None:
        self._keep(test, Outcome.PASSED, "", "")
        self._report(test, "ok")

    def _break_by(self, test: unittest.TestCase, outcome: Outcome, error: ErrorInfo) -> None:
        kind, value, frames = error
        shown = _frames_of_interest(frames)
        if not shown and not isinstance(value, (AssertionError, PiprosError)):
            shown = traceback.extract_tb(frames)  # an error in the tools themselves: keep the full traceback
        where = "".join(traceback.format_list(shown))
        self._break(test, outcome, kind.__name__ if kind else "", f"{value}\n{where}")

    def _break(self, test: unittest.TestCase, outcome: Outcome, kind: str, text: str) -> None:
        self._keep(test, outcome, kind, text)
        self._report(test, f"{outcome.name}!\n{outcome.name}: {text}{_SEPARATOR}")

    def _keep(self, test: unittest.TestCase, outcome: Outcome, kind: str, text: str) -> None:
        owner = type(getattr(test, "test_case", test))  # a sub-test is attributed to its case
        class_name = f"{owner.__module__}.{owner.__qualname__}"
        self.cases.append(
            Case(class_name, case_name(test), time.monotonic() - self._started_at, outcome, kind, text)
        )

    def _report(self, test: unittest.TestCase, text: str) -> None:
        # A single write, because programs started by a test write to the same console.
        print(f"[Testcase: {case_name(test)}] ... {text}", file=self._console, flush=True)


def case_name(test: unittest.TestCase) -> str:
    """Return the method's name, with the parameters of a sub-test: `test_levels (level=25)`."""
    path, space, more = test.id().partition(" ")
    return path.rpartition(".")[2] + space + more


def _frames_of_interest(frames: TracebackType | None) -> traceback.StackSummary:
    """Return the test's own frames, without the frames of unittest and the tools."""
    while frames is not None and "__unittest" in frames.tb_frame.f_globals:
        frames = frames.tb_next
    kept = []
    while frames is not None and "__unittest" not in frames.tb_frame.f_globals:
        kept.append((frames.tb_frame, frames.tb_lineno))
        frames = frames.tb_next
    return traceback.StackSummary.extract(iter(kept))


class XmlRunner:
    """A unittest runner that writes a result file only if the suite was completed.

    Therefore, a file without failures means that all cases passed.
    """

    def __init__(self, results_file: Path) -> None:
        self.results_file = results_file

    def run(self, suite: unittest.TestSuite | unittest.TestCase) -> CaseResult:
        """Run the suite, and write the result file, including the output to `sys.stdout` and `sys.stderr`.

        Raises:
            NoPlaceForResults: the result file cannot be written; raised before any case runs, if possible.
        """
        prepare_path(self.results_file)
        result, done = run_captured(suite)
        write_results(self.results_file, format_suite(done))
        return result


def run_captured(suite: unittest.TestSuite | unittest.TestCase) -> tuple[CaseResult, Suite]:
    """Run a suite. Return the result, and its cases with the output to `sys.stdout` and `sys.stderr`."""
    result = CaseResult(sys.stdout)
    started_at = time.monotonic()
    with _captured() as (stdout, stderr):
        suite(result)
    return result, Suite(
        name=f"{type(suite).__module__}.{type(suite).__qualname__}",
        cases=tuple(result.cases),
        seconds=time.monotonic() - started_at,
        stdout=stdout.getvalue(),
        stderr=stderr.getvalue(),
    )


@contextlib.contextmanager
def _captured() -> Iterator[tuple[io.StringIO, io.StringIO]]:
    stdout, stderr = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(stdout), contextlib.redirect_stderr(stderr):
        yield stdout, stderr
