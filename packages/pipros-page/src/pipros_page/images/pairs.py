"""Pairs of images from two topics with nearly equal timestamps."""

from __future__ import annotations

import contextlib
import struct
import threading
from collections.abc import Iterator
from typing import Final

from pipros.msg.time import NS_PER_S
from pipros.node.any_msg import AnyMsg
from pipros_libraries.filters.synchronizer import ApproximateSynchronizer
from pipros_page.topic_watch import TopicWatch

APART_S: Final = 0.1
"""The timestamps of a pair differ by less than this (s)."""
QUEUE: Final = 10
"""Maximum number of images of each topic that wait for their counterparts."""
_STAMP: Final = struct.Struct("<4xII")

Pair = tuple[AnyMsg, AnyMsg]


class ImagePairs:
    """Matches images like Noetic's `ApproximateTimeSynchronizer`.

    Images are added by the threads that receive them.

    Attributes:
        newest: number of pairs so far, and the newest pair; None before the first pair.
    """

    def __init__(self) -> None:
        self.newest: tuple[int, Pair] | None = None
        self._matcher = ApproximateSynchronizer(2, QUEUE, round(APART_S * NS_PER_S))
        self._lock = threading.Lock()

    @contextlib.contextmanager
    def of(self, one: TopicWatch, other: TopicWatch) -> Iterator[None]:
        """Match the images of two topics within the context."""
        with (
            one.listening(lambda message, _: self._add(message, 0), from_newest=True),
            other.listening(lambda message, _: self._add(message, 1), from_newest=True),
        ):
            yield

    def _add(self, message: AnyMsg, index: int) -> None:
        if len(message.body) < _STAMP.size:
            return
        with self._lock:
            queue = self._matcher.queues[index]
            for one, other in self._matcher.add(message, stamp_ns(message), queue, index, None):
                number = self.newest[0] if self.newest else 0
                self.newest = number + 1, (one, other)


def stamp_ns(message: AnyMsg) -> int:
    """Return the timestamp of a message that begins with a header."""
    seconds, nanoseconds = _STAMP.unpack_from(message.body)
    return int(seconds) * NS_PER_S + int(nanoseconds)
