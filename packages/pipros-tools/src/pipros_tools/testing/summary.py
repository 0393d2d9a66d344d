"""Format the summaries at the end of test runs, with Noetic's wording and colours."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from pipros_tools.testing.results import Outcome, Suite, Totals

_GREEN = "\x1b[32m"
_BOLD_RED = "\x1b[1;31m"
_PLAIN = "\x1b[0m"
_WIDTH = 80


def unittest_summary(tests: int, errors: Sequence[str], failures: Sequence[str]) -> str:
    """Return the summary for a test program: the number of cases, and the names of the failed cases."""
    passed = not errors and not failures
    result = f"{_GREEN} * RESULT: SUCCESS{_PLAIN}" if passed else " * RESULT: FAIL"
    return "\n".join(
        (
            "-" * 61,
            "SUMMARY:",
            result,
            f" * TESTS: {tests}",
            f" * ERRORS: {len(errors)} [{', '.join(errors)}]",
            f" * FAILURES: {len(failures)} [{', '.join(failures)}]",
            "",
        )
    )


def runner_summary(runner: Suite, ran: Iterable[tuple[str, Suite]], name: str = "ROSTEST") -> str:
    """Return the summary for a run of several test programs.

    Args:
        runner: one case per program, which passes if the program exited and wrote results.
        ran: the programs' results, each with a prefix such as `pkg.rosunit-test`.
        name: the runner's name, for the headline.
    """
    results = list(ran)
    inner = Totals.of(suite for _, suite in results)
    lines = [line for prefix, suite in results for line in _case_lines(prefix, suite)]
    lines += [f"[{case.name}][failed]" for case in runner.with_outcome(Outcome.FAILURE)]
    errors, failures = inner.errors + runner.errors, inner.failures + runner.failures
    lines = [*case_summary(lines, inner.tests, errors, failures, name)]
    if runner.failures:
        lines.append("ERROR: The following tests failed to run:")
        lines += [f" * {case.name}" for case in runner.with_outcome(Outcome.FAILURE)]
        lines.append("")
    return "\n".join(lines)


def case_summary(cases: Iterable[str], tests: int, errors: int, failures: int, name: str) -> Sequence[str]:
    """Return the lines of a summary: a headline with the runner's name, the case lines, and the totals."""
    result = f"{_BOLD_RED} * RESULT: FAIL{_PLAIN}"
    if not errors and not failures:
        result = f"{_GREEN} * RESULT: SUCCESS{_PLAIN}"
    return (
        _headline(f"[{name}]"),
        "",
        *cases,
        "",
        "SUMMARY",
        result,
        f" * TESTS: {tests}",
        _count("ERRORS", errors),
        _count("FAILURES", failures),
        "",
    )


def _case_lines(prefix: str, suite: Suite) -> Iterable[str]:
    for case in suite.cases:
        title = f"[{prefix}/{case.name}]"
        if case.outcome is Outcome.PASSED:
            yield f"{title}[passed]"
        else:
            yield _headline(f"{title}[{case.outcome.name}]")
            yield case.text.rstrip("\n")
            yield "-" * _WIDTH
            yield ""


def _headline(text: str) -> str:
    return text.ljust(_WIDTH, "-")


def _count(what: str, number: int) -> str:
    line = f" * {what}: {number}"
    return f"{_BOLD_RED}{line}{_PLAIN}" if number else line
