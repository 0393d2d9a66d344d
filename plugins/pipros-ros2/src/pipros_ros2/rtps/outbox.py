"""Datagrams to send, immediately or in bursts.

A burst of large datagrams overflows a peer's receive buffer, which usually has 208 KiB: enough for three
60 kB datagrams. Therefore, fragments, repeated samples and the history for late readers are sent in short
bursts. What readers have requested goes first, in up to half of each burst: the samples that lack it are the
next that a limited history displaces.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Final, NamedTuple

from pipros_ros2.rtps.parameters import Address
from pipros_ros2.rtps.submessages import Buffer

BURST_BYTES: Final = 120_000
BURST_EVERY_S: Final = 0.0003


class Outgoing(NamedTuple):
    """A datagram in parts, which the operating system joins."""

    address: Address
    parts: tuple[Buffer, ...]


class Transfer(NamedTuple):
    """Datagrams for one reader, which may take several bursts.

    Attributes:
        key: identifies the transfer. Only one transfer with the same key is queued at a time.
        datagrams: iterator that creates each datagram when it is sent.
        is_current: function that returns False if the sample is no longer kept. The remaining datagrams are
            then dropped.
    """

    key: tuple[bytes, bytes, int]
    datagrams: Iterator[Outgoing]
    is_current: Callable[[], bool]


class DatagramOutbox:
    """Collects the datagrams of all writers and readers of a participant.

    Attributes:
        sending: keys of the transfers that are being sent.
    """

    def __init__(self) -> None:
        self.sending: set[tuple[bytes, bytes, int]] = set()
        self._ready: list[Outgoing] = []
        self._requested: dict[tuple[bytes, bytes, int], Transfer] = {}
        self._transfers: dict[tuple[bytes, bytes, int], Transfer] = {}
        self._next_burst_at = -math.inf

    def send(self, address: Address, *parts: Buffer) -> None:
        """Add a datagram to be sent immediately."""
        self._ready.append(Outgoing(address, parts))

    def queue(self, transfer: Transfer, *, is_requested: bool = False) -> None:
        """Add a transfer to be sent in bursts, after earlier ones. Do nothing if it is queued already."""
        if not self.is_queued(transfer.key):
            (self._requested if is_requested else self._transfers)[transfer.key] = transfer

    def is_queued(self, key: tuple[bytes, bytes, int]) -> bool:
        """Return whether a transfer is queued or still being sent."""
        return key in self._requested or key in self._transfers

    @property
    def deadline(self) -> float:
        """Time of the next burst; infinite if there is none."""
        return self._next_burst_at if self._requested or self._transfers else math.inf

    def poll(self, now: float) -> None:
        """Add the next burst to the datagrams to send, if it is due."""
        if now < self.deadline:
            return
        self._next_burst_at = now + BURST_EVERY_S
        left_bytes = BURST_BYTES
        while left_bytes > 0 and (self._requested or self._transfers):
            goes_first = self._requested and (left_bytes > BURST_BYTES // 2 or not self._transfers)
            queue = self._requested if goes_first else self._transfers
            key, transfer = next(iter(queue.items()))
            datagram = next(transfer.datagrams, None) if transfer.is_current() else None
            if datagram is None:
                del queue[key]
                self.sending.discard(key)
                continue
            self.sending.add(key)
            self._ready.append(datagram)
            left_bytes -= sum(map(len, datagram.parts))

    def take(self) -> list[Outgoing]:
        """Return the datagrams to send now, and remove them."""
        ready, self._ready = self._ready, []
        return ready
