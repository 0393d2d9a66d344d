"""Matched writers, as a reader knows them: what has arrived from each, and what is missing."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from pipros.basics.budget import Budget
from pipros_ros2.rtps.incomplete import PIECE_OVERHEAD_BYTES, Assembly, inline_bytes
from pipros_ros2.rtps.parameters import Address, Parameters
from pipros_ros2.rtps.submessages import MAX_SET

REQUEST_AGAIN_S: Final = 0.02
MAX_EARLY: Final = 8192
"""Limits the work that one submessage causes; the budget limits memory."""


class RtpsSample(NamedTuple):
    """A sample as it arrived.

    Attributes:
        payload: CDR with its encapsulation header, and up to three bytes of padding. If `has_payload` is
            False, the key of the entity that has ended, or empty.
    """

    writer: bytes
    sequence: int
    payload: bytes
    inline: Parameters | None = None
    has_payload: bool = True


@dataclass(slots=True, eq=False)
class WriterProxy:
    """A matched writer. Samples are identified by their sequence numbers.

    Attributes:
        question_base: base of the ACKNACKs that ask for the first heartbeat.
        expected: the next sample to deliver.
        announced: the last sample that the writer is known to have.
        is_greeted: whether a heartbeat or a GAP of the writer has arrived.
        early: samples after `expected` that have arrived, by sequence number.
        skipped: ranges of samples after `expected` that do not exist, each as its start and exclusive end.
        has_progressed: whether expected or requested data has arrived since `poll` last handled this writer.
        requested: the samples of the last request that are still missing, in whole or in part.
        requests: number of requests in a row without progress.
        usual_bytes: the size of the last sample that had fragments.
        due: time of the next repeated request, or of the next check for abandoned fragments.
    """

    guid: bytes
    address: Address
    head: bytes
    is_reliable: bool
    budget: Budget
    question_base: int = 1
    expected: int = 1
    announced: int = 0
    is_greeted: bool = False
    early: dict[int, RtpsSample] = field(default_factory=dict)
    skipped: list[tuple[int, int]] = field(default_factory=list)
    assemblies: dict[int, Assembly] = field(default_factory=dict)
    usual_bytes: int = 0
    has_progressed: bool = False
    requested: set[int] = field(default_factory=set)
    requests: int = 0
    due: float = math.inf
    interval_s: float = REQUEST_AGAIN_S

    def is_new(self, sequence: int) -> bool:
        return sequence >= self.expected and sequence not in self.early

    def keep_early(self, sample: RtpsSample) -> bool:
        """Keep a sample that arrived early, and return whether there was room."""
        has_room = len(self.early) < MAX_EARLY and self.budget.take(_cost(sample))
        if has_room:
            self.early[sample.sequence] = sample
        return has_room

    def take_early(self, sequence: int) -> RtpsSample:
        """Return and remove an early sample."""
        sample = self.early.pop(sequence)
        self.budget.give_back(_cost(sample))
        return sample

    def release(self, sequences: Iterable[int]) -> None:
        """Remove incomplete samples."""
        for sequence in list(sequences):
            self.assemblies.pop(sequence).release()

    def missing(self) -> tuple[int, ...]:
        last = min(self.announced, self.expected + MAX_SET - 1)
        return tuple(
            sequence
            for sequence in range(self.expected, last + 1)
            if sequence not in self.early and not any(start <= sequence < end for start, end in self.skipped)
        )

    @property
    def is_answering(self) -> bool:
        """Return True if part of the last request has not been fulfilled yet."""
        return any(self._is_pending(each) for each in self.requested)

    def _is_pending(self, sequence: int) -> bool:
        if sequence < self.expected or sequence in self.early:
            return False
        assembly = self.assemblies.get(sequence)
        return assembly is None or not assembly.is_answered


def _cost(sample: RtpsSample) -> int:
    return len(sample.payload) + inline_bytes(sample.inline) + PIECE_OVERHEAD_BYTES
