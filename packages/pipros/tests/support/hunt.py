"""Find unreliable tests by repeating them while all processors are busy.

`script/hunt` repeats every test that computes for longer than `QUICK_S` more often than the others, most of
which start no process, thread or socket, and prints failure rates. `script/hunt --again FILE` repeats the
tests that failed in one run, which decides whether CI passes: it does if each of them passes at least four of
five repetitions on busy processors. The next commit must mend such a test, or list it in
tests/quarantine.toml.
"""

import argparse
import contextlib
import os
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import date, datetime, timedelta, timezone
from pathlib import Path

from tests.support.environments import REPOSITORY, file_of_tests
from tests.support.outcomes import Outcome, read_outcomes
from tests.support.project import load_toml

AGAIN_TIMES = 5
"""Repetitions of a test that failed in CI."""
AGAIN_FAILURES = 1
"""Failed repetitions with which CI still passes."""
AGAIN_LIMIT = 10
"""Maximum number of files with failed tests to repeat. More are unlikely to come from unreliable tests, while
one fixture may fail for all tests of a file."""
QUARANTINE = file_of_tests("quarantine.toml")
QUARANTINE_LIMIT = 5
QUARANTINE_AGE = timedelta(days=14)
"""How long a test may be listed: then its race must have been found."""

QUICK_S = 0.02
"""Processor time of a test, which hardly depends on the load."""
_SPIN = "import os\nparent = os.getppid()\nwhile os.getppid() == parent:\n    sum(range(100_000))"
_INTERRUPTED = 2


@dataclass(frozen=True, slots=True)
class Quarantined:
    """A test that is known to be unreliable; its failures do not fail CI."""

    test: str
    cause: str
    evidence: str
    since: date


def read_quarantine() -> dict[str, Quarantined]:
    """Return the entries of tests/quarantine.toml by test.

    Raises:
        ValueError: the file has too many entries, or an entry lacks a cause, evidence or a date, or is
            too old.
    """
    file, today = QUARANTINE, datetime.now(tz=timezone.utc).date()
    entries = [Quarantined(**entry) for entry in load_toml(file).get("test", ())]
    if len(entries) > QUARANTINE_LIMIT:
        raise ValueError(f"{file}: at most {QUARANTINE_LIMIT} tests may be listed, got {len(entries)}")
    for entry in entries:
        if not (entry.cause and entry.evidence and isinstance(entry.since, date)):
            raise ValueError(f"{file}: [{entry.test}] needs a cause, evidence and a date")
        if today - entry.since > QUARANTINE_AGE:
            raise ValueError(
                f"{file}: [{entry.test}] is listed since {entry.since}; "
                f"after {QUARANTINE_AGE.days} days it must be mended"
            )
    return {entry.test: entry for entry in entries}


@contextlib.contextmanager
def busy_processors() -> Iterator[None]:
    """Within the block, run a busy process for each processor, which competes with the tests."""
    spinners = [subprocess.Popen([sys.executable, "-c", _SPIN]) for _ in range(os.cpu_count() or 1)]
    try:
        yield
    finally:
        for spinner in spinners:
            spinner.kill()
            spinner.wait()


def run_tests(tests: Collection[str], outcomes: Path, words: Sequence[str] = ()) -> int:
    """Run pytest once, and return its exit code. If `tests` is empty, run all tests that `words` select."""
    with tempfile.NamedTemporaryFile("w", suffix=".txt", encoding="utf-8") as listed:
        listed.writelines(f"{test}\n" for test in tests)
        listed.flush()
        options = ("-q", "--tb=no", "--no-header", f"--outcomes-to={outcomes}")
        command = [sys.executable, "-m", "pytest", *options]
        command += [*words, *([f"@{listed.name}"] if tests else [])]
        return subprocess.run(command, cwd=REPOSITORY, check=False).returncode


