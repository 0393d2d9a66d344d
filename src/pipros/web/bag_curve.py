"""Curves of whole bags: a bounded number of samples from all messages of a topic, in pieces."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from typing import Any, Final

from pipros.bag.connection import Connection
from pipros.bag.reader import BagReader
from pipros.basics.errors import PiprosError
from pipros.msg.time import NS_PER_S

MOST_SAMPLES: Final = 20_000
PIECE_S: Final = 0.2
"""Time after which a piece is sent."""

Take = Callable[[Any, float], Any]
"""Called with a decoded message and its time (s) in the bag. Returns a sample, or None."""


class BagSamples:
    """Samples of the messages of some connections. All methods block.

    Of more than `MOST_SAMPLES` messages, evenly spaced ones are decoded.

    Attributes:
        left_out: number of messages that are not decoded.
    """

    def __init__(self, reader: BagReader, connections: Sequence[Connection], take: Take) -> None:
        self._reader = reader
        self._take = take
        counts = reader.count_by_connection()
        total = sum(counts.get(each.id, 0) for each in connections)
        self._step = max(1, math.ceil(total / MOST_SAMPLES))
        self.left_out = total - math.ceil(total / self._step)
        self._messages = enumerate(reader.stored_messages(connections))

    def next_piece(self) -> tuple[list[Any], str] | None:
        """Return further samples, and the last problem; None at the end of the bag."""
        samples: list[Any] = []
        problem = ""
        until_s = time.monotonic() + PIECE_S
        for number, message in self._messages:
            if number % self._step == 0:
                try:
                    decoded = self._reader.class_of(message.connection)._from_bytes(message.data)
                    sample = self._take(decoded, message.time_ns / NS_PER_S)
                except (PiprosError, ValueError) as error:
                    sample, problem = None, str(error)
                if sample is not None:
                    samples.append(sample)
            if time.monotonic() > until_s:
                return samples, problem
        return (samples, problem) if samples or problem else None
