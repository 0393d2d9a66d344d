"""Align the topics of a description with the rows of an episode."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from pipros.basics.limits import limit_text, process_limits
from pipros.msg.time import NS_PER_S
from pipros.safe.settings import BadSettings
from pipros_data.datasets.cameras import Picture, pictures, read_times
from pipros_data.datasets.checks import DatasetFinding, examine
from pipros_data.datasets.config import LINEAR, CameraSource, DatasetConfig, DatasetSource, SignalSource
from pipros_data.datasets.signals import RecordedTopic, read_signal
from pipros_data.limits import DataLimits
from pipros_data.nearest import matches

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from pipros_data.bags import Bags
    from pipros_data.datasets.episodes import Episode


_ROUNDED = 0.001
"""The last row may be later than the last message by this part of an interval, because stamps are rounded."""


@dataclass(frozen=True, slots=True)
class SignalRows:
    """The numbers of a topic, one row in `values` for each row of the episode. Gaps are NaN."""

    source: SignalSource
    names: tuple[str, ...]
    values: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class CameraRows:
    """The pictures of a camera: the index of each row's message. Gaps have the index of the previous row."""

    source: CameraSource
    messages: NDArray[np.int64]
    gaps: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class EpisodeRows:
    """The rows of an episode, at `times` (ns). If the episode is left out, `problem` is the reason."""

    episode: Episode
    rate: float
    times: NDArray[np.int64]
    signals: list[SignalRows]
    cameras: list[CameraRows]
    findings: list[DatasetFinding]
    problem: str

    @property
    def seconds(self) -> NDArray[np.float64]:
        """The times of the rows, in seconds after the first row."""
        return (self.times - self.times[:1]) / NS_PER_S

    def pictures(self, bags: Bags, camera: CameraRows) -> Iterator[Picture]:
        """Yield the picture of each row."""
        return pictures(bags, camera.source, self.episode.start, self.episode.end, camera.messages)


def episode_rows(bags: Bags, episode: Episode, config: DatasetConfig) -> EpisodeRows:
    """Read and align the topics of an episode.

    Rows before the first complete row and after the last complete row are dropped.

    Raises:
        BadSettings: the description does not fit the bag, or the episode has too many rows.
        BagError: the bag is damaged.
    """
    start, end = episode.start, episode.end
    count = int((end - start) * config.rate / NS_PER_S + _ROUNDED) + 1
    if count > (limit := process_limits().of(DataLimits).dataset_rows):
        raise BadSettings(
            f"the episode has {count} rows: {limit_text('dataset_rows', limit)}. Reduce the rate"
        )
    rows: NDArray[np.int64] = start + np.rint(np.arange(count) * (NS_PER_S / config.rate)).astype(np.int64)
    is_held = config.gaps == "hold"
    is_complete = np.ones(count, np.bool_)
    gaps, findings, signals, cameras = [], [], [], []
    for source in config.sources:
        read: Any = read_signal if isinstance(source, SignalSource) else read_times
        recording: RecordedTopic = read(bags, source, start, end)
        index, is_gap = aligned(rows, recording.times, source, is_held=is_held)
        findings += examine(recording, source, start, end)
        if isinstance(source, SignalSource):
            values = np.full((count, len(recording.names)), np.nan)
            values[~is_gap] = recording.values[index[~is_gap]]
            if source.pick == LINEAR:
                _interpolate(values, rows, recording, source.tolerance)
            signals.append(SignalRows(source, recording.names, values))
        else:
            messages = np.zeros(count, np.int64)
            messages[~is_gap] = recording.rows[index[~is_gap]]
            cameras.append(CameraRows(source, np.maximum.accumulate(messages), is_gap))
        offset = np.median(recording.times) - np.median(recording.receipts) if len(recording.times) else 0.0
        gaps.append((is_gap, float(offset)))
        is_complete &= ~is_gap
    complete = np.flatnonzero(is_complete)
    part = slice(int(complete[0]), int(complete[-1]) + 1) if len(complete) else slice(0, 0)
    return EpisodeRows(
        episode,
        config.rate,
        rows[part],
        [SignalRows(each.source, each.names, each.values[part]) for each in signals],
        [CameraRows(each.source, each.messages[part], each.gaps[part]) for each in cameras],
        findings,
        _problem(config, rows, gaps, part),
    )


def aligned(
    rows: NDArray[np.int64], times: NDArray[np.int64], source: DatasetSource, *, is_held: bool
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return the index of each row's message, and a mask of the rows without a message.

    The indices of masked rows are undefined. If `is_held` is true, a row without a message within the
    tolerance gets the last earlier message, however old it is.
    """
    pick = "nearest" if source.pick == LINEAR else source.pick
    index, is_gap = matches(rows, times, source.tolerance, pick)
    if is_held:
        last, is_before_all = matches(rows, times, None, "backward")
        index = np.where(is_gap, last, index)
        is_gap = is_gap & is_before_all
    return index, is_gap


def _interpolate(
    values: NDArray[np.float64], rows: NDArray[np.int64], recording: RecordedTopic, tolerance: float
) -> None:
    """Interpolate the values of rows that have messages within the tolerance before and after them."""
    before, is_first = matches(rows, recording.times, tolerance, "backward")
    after, is_last = matches(rows, recording.times, tolerance, "forward")
    kept = ~(is_first | is_last)
    before, after = before[kept], after[kept]
    spans = recording.times[after] - recording.times[before]
    shares = (rows[kept] - recording.times[before]) / np.maximum(spans, 1)
    low, high = recording.values[before], recording.values[after]
    values[kept] = low + (high - low) * shares[:, None]


def _problem(
    config: DatasetConfig, rows: NDArray[np.int64], gaps: list[tuple[NDArray[np.bool_], float]], part: slice
) -> str:
    """Return why the episode is left out: no row is complete, or it has gaps and `gaps` is `skip`.

    Return an empty string if the episode is kept.
    """
    part = part if part.stop else slice(None)
    found = zip(config.sources, gaps, strict=True)
    source, (is_gap, offset) = max(found, key=lambda each: int(each[1][0][part].sum()))
    if not is_gap[part].any() or (part.stop and config.gaps != "skip"):
        return ""
    if abs(offset) > rows[-1] - rows[0] + source.tolerance * NS_PER_S:
        return f"stamps of {source.name} are {offset / NS_PER_S:+.1f} s from their receipt. Set time: receipt"
    first = (rows[part][is_gap[part]][0] - rows[0]) / NS_PER_S
    return (
        f"{source.name} has no message within {source.tolerance} s for {int(is_gap[part].sum())} rows, the "
        f"first at {first:.2f} s. Increase its tolerance, or set gaps to hold or keep"
    )
