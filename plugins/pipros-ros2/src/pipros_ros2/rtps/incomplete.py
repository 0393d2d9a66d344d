"""Fragments of incomplete samples, and the memory that they may use."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from pipros.basics.budget import Budget
from pipros_ros2.rtps.parameters import Parameters
from pipros_ros2.rtps.submessages import MAX_SET, Buffer, DataFrag

PIECE_OVERHEAD_BYTES: Final = 150
"""Memory of a piece in addition to its payload. If it did not count, tiny fragments could use 100 times the
budget.
"""


_STEP_BYTES: Final = 64 * 1024
_VALUE_BYTES: Final = 200


def inline_bytes(inline: Parameters | None) -> int:
    """Return the memory that a sample's inline QoS takes."""
    if not inline:
        return 0
    return sum(_VALUE_BYTES + len(value) for values in inline.values() for value in values)


def total_fragments(fragment_bytes: int, sample_bytes: int) -> int:
    """Return the number of fragments of a sample."""
    return -(-sample_bytes // fragment_bytes)


@dataclass(slots=True, eq=False)
class Assembly:
    """The fragments of one sample.

    Fragments that arrive in one datagram are kept in one piece, because Cyclone DDS sends ten at a time.

    Attributes:
        changed_at: when the last fragment arrived.
    """

    budget: Budget
    fragment_bytes: int
    sample_bytes: int
    changed_at: float
    inline: Parameters | None = None
    _runs: dict[int, Buffer] = field(default_factory=dict)  # pieces by the index of their first fragment
    _has: bytearray = field(
        default_factory=bytearray
    )  # 1 for each fragment that has arrived, up to the last one
    _arrived: int = 0
    _total: int = 0
    _used_bytes: int = PIECE_OVERHEAD_BYTES
    _reserved_bytes: int = PIECE_OVERHEAD_BYTES
    _first_missing: int = 0
    _last_requested: int = 0

    def __post_init__(self) -> None:
        self._total = total_fragments(self.fragment_bytes, self.sample_bytes)

    @classmethod
    def start(cls, budget: Budget, fragment: DataFrag, now: float) -> Assembly | None:
        """Return an empty assembly for a fragment's sample, or None if the budget is used up."""
        if not budget.take(PIECE_OVERHEAD_BYTES):
            return None
        return cls(budget, fragment.fragment_bytes, fragment.sample_bytes, now)

    def add(self, fragment: DataFrag, now: float) -> bytes | None:
        """Add fragments; return the sample once it is complete.

        Fragments that contradict the first one or exceed the budget are dropped.
        """
        size, has, payload = self.fragment_bytes, self._has, fragment.payload
        if fragment.fragment_bytes != size or fragment.sample_bytes != self.sample_bytes:
            return None
        if self.inline is None and fragment.inline and self._use(inline_bytes(fragment.inline)):
            self.inline = fragment.inline
        self.changed_at = now
        first = fragment.first - 1
        end = first + total_fragments(size, len(payload))
        if end > len(has):
            if not self._use(end - len(has)):
                return None
            has.extend(bytes(end - len(has)))
        if has.find(1, first, end) < 0:
            self._keep(first, end, payload)
        else:
            for index in range(first, end):
                if not has[index]:
                    self._keep(index, index + 1, payload[(index - first) * size : (index - first + 1) * size])
        if self._arrived < self._total:
            return None
        return b"".join(run for _, run in sorted(self._runs.items()))

    def _keep(self, first: int, end: int, payload: Buffer) -> None:
        if self._use(len(payload) + PIECE_OVERHEAD_BYTES):
            datagram_bytes = memoryview(memoryview(payload).obj).nbytes
            # Copying is the slowest step, but a small part must not keep a whole datagram in memory.
            self._runs[first] = payload if 2 * len(payload) > datagram_bytes else bytes(payload)
            self._has[first:end] = b"\1" * (end - first)
            self._arrived += end - first

    def _use(self, size: int) -> bool:
        """Use bytes, taken from the budget in larger steps. Return False if the budget is used up."""
        self._used_bytes += size
        if self._used_bytes > self._reserved_bytes:
            step = max(size, min(_STEP_BYTES, self.sample_bytes))
            if not self.budget.take(step):
                self._used_bytes -= size
                return False
            self._reserved_bytes += step
        return True

    @property
    def is_answered(self) -> bool:
        """True if the last of the requested fragments has arrived, even if others were lost again."""
        return 0 < self._last_requested <= len(self._has) and bool(self._has[self._last_requested - 1])

    def request(self, limit_bytes: int) -> tuple[int, ...]:
        """Return the next missing fragments, and remember that they were requested."""
        lacking = self.missing()[: max(1, limit_bytes // self.fragment_bytes)]
        self._last_requested = lacking[-1]
        return lacking

    def missing(self) -> tuple[int, ...]:
        """Return the first missing fragments, up to the number that fits in a NACK_FRAG."""
        has = self._has
        first = has.find(0, self._first_missing)
        first = self._first_missing = len(has) if first < 0 else first
        end = min(self._total, first + MAX_SET)
        return tuple(index + 1 for index in range(first, end) if index >= len(has) or not has[index])

    def release(self) -> None:
        """Return the bytes to the budget."""
        self.budget.give_back(self._reserved_bytes)
        self._reserved_bytes = self._used_bytes = 0
        self._runs.clear()
