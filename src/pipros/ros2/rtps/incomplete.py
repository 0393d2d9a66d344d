"""Samples that cannot be delivered yet: fragments, and the bytes that they may use."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from pipros.ros2.rtps.parameters import Parameters
from pipros.ros2.rtps.submessages import MAX_SET, DataFrag

PIECE_OVERHEAD_BYTES: Final = 150
"""What a fragment takes besides its bytes; without it, fragments of one byte would take 100 times as much."""


@dataclass(slots=True, eq=False)
class Budget:
    """The bytes that one peer may use, as a part of those of all peers."""

    limit_bytes: int
    total: Budget | None = None
    used_bytes: int = 0

    def take(self, size: int) -> bool:
        """Use some bytes, unless too few are left."""
        if self.used_bytes + size > self.limit_bytes or (self.total and not self.total.take(size)):
            return False
        self.used_bytes += size
        return True

    def give_back(self, size: int) -> None:
        self.used_bytes -= size
        if self.total:
            self.total.give_back(size)


_STEP_BYTES: Final = 64 * 1024


def total_fragments(fragment_bytes: int, sample_bytes: int) -> int:
    """Return the number of fragments of a sample."""
    return -(-sample_bytes // fragment_bytes)


@dataclass(slots=True, eq=False)
class Assembly:
    """The fragments of one sample.

    Attributes:
        changed_at: when the last fragment arrived.
    """

    budget: Budget
    fragment_bytes: int
    sample_bytes: int
    changed_at: float
    inline: Parameters | None = None
    _pieces: dict[int, bytes] = field(default_factory=dict)
    _total: int = 0
    _used_bytes: int = PIECE_OVERHEAD_BYTES
    _reserved_bytes: int = PIECE_OVERHEAD_BYTES
    _first_missing: int = 1
    _last_requested: int = 0

    def __post_init__(self) -> None:
        self._total = total_fragments(self.fragment_bytes, self.sample_bytes)

    @classmethod
    def start(cls, budget: Budget, fragment: DataFrag, now: float) -> Assembly | None:
        """Return an assembly for a sample, without the fragment; None if the budget has no room."""
        if not budget.take(PIECE_OVERHEAD_BYTES):
            return None
        return cls(budget, fragment.fragment_bytes, fragment.sample_bytes, now)

    def add(self, fragment: DataFrag, now: float) -> bytes | None:
        """Add fragments; return the sample once it is complete.

        Fragments that contradict the first one, and those for which the budget has no room, are dropped.
        """
        size, pieces, payload = self.fragment_bytes, self._pieces, fragment.payload
        if fragment.fragment_bytes != size or fragment.sample_bytes != self.sample_bytes:
            return None
        self.inline = self.inline or fragment.inline
        self.changed_at = now
        number = fragment.first
        for start in range(0, len(payload), size):
            if number not in pieces:
                piece = bytes(payload[start : start + size])
                if not self._use(len(piece) + PIECE_OVERHEAD_BYTES):
                    return None
                pieces[number] = piece
            number += 1
        if len(pieces) < self._total:
            return None
        return b"".join(pieces[number] for number in range(1, self._total + 1))

    def _use(self, size: int) -> bool:
        """Use bytes of the budget, which are taken in larger steps."""
        self._used_bytes += size
        if self._used_bytes > self._reserved_bytes:
            step = max(size, min(_STEP_BYTES, self.sample_bytes))
            if not self.budget.take(step):
                self._used_bytes -= size
                return False
            self._reserved_bytes += step
        return True

    @property
    def was_requested(self) -> bool:
        """True if fragments were requested."""
        return self._last_requested > 0

    @property
    def is_answered(self) -> bool:
        """True once the last of the requested fragments has arrived; the first ones may be missing again."""
        return self._last_requested in self._pieces

    def request(self, limit_bytes: int) -> tuple[int, ...]:
        """Return the next missing fragments, and note that they are requested."""
        lacking = self.missing()[: max(1, limit_bytes // self.fragment_bytes)]
        self._last_requested = lacking[-1]
        return lacking

    def missing(self) -> tuple[int, ...]:
        """Return the first missing fragments, as many as one NACK_FRAG can name."""
        found: list[int] = []
        while self._first_missing in self._pieces:
            self._first_missing += 1
        for number in range(self._first_missing, self._total + 1):
            if number not in self._pieces:
                found.append(number)
            if found and number - found[0] >= MAX_SET - 1:
                break
        return tuple(found)

    def release(self) -> None:
        """Give the bytes back."""
        self.budget.give_back(self._reserved_bytes)
        self._reserved_bytes = self._used_bytes = 0
        self._pieces.clear()