def judge(
    file: Path, words: Sequence[str], quarantine: Mapping[str, Quarantined], times: int = AGAIN_TIMES
) -> tuple[bool, str]:
    """Repeat the tests that failed according to `file`. Return whether CI passes, and a report."""
    last = {outcome.test: outcome for outcome in read_outcomes(file)}
    failed = {test: outcome for test, outcome in last.items() if outcome.result == "failed"}
    if not failed:
        return False, "pytest failed without a failed test"
    files = {test.partition("::")[0] for test in failed}
    if len(files) > AGAIN_LIMIT:
        return False, f"tests of {len(files)} files failed, more than the {AGAIN_LIMIT} that are repeated"
    with tempfile.TemporaryDirectory() as folder, busy_processors():
        again = Path(folder) / "outcomes"
        repeated: list[Outcome] = []
        for _ in range(times):
            failures = Counter(run.test for run in repeated if run.result != "passed")
            if undecided := [test for test in failed if failures[test] <= AGAIN_FAILURES]:
                run_tests(undecided, again, ["-n", "0", "-p", "no:cacheprovider", *words])
            repeated = read_outcomes(again)
    passes = True
    lines = []
    for test, outcome in failed.items():
        results = [run.result for run in repeated if run.test == test]
        held = len(results) == times and results.count("passed") >= times - AGAIN_FAILURES
        passes &= held or test in quarantine
        verdict = f"passed {results.count('passed')} of {len(results)} repetitions on busy processors"
        if test in quarantine:
            verdict += f", in quarantine: {quarantine[test].cause}"
        first = next((run for run in repeated if run.test == test and run.result == "failed"), None)
        lines += [f"== {test}: failed, then {verdict}", outcome.output]
        lines += [f"-- the first failed repetition\n{first.output}"] if first else []
    return passes, "\n".join(lines)


def hunt(results: Path, times: int, other_times: int, words: Sequence[str]) -> int:
    """Run tests until each has `times` results, or `other_times` if it is quick. Return an exit code."""
    with busy_processors():
        if not read_outcomes(results):
            print("the first run tells which tests are quick", flush=True)
            if run_tests((), results, words) == _INTERRUPTED:
                return 130
        while todo := _remaining(read_outcomes(results), times, other_times):
            print(f"{len(todo)} tests to repeat", flush=True)
            if run_tests(todo, results, words) == _INTERRUPTED:
                return 130
    return 0


def _remaining(outcomes: Sequence[Outcome], times: int, other_times: int) -> list[str]:
    runs: defaultdict[str, list[float]] = defaultdict(list)
    for outcome in outcomes:
        runs[outcome.test].append(outcome.processor_s)
    wanted = {test: times if max(seconds) > QUICK_S else other_times for test, seconds in runs.items()}
    return [test for test, seconds in runs.items() if len(seconds) < wanted[test]]


def failure_table(outcomes: Sequence[Outcome]) -> str:
    """Return one line for each test that failed, the highest failure rate first, and a summary line."""
    runs = Counter(outcome.test for outcome in outcomes)
    failures = Counter(outcome.test for outcome in outcomes if outcome.result == "failed")
    rates = [(count, runs[test], test) for test, count in failures.items()]
    failed = sorted(rates, key=lambda rate: (-rate[0] / rate[1], rate[2]))
    lines = [f"{wrong:3} of {count:3}  {test}" for wrong, count, test in failed]
    return "\n".join(
        [*lines, f"{len(failed)} of {len(runs)} tests failed at least once in {len(outcomes)} runs"]
    )


def main() -> int:
    parser = argparse.ArgumentParser(prog="script/hunt", description=__doc__)
    parser.add_argument("--times", type=int, default=20, help="runs of a test that is not quick (20)")
    parser.add_argument("--other-times", type=int, default=3, help="runs of the other tests (3)")
    parser.add_argument(
        "--results", type=Path, default=REPOSITORY / ".hunt", help="file of the outcomes (.hunt)"
    )
    parser.add_argument("--report", action="store_true", help="print the failure rates so far")
    parser.add_argument("--again", type=Path, metavar="FILE", help="repeat the tests that failed in one run")
    parser.add_argument("--report-to", type=Path, metavar="FILE", help="where --again adds its report")
    options, words = parser.parse_known_args()
    if options.again:
        passes, report = judge(options.again, words, read_quarantine())
        print(report)
        if options.report_to:
            with options.report_to.open("a", encoding="utf-8") as file:
                file.write(f"{report}\n")
        return 0 if passes else 1
    words = words or ["-n", str(2 * (os.cpu_count() or 1)), "--dist", "worksteal"]
    code = 0 if options.report else hunt(options.results, options.times, options.other_times, words)
    print(failure_table(read_outcomes(options.results)))
    return code


if __name__ == "__main__":
    sys.exit(main())
