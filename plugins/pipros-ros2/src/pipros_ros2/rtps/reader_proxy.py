"""Matched readers, as a writer knows them: what each has received."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from pipros_ros2.rtps.parameters import Address
from pipros_ros2.rtps.submessages import AckNack, NackFrag

FIRST_HEARTBEAT_S: Final = 0.02


@dataclass(slots=True, eq=False)
class ReaderProxy:
    """A matched reader. Samples are identified by their sequence numbers.

    Attributes:
        head: the start of each datagram to the reader.
        first: the first sample for the reader.
        sent: the last sample that was sent to the reader, or that it must skip.
        wanted: the last sample that the reader should have.
        acked: the sample up to which the reader has acknowledged all samples.
        asked: number of times that the reader has asked for a heartbeat.
        given_up: the last sample that was counted as lost for the reader, or that the reader requested
            although it was not available; at first, the one before `first`.
        is_greeted: whether the reader has received a heartbeat: it has answered one, or has asked for one
            `ENOUGH_QUESTIONS` times.
        due: time of the next heartbeat.
    """

    guid: bytes
    address: Address
    head: bytes
    is_reliable: bool
    fragment_bytes: int
    first: int
    sent: int
    wanted: int
    acked: int
    asked: int = 0
    given_up: int = 0
    is_greeted: bool = False
    due: float = math.inf
    interval_s: float = FIRST_HEARTBEAT_S
    last_acknack: AckNack | None = None
    last_nack_frag: NackFrag | None = None

    @property
    def entity(self) -> bytes:
        return self.guid[12:]

    @property
    def is_behind(self) -> bool:
        return self.is_reliable and (self.acked < self.wanted or not self.is_greeted)
