"""Check episodes for missing messages, clock jumps, frozen and saturated signals, and topics that end early.

docs/guides/data.md explains the checks and their thresholds, which can be set in the description.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from pipros.msg.time import NS_PER_S
from pipros_data.datasets.config import DatasetSource, SignalSource

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from pipros_data.datasets.signals import RecordedTopic


@dataclass(frozen=True, slots=True)
class DatasetFinding:
    """The problems that a check found in one topic."""

    check: str
    source: str  # the topic's name in the data set
    text: str  # describes the first three problems
    spans: list[tuple[float, float]]  # of the first 100 problems, in seconds since the start of the episode


def examine(recording: RecordedTopic, source: DatasetSource, start: int, end: int) -> list[DatasetFinding]:
    """Apply the checks that are turned on to one topic of an episode from `start` to `end` (ns)."""
    inside = (recording.times >= start) & (recording.times <= end)
    times, values = recording.times[inside], recording.values[inside]
    checks = {
        "missing": _missing(times, source),
        "clock": _jumps(recording, source, start, end),
        "frozen": _frozen(times, values, recording.names, source),
        "saturated": _saturated(times, values, recording.names, source),
        "stopped": _stopped(times, source, start, end),
    }
    found = []
    for name, results in checks.items():
        if source.checks[name] <= 0:
            continue
        texts, spans = [], []
        for text, begin, last in results:
            texts.append(text)
            spans.append((round((begin - start) / NS_PER_S, 3), round((last - start) / NS_PER_S, 3)))
        if texts:
            more = f", and {len(texts) - 3} more" if len(texts) > 3 else ""
            found.append(DatasetFinding(name, source.name, "; ".join(texts[:3]) + more, spans[:100]))
    return found


_Result = tuple[str, int, int]


def _missing(times: NDArray[np.int64], source: DatasetSource) -> Iterator[_Result]:
    steps = np.diff(times)
    if len(steps) < 2:
        return
    usual = float(np.median(steps))
    if usual <= 0:
        return
    for at in np.flatnonzero(steps > usual * source.checks["missing"]).tolist():
        lost = max(1, round(steps[at] / usual) - 1)
        yield f"{lost} missing in {steps[at] / NS_PER_S:.3f} s", int(times[at]), int(times[at + 1])


def _jumps(recording: RecordedTopic, source: DatasetSource, start: int, end: int) -> Iterator[_Result]:
    if not len(recording.stamps):
        return
    inside = (recording.receipts >= start) & (recording.receipts <= end)
    stamps, receipts = recording.stamps[inside], recording.receipts[inside]
    change = np.diff(stamps - receipts)
    is_jump = (np.abs(change) > source.checks["clock"] * NS_PER_S) | (np.diff(stamps) < 0)
    for at in np.flatnonzero(is_jump).tolist():
        yield f"stamps jump by {change[at] / NS_PER_S:+.3f} s", int(receipts[at]), int(receipts[at + 1])


def _frozen(
    times: NDArray[np.int64], values: NDArray[np.float64], names: tuple[str, ...], source: DatasetSource
) -> Iterator[_Result]:
    for column, name in enumerate(names):
        for first, last in _runs(np.diff(values[:, column]) == 0):
            yield from _long(times, first, last + 1, source.checks["frozen"], f"{name} does not change")


def _saturated(
    times: NDArray[np.int64], values: NDArray[np.float64], names: tuple[str, ...], source: DatasetSource
) -> Iterator[_Result]:
    if isinstance(source, SignalSource):
        is_beyond = (values <= (source.least or -np.inf)) | (values >= (source.most or np.inf))
        for column, name in enumerate(names):
            for first, last in _runs(is_beyond[:, column]):
                text = f"{name} is at or beyond a limit"
                yield from _long(times, first, last, source.checks["saturated"], text)


def _runs(is_on: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """Return an iterator over the first and last indices of the runs of true values."""
    edges = np.diff(np.concatenate(([0], is_on.astype(np.int8), [0])))
    return zip(np.flatnonzero(edges == 1).tolist(), (np.flatnonzero(edges == -1) - 1).tolist(), strict=True)


def _long(times: NDArray[np.int64], first: int, last: int, least: float, text: str) -> Iterator[_Result]:
    begin, end = int(times[first]), int(times[last])
    if end - begin >= least * NS_PER_S:
        yield f"{text} for {(end - begin) / NS_PER_S:.1f} s", begin, end


def _stopped(times: NDArray[np.int64], source: DatasetSource, start: int, end: int) -> Iterator[_Result]:
    if not len(times):
        yield "no message", start, end
    elif end - times[-1] > source.checks["stopped"] * NS_PER_S:
        yield f"no message in the last {(end - times[-1]) / NS_PER_S:.1f} s", int(times[-1]), end
