"""Runs each folder of unit tests with Windows's own Python, under Wine, and prints a table of the results.

`script/windows folders` runs all folders; `script/windows folders net bag`, these. A test that takes longer
than `LIMIT_S` hangs: it ends its process, and the tests that are left run in another one. The outcomes of all
tests, with what pytest prints about failures, are in the folder `outcomes` of the environment. After `LIMIT`
seconds, an hour by default, a folder is cut off, and its row says so.
"""

from __future__ import annotations

import os
import re
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from tests.support import windows
from tests.support.environments import REPOSITORY
from tests.support.outcomes import Outcome, read_outcomes

LIMIT_S = 40
_BEGUN = re.compile(
    r"(p[a-z]+/\S+?\.py::.*?) ?(?:(?:PASSED|FAILED|ERROR|SKIPPED|XFAIL)\b.*|\++ Timeout \++|wine: .*)?$"
)


def folders(names: Sequence[str]) -> list[Path]:
    """Return the folders of unit tests of all packages, or those with these names."""
    found = sorted(REPOSITORY.glob("p[la]*/*/tests/unit/*/"), key=lambda folder: folder.name)
    return [folder for folder in found if folder.name in names or (not names and folder.name[0] != "_")]


def unfinished(lines: Sequence[str], known: set[str]) -> str | None:
    """Return the test that was begun last, unless its outcome is known."""
    begun = [match[1] for line in lines if (match := _BEGUN.match(line))]
    return begun[-1] if begun and begun[-1] not in known else None


def run(folder: Path) -> tuple[list[Outcome], list[str], list[str], bool]:
    """Return outcomes, tests that hung, files that cannot be collected, and whether it was cut off."""
    end = time.monotonic() + float(os.environ.get("LIMIT") or 3600)
    file = windows.DRIVE / "temp" / "outcomes"
    file.unlink(missing_ok=True)
    hung: list[str] = []
    while True:
        outcomes = {outcome.test: outcome for outcome in read_outcomes(file)}
        left_out = [*hung, *(test for test, outcome in outcomes.items() if outcome.result != "passed")]
        options = [
            "-vv",
            f"--timeout={LIMIT_S}",
            "--timeout-method=thread",
            "--continue-on-collection-errors",
        ]
        options += [
            rf"--outcomes-to={windows.windows_path(file)}",
            *(f"--deselect={test}" for test in left_out),
        ]
        options += [rf"--but-passed={windows.windows_path(file)}"] if file.exists() else []
        command = [*windows.PYTEST, *options, folder.relative_to(REPOSITORY).as_posix()]
        code, lines = windows.run(command, windows.TREE, end - time.monotonic(), shows=False)
        done = read_outcomes(file)
        uncollected = sorted({line.split()[1] for line in lines if re.match(r"ERROR p[a-z]+/[^:]+$", line)})
        stopped_at = unfinished(lines, {outcome.test for outcome in done})
        if stopped_at is None or stopped_at in hung or code == 124:
            unique = {outcome.test: outcome for outcome in done}
            return list(unique.values()), hung, uncollected, code == 124
        hung.append(stopped_at)


def main(names: Sequence[str]) -> int:
    kept = windows.FOLDER / "outcomes"
    kept.mkdir(exist_ok=True)
    print("| folder | passed | skipped | failed | hung | files not collected |\n| --- |" + " ---: |" * 5)
    total: Counter[str] = Counter()
    for folder in folders(names):
        outcomes, hung, uncollected, is_cut_off = run(folder)
        counts = Counter(outcome.result for outcome in outcomes)
        counts |= Counter(hung=len(hung), uncollected=len(uncollected))
        total += counts
        _print_row(f"{folder.name}{', cut off' if is_cut_off else ''}", counts)
        texts = [f"{outcome.result}\n{outcome.output}" for outcome in outcomes if outcome.result == "failed"]
        texts += [f"hung: {test}" for test in hung] + [f"not collected: {name}" for name in uncollected]
        (kept / f"{folder.name}.txt").write_text("\n\n".join(texts), encoding="utf-8")
    _print_row("all", total)
    return int(bool(total["failed"] + total["hung"] + total["uncollected"]))


def _print_row(name: str, counts: Counter[str]) -> None:
    columns = ("passed", "skipped", "failed", "hung", "uncollected")
    print(f"| {name} | {' | '.join(str(counts[column]) for column in columns)} |", flush=True)
