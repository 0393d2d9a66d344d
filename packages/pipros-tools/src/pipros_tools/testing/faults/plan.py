"""Planned faults in a byte stream. The same seed gives the same faults.

Faults other than jitter depend on the position in the stream, not on how the operating system divides the
stream into packets.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import dataclass, fields

_NEVER = 1 << 62
"""The distance used for faults that never occur."""


@dataclass(frozen=True, slots=True)
class Faults:
    """The faults in each direction of a connection.

    A fault whose value is 0 does not occur. Distances are in bytes and exponentially distributed.

    Attributes:
        delay_s: the delay for all bytes; their order is kept.
        jitter_s: the maximum additional delay; each piece has its own random delay.
        split_bytes: the maximum size of the pieces that are forwarded, each written separately.
        corrupt_every_bytes: the mean distance between corrupted bytes.
        stall_every_bytes: the mean distance between pauses of `stall_s`.
        stall_s: the length of a pause.
        cut_every_bytes: the mean distance after which the connection is reset.

    Raises:
        ValueError: a value is negative, or `stall_every_bytes` is set without `stall_s`.
    """

    delay_s: float = 0.0
    jitter_s: float = 0.0
    split_bytes: int = 0
    corrupt_every_bytes: int = 0
    stall_every_bytes: int = 0
    stall_s: float = 0.0
    cut_every_bytes: int = 0

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if not value >= 0:
                raise ValueError(f"{item.name} must be 0 or more, got {value}")
        if self.stall_every_bytes and not self.stall_s:
            raise ValueError("stall_every_bytes needs stall_s, the length of a pause in seconds")


@dataclass(frozen=True, slots=True)
class Piece:
    """Bytes to forward `delay_s` after their arrival, followed by a pause of `pause_s`."""

    data: bytes
    delay_s: float = 0.0
    pause_s: float = 0.0
    corrupted: int = 0


@dataclass(frozen=True, slots=True)
class Cut:
    """An instruction to reset the connection."""


class FaultyStream:
    """The faults in one direction of one connection. The seed determines their positions."""

    def __init__(self, seed: str, faults: Faults) -> None:
        self._seed = seed
        self._at = 0
        self.use(faults)

    def use(self, faults: Faults) -> None:
        """Replace the faults, starting with the next byte."""
        self.faults = faults
        chance = {name: random.Random(f"{self._seed}/{name}/{self._at}") for name in _DRAWN}  # noqa: S311
        self._chance = chance
        self._piece = self._at + self._piece_bytes()
        self._corrupt = self._after("corrupt", faults.corrupt_every_bytes)
        self._stall = self._after("stall", faults.stall_every_bytes)
        self._cut = self._after("cut", faults.cut_every_bytes)

    def feed(self, data: bytes) -> Iterator[Piece | Cut]:
        """Yield the actions for the next bytes. Nothing follows a Cut."""
        taken = 0
        while taken < len(data):
            if self._at >= self._cut:
                yield Cut()
                return
            end = min(self._piece, self._stall, self._cut, self._at + len(data) - taken)
            piece = bytearray(data[taken : taken + end - self._at])
            taken += len(piece)
            corrupted = self._spoil(piece, end)
            delay_s = self.faults.delay_s + self._chance["jitter"].uniform(0.0, self.faults.jitter_s)
            self._at = end
            pause_s = 0.0
            if end >= self._stall:
                pause_s = self.faults.stall_s
                self._stall = self._after("stall", self.faults.stall_every_bytes)
            if end >= self._piece:
                self._piece = end + self._piece_bytes()
            yield Piece(bytes(piece), delay_s, pause_s, corrupted)

    def _spoil(self, piece: bytearray, end: int) -> int:
        """Corrupt the bytes that are due in a piece that ends at stream position `end`."""
        count = 0
        while self._corrupt < end:
            piece[self._corrupt - self._at] ^= 1 << self._chance["bit"].randrange(8)
            count += 1
            # count the distance from this byte, not from the start of the piece
            self._corrupt += self._gap("corrupt", self.faults.corrupt_every_bytes)
        return count

    def _piece_bytes(self) -> int:
        limit = self.faults.split_bytes
        return self._chance["split"].randint(1, limit) if limit else _NEVER

    def _after(self, name: str, mean: int) -> int:
        return self._at + self._gap(name, mean) if mean else _NEVER

    def _gap(self, name: str, mean: int) -> int:
        return 1 + int(self._chance[name].expovariate(1 / mean))


_DRAWN = ("split", "jitter", "corrupt", "bit", "stall", "cut")
