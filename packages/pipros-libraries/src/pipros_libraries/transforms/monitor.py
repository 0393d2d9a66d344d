"""Delay and rate statistics of received transforms, for `tf_monitor`. Times are in seconds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

FRAME_LIMIT = 10_000
"""Maximum number of frames, and of nodes, with statistics.

Limited because any peer can choose frame IDs and node names.
"""


@dataclass(slots=True)
class TransformDelays:
    """Statistics on the delays between the timestamps of transforms and their arrival.

    >>> delays = TransformDelays()
    >>> delays.add(3.0, at=10.0); delays.add(1.0, at=11.0); delays.add(-1.0, at=12.0)
    >>> delays.average, delays.maximum, delays.rate
    (1.0, 3.0, 1.0)
    """

    count: int = 0
    total: float = 0.0
    maximum: float = 0.0
    first: float = 0.0
    last: float = 0.0

    def add(self, delay: float, at: float) -> None:
        """Add one delay, measured at the time `at`."""
        self.first = self.first if self.count else at
        self.last = at
        self.count += 1
        self.total += delay
        self.maximum = max(self.maximum, delay)

    @property
    def average(self) -> float:
        return self.total / self.count if self.count else 0.0

    @property
    def rate(self) -> float:
        """Mean rate in Hz between the first and the last sample; 0 if there are fewer than two samples."""
        return (self.count - 1) / (self.last - self.first) if self.last > self.first else 0.0


@dataclass(slots=True)
class Monitor:
    """Delay statistics by frame and by publishing node."""

    frames: dict[str, TransformDelays] = field(default_factory=dict)
    senders: dict[str, TransformDelays] = field(default_factory=dict)
    sender_of: dict[str, str] = field(default_factory=dict)

    def add(self, sender: str, stamps: Mapping[str, float], now: float) -> None:
        """Add a message from `sender` that arrived at `now`. `stamps` maps its child frames to timestamps."""
        delays = {frame: now - stamp for frame, stamp in stamps.items()}
        for frame, delay in delays.items():
            if _count(self.frames, frame, delay, now):
                self.sender_of[frame] = sender
        if delays:
            _count(self.senders, sender, sum(delays.values()) / len(delays), now)

    def text(self, chain: Iterable[str] | None = None) -> str:
        """Return a report on all nodes and on all frames, or only the frames in `chain`, in that order."""
        shown = sorted(self.frames) if chain is None else [name for name in chain if name in self.frames]
        lines = ["Frames:"]
        lines += [
            f"Frame: {name} published by {self.sender_of[name]} {_described(self.frames[name])}"
            for name in shown
        ]
        lines += ["", "All Broadcasters:"]
        lines += [
            f"Node: {name} {delays.rate:g} Hz, {_described(delays)}"
            for name, delays in sorted(self.senders.items())
        ]
        return "\n".join(lines)


def _count(counted: dict[str, TransformDelays], name: str, delay: float, now: float) -> bool:
    if name not in counted and len(counted) >= FRAME_LIMIT:
        return False
    counted.setdefault(name, TransformDelays()).add(delay, now)
    return True


def _described(delays: TransformDelays) -> str:
    return f"Average Delay: {delays.average:g} Max Delay: {delays.maximum:g}"
