"""Pass datagrams from the sockets to a `ParticipantCore`, in short steps."""

from __future__ import annotations

import logging
import socket
import time
from collections.abc import Iterator, Sequence
from typing import Final

from pipros_ros2.rtps.participant_core import ParticipantCore
from pipros_ros2.rtps.sockets import SocketBacklog

WORK_AT_ONCE: Final = 256
"""Units of work (see `ParticipantCore.handle`) after which the participant releases its lock: a few ms."""
_DATAGRAMS_AT_ONCE: Final = 64
_READ_EVERY: Final = 4
_LOG = logging.getLogger("pipros_ros2")


class Intake:
    """Passes datagrams to a `ParticipantCore`, at most `WORK_AT_ONCE` units at a time. Not thread-safe.

    If a datagram causes more work, the next call continues with the same datagram.

    Attributes:
        failures: number of datagrams that revealed a bug in the core.
    """

    def __init__(
        self, core: ParticipantCore, backlog: SocketBacklog, sources: Sequence[socket.socket]
    ) -> None:
        self.failures = 0
        self._core = core
        self._backlog = backlog
        self._sources = sources
        self._current: Iterator[int] | None = None
        self._handled_until = 0.0

    def __bool__(self) -> bool:
        """Return whether datagrams were read but not yet handled."""
        return self._current is not None or bool(self._backlog)

    @property
    def handled_until(self) -> float:
        """A time such that all datagrams that were read before it have been handled."""
        return self._backlog.handled_until if self._current is None else self._handled_until

    def read(self, now: float) -> None:
        """Read the datagrams that have arrived."""
        self._backlog.read(self._sources, now)

    def handle(self) -> int:
        """Handle datagrams; return the units of work that this took."""
        now, work, datagrams = time.monotonic(), 0, 0
        while work < WORK_AT_ONCE and datagrams < _DATAGRAMS_AT_ONCE:
            if self._current is None:
                until = self._backlog.handled_until
                received = self._backlog.next()
                if received is None:
                    break
                self._handled_until = until
                self._current = self._core.handle(*received, now)
            done = self._continue(self._current)
            if done is not None:
                work += done
                continue
            self._current = None
            datagrams += 1
            if datagrams % _READ_EVERY == 0:
                now = time.monotonic()
                self._backlog.read(self._sources, now)
        return work

    def _continue(self, steps: Iterator[int]) -> int | None:
        """Take the next step of a datagram; return None if it has been handled.

        Any exception is a bug in the core: all are counted, the first is logged.
        """
        try:
            return next(steps, None)
        except Exception:
            self.failures += 1
            if self.failures == 1:
                _LOG.exception("a datagram could not be handled")
            return None
