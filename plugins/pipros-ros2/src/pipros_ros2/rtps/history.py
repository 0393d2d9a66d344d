"""The samples that a writer keeps for requests and late readers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

OVERHEAD_BYTES: Final = 200
"""Memory of a sample in addition to its payload and its inline QoS."""


@dataclass(frozen=True, slots=True, eq=False)
class CacheChange:
    """A sample in the history.

    Attributes:
        inline: inline QoS, with its sentinel, or empty.
        recipients: GUIDs of the readers that get the sample; None for all.
        is_key: whether the payload is the key of an entity that has ended.
        stamp: the submessage with the time of the sample, or empty.
    """

    sequence: int
    payload: bytes
    inline: bytes = b""
    recipients: frozenset[bytes] | None = None
    is_key: bool = False
    stamp: bytes = b""

    def is_for(self, reader: bytes) -> bool:
        return self.recipients is None or reader in self.recipients

    @property
    def cost_bytes(self) -> int:
        return len(self.payload) + len(self.inline) + OVERHEAD_BYTES


@dataclass(slots=True, eq=False)
class WriterHistory:
    """Samples by their sequence numbers.

    Attributes:
        last: the last sample that was added, even if it is no longer kept.
        kept_bytes: memory of all samples.
    """

    limit_bytes: int
    last: int = 0
    kept_bytes: int = 0
    _changes: dict[int, CacheChange] = field(default_factory=dict)
    _first: int = 1

    def __len__(self) -> int:
        return len(self._changes)

    def __iter__(self) -> Iterator[CacheChange]:
        return iter(self._changes.values())

    def get(self, sequence: int) -> CacheChange | None:
        return self._changes.get(sequence)

    def fits(self, payload_bytes: int) -> bool:
        return self.kept_bytes + payload_bytes + OVERHEAD_BYTES <= self.limit_bytes

    def add(self, change: CacheChange) -> None:
        self.last = change.sequence
        self._changes[change.sequence] = change
        self.kept_bytes += change.cost_bytes

    def oldest(self) -> int:
        """Return the first sequence number that is kept, or the next one if none is.

        `next(iter(...))` would be slower: it steps over the gaps that removed samples leave in a dictionary.
        """
        while self._first <= self.last and self._first not in self._changes:
            self._first += 1
        return self._first

    def forget(self, sequence: int) -> None:
        """Remove a sample. Do nothing if it is not there."""
        change = self._changes.pop(sequence, None)
        if change is not None:
            self.kept_bytes -= change.cost_bytes

    def forget_all(self) -> None:
        self._changes.clear()
        self.kept_bytes = 0
