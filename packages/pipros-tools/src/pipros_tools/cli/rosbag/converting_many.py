"""`rosbag convert --output-dir`: several bags in several processes, one progress bar, one summary.

A run can be repeated after an interruption: complete outputs are skipped, and unfinished ones replaced.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from optparse import Values
from pathlib import Path
from typing import Any

from pipros.basics.errors import MissingExtra, PiprosError
from pipros.basics.printable import listed
from pipros.basics.process_pool import SPAWN, in_processes
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.info_text import human_size
from pipros_tools.bag.left_out import LeftOut
from pipros_tools.cli.rosbag.other_bags import opened
from pipros_tools.cli.rosbag.progress import Progress

Convert = Callable[[Path, Path, Values, LeftOut, Callable[[int], Any]], None]
"""A function that converts a bag; the last argument makes a `Progress` for a number of bytes."""


@dataclass(frozen=True, slots=True)
class _Work:
    number: int
    source: Path
    target: Path
    size: int
    convert: Convert
    options: Values


@dataclass(slots=True)
class _Outcome:
    """What became of a bag: converted, skipped, or failed because of `error`."""

    source: Path
    size: int
    left_out: list[str] = field(default_factory=list)
    error: str = ""
    is_skipped: bool = False


class _Part:
    """Progress of one bag, in the bytes of its file."""

    def __init__(self, number: int, size: int, total: int) -> None:
        self._number, self._scale, self._size = number, size / max(total, 1), size

    def __call__(self, done: int) -> None:
        _shared.show(self._number, min(done * self._scale, self._size))

    def finish(self) -> None:
        _shared.show(self._number, self._size)


class _Shared:
    """The bytes that are done of each bag, in memory that all processes share."""

    def __init__(self) -> None:
        self._done: Any = None
        self._bar: Callable[[int], object] | None = None

    def begin(self, done: Any, bar: Callable[[int], object] | None) -> None:
        self._done, self._bar = done, bar

    def show(self, number: int, size: float) -> None:
        self._done[number] = size
        if self._bar is not None:
            self._bar(int(sum(self._done)))


_shared = _Shared()


def _prepare(done: Any, bar: Callable[[int], object] | None) -> None:
    _shared.begin(done, bar)


def convert_all(pairs: Sequence[tuple[Path, Path]], options: Values, convert: Convert) -> int:
    """Convert each source to its target. Return the exit code: 1 if anything fails or is left out."""
    started = time.monotonic()
    works = [_Work(number, *pair, _size(pair[0]), convert, options) for number, pair in enumerate(pairs)]
    outcomes = list(_twice(works))
    left = [each for each in works if each.source not in {found.source for found in outcomes}]
    total, done = sum(each.size for each in left), SPAWN.RawArray("d", len(works))
    bar = Progress(f"{len(pairs)} bags", total, is_quiet=options.quiet)
    jobs = max(1, min(options.jobs, len(left)))
    arguments = (done, bar if jobs == 1 else None)
    for each in outcomes:
        _report(each)
    for each in in_processes(
        _converted, left, jobs, prepare=_prepare, arguments=arguments, idle=lambda: bar(int(sum(done)))
    ):
        _report(each)
        outcomes.append(each)
    bar.finish()
    if not options.quiet:
        print(_summary(outcomes, time.monotonic() - started))
    return 1 if any(each.error or each.left_out for each in outcomes) else 0


def _twice(works: Sequence[_Work]) -> Sequence[_Outcome]:
    """Return errors for the bags whose output would have the same name as that of an earlier one."""
    first: dict[Path, Path] = {}
    found = []
    for each in works:
        if first.setdefault(each.target, each.source) != each.source:
            reason = f"{each.target} would also be the output of {first[each.target]}"
            found.append(_Outcome(each.source, each.size, error=reason))
    return found


def _converted(work: _Work) -> _Outcome:
    outcome = _Outcome(work.source, work.size)
    options = Values({**vars(work.options), "force": True})
    try:
        if not work.options.force and work.target.exists() and _is_complete(work):
            _shared.show(work.number, work.size)
            outcome.is_skipped = True
            return outcome

        def progress(total: int) -> _Part:
            return _Part(work.number, work.size, total)

        work.convert(work.source, work.target, options, LeftOut(outcome.left_out.append), progress)
    except (OSError, MissingExtra, PiprosError) as error:
        outcome.error = str(error)
    return outcome


def _is_complete(work: _Work) -> bool:
    """Return whether an output is complete, or, if not, may be replaced.

    Raises:
        BagError: the output contains messages that the source lacks, so it must not be replaced.
    """
    quiet = LeftOut(lambda _: None)
    with opened(work.source, work.options, quiet) as source:
        try:
            with opened(work.target, work.options, quiet) as target:
                has_more = target.message_count > source.message_count
                is_other = has_more or (target.message_count and not _is_within(target, source))
        except BagError:
            return False
    if is_other:
        raise BagError(f"{work.target} already exists, with other messages; --force overwrites it")
    return True


def _is_within(target: Any, source: Any) -> bool:
    first, last = source.range_ns
    return bool(first <= target.range_ns[0] and target.range_ns[1] <= last)


def _size(path: Path) -> int:
    """Return the size of a file, or of all files in a folder; 0 if it cannot be read."""
    try:
        files = path.iterdir() if path.is_dir() else [path]
        return sum(each.stat().st_size for each in files)
    except OSError:
        return 0


def _report(outcome: _Outcome) -> None:
    for text in outcome.left_out:
        print(f"WARNING: {listed(str(outcome.source))}: {text}", file=sys.stderr)
    if outcome.error:
        print(f"ERROR converting {outcome.source}: {outcome.error}", file=sys.stderr)


def _summary(outcomes: Sequence[_Outcome], seconds: float) -> str:
    made = [each for each in outcomes if not each.error and not each.is_skipped]
    size = sum(each.size for each in made)
    skipped = sum(each.is_skipped for each in outcomes)
    failed = len(outcomes) - len(made) - skipped
    text = f"{len(made)} of {len(outcomes)} bags converted: {human_size(size)} in {seconds:.0f} s"
    text += f", {human_size(size / max(seconds, 0.001))}/s" if made else ""
    text += f"; {skipped} skipped, because they are complete" if skipped else ""
    return text + (f"; {failed} failed" if failed else "")
