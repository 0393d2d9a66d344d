"""Sample a topic's messages in a bag for plotting: a limited number of samples, returned in pieces."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.msg.time import NS_PER_S
from pipros_tools.bag.connection import Connection
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.reader import BagReader

MAX_SAMPLES: Final = 20_000
PIECE_S: Final = 0.2
"""Time (s) in which the samples of one piece are collected."""

Take = Callable[[Any, float], Any]
"""Called with a decoded message and its time (s) in the bag. Returns a sample, or None."""


class BagSamples:
    """Samples of the messages on the given connections. All methods block.

    If there are more than `MAX_SAMPLES` messages, only evenly spaced messages are decoded.

    Args:
        limit_s: maximum processor time (s) that `take` may use for one message.

    Attributes:
        left_out: number of messages that are not decoded.
    """

    def __init__(
        self,
        reader: BagReader,
        connections: Sequence[Connection],
        take: Take,
        limit_s: float = math.inf,
    ) -> None:
        self._reader = reader
        self._take = take
        self._limit_s = limit_s
        counts = reader.count_by_connection()
        total = sum(counts.get(each.id, 0) for each in connections)
        self._step = max(1, math.ceil(total / MAX_SAMPLES))
        self.left_out = total - math.ceil(total / self._step)
        self._messages = enumerate(reader.stored_messages(connections))

    def next_piece(self) -> tuple[list[Any], str] | None:
        """Return the next samples and the last error's text (empty if none), or None at the end of the bag.

        Raises:
            BagError: a sample takes too long, or the bag is damaged.
        """
        samples: list[Any] = []
        problem = ""
        until_s = time.monotonic() + PIECE_S
        for number, message in self._messages:
            if number % self._step == 0:
                begin_s = math.inf
                try:
                    decoded = self._reader.class_of(message.connection)._from_bytes(message.data)
                    begin_s = time.thread_time()  # decoding may have compiled the message class
                    sample = self._take(decoded, message.time_ns / NS_PER_S)
                except (PiprosError, ValueError) as error:
                    sample, problem = None, str(error)
                sample_s = time.thread_time() - begin_s
                if sample_s > self._limit_s:
                    what = f"a sample takes {sample_s:.1f} s, and the limit is {self._limit_s} s"
                    raise BagError(f"{what}; choose a simpler expression")
                if sample is not None:
                    samples.append(sample)
            if time.monotonic() > until_s:
                return samples, problem
        return (samples, problem) if samples or problem else None
