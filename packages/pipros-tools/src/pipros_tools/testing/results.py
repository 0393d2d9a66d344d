"""The results of a test run, as cases in suites."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum


class Outcome(Enum):
    """Outcome of a test case. FAILURE is a failed assertion, ERROR any other exception."""

    PASSED = "passed"
    FAILURE = "failure"
    ERROR = "error"


@dataclass(frozen=True, slots=True)
class Case:
    """One test case.

    Attributes:
        class_name: the class including its module, as in `__main__.TalkerTestCase`.
        name: the method name, or another name chosen by the test program.
        seconds: the duration.
        outcome: how the case ended.
        kind: the type of the exception, if the case did not pass.
        text: the message and the traceback of the exception.
    """

    class_name: str
    name: str
    seconds: float = 0.0
    outcome: Outcome = Outcome.PASSED
    kind: str = ""
    text: str = ""


@dataclass(frozen=True, slots=True)
class Suite:
    """The cases of one test program, with its output.

    Attributes:
        stated_tests, stated_failures, stated_errors: the counts that the result file states. The result file
            of a crashed program may list no cases, so `tests`, `failures` and `errors` are at least the
            stated counts.
    """

    name: str
    cases: tuple[Case, ...] = ()
    seconds: float = 0.0
    stdout: str = ""
    stderr: str = ""
    stated_tests: int = 0
    stated_failures: int = 0
    stated_errors: int = 0

    def with_outcome(self, outcome: Outcome) -> list[Case]:
        return [case for case in self.cases if case.outcome is outcome]

    @property
    def failures(self) -> int:
        return max(self.stated_failures, len(self.with_outcome(Outcome.FAILURE)))

    @property
    def errors(self) -> int:
        return max(self.stated_errors, len(self.with_outcome(Outcome.ERROR)))

    @property
    def tests(self) -> int:
        return max(self.stated_tests, len(self.cases))

    @property
    def passed(self) -> bool:
        return not self.failures and not self.errors


@dataclass(frozen=True, slots=True)
class Totals:
    """Totals for several suites, for a summary."""

    tests: int = 0
    errors: int = 0
    failures: int = 0

    @classmethod
    def of(cls, suites: Iterable[Suite]) -> Totals:
        listed = list(suites)
        return cls(
            tests=sum(suite.tests for suite in listed),
            errors=sum(suite.errors for suite in listed),
            failures=sum(suite.failures for suite in listed),
        )

    @property
    def passed(self) -> bool:
        return not self.errors and not self.failures
