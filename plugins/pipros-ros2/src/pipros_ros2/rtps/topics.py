"""Thread-safe handles for a participant's writers and readers."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Protocol, TypeVar

from pipros.basics.errors import PiprosError
from pipros_ros2.inbox import OVERHEAD_BYTES, Inbox
from pipros_ros2.rtps.incomplete import inline_bytes
from pipros_ros2.rtps.parameters import SampleIdentity
from pipros_ros2.rtps.participant_core import ParticipantCore
from pipros_ros2.rtps.writer_proxy import RtpsSample

_Answer = TypeVar("_Answer")
_LOG = logging.getLogger("pipros_ros2")


def cost_bytes(sample: RtpsSample) -> int:
    """Return the memory that a queued sample takes."""
    return len(sample.payload) + inline_bytes(sample.inline) + OVERHEAD_BYTES


class ParticipantClosed(PiprosError):
    """The participant is closed. Callbacks that run while it closes may raise this."""


class RunningEngine(Protocol):
    """The participant that owns a writer or reader."""

    @property
    def prefix(self) -> bytes: ...

    def ask(self, question: Callable[[ParticipantCore], _Answer]) -> _Answer: ...

    def wait_for(self, condition: Callable[[ParticipantCore], bool], timeout_s: float) -> bool: ...

    def write(
        self,
        entity: bytes,
        payload: bytes,
        related: SampleIdentity | None,
        recipients: frozenset[bytes] | None,
    ) -> int: ...

    def remove(self, entity: bytes) -> None: ...


class RtpsTopicWriter:
    """A writer of a participant. Thread-safe."""

    def __init__(self, participant: RunningEngine, entity: bytes) -> None:
        self._participant = participant
        self.entity = entity

    @property
    def guid(self) -> bytes:
        return self._participant.prefix + self.entity

    def write(
        self,
        payload: bytes,
        timeout_s: float = 0.0,
        related: SampleIdentity | None = None,
        recipients: frozenset[bytes] | None = None,
    ) -> int:
        """Send CDR data with its encapsulation header, and return the sequence number.

        A writer with depth 0 blocks for up to `timeout_s` while its reliable readers do not keep up.

        Raises:
            LimitExceeded: the message is larger than `ROS2_HISTORY_BYTES`.
            TimeoutError: the readers did not make room in time.
            PiprosError: the writer or its participant is closed.
        """
        participant = self._participant
        if not participant.wait_for(lambda core: core.writer(self.entity).has_space(len(payload)), timeout_s):
            raise TimeoutError(
                f"ROS 2 readers did not make room for {len(payload)} bytes within {timeout_s} s"
            )
        return participant.write(self.entity, payload, related, recipients)

    def readers(self) -> frozenset[bytes]:
        """Return the GUIDs of the matched readers."""
        return self._participant.ask(lambda core: frozenset(core.writer(self.entity).readers))

    @property
    def lost(self) -> int:
        """Number of samples that readers are known to have lost; see `Writer.lost`."""
        return self._participant.ask(lambda core: core.writer(self.entity).lost)

    def wait_for_readers(self, count: int = 1, timeout_s: float = 5.0) -> bool:
        """Wait until `count` readers have matched; return False after the timeout."""
        return self._participant.wait_for(
            lambda core: len(core.writer(self.entity).readers) >= count, timeout_s
        )

    def wait_for_acknowledgments(self, timeout_s: float = 5.0) -> bool:
        """Wait until all reliable readers have acknowledged all samples; return False after the timeout."""
        return self._participant.wait_for(lambda core: core.writer(self.entity).is_acknowledged, timeout_s)

    def close(self) -> None:
        """Remove the writer, and notify the peers. May be called repeatedly."""
        self._participant.remove(self.entity)


class TopicReader:
    """A reader of a participant. Samples wait in its inbox for the callback. Thread-safe."""

    def __init__(
        self, participant: RunningEngine, callback: Callable[[RtpsSample], None], depth: int, limit_bytes: int
    ) -> None:
        self._participant = participant
        self._callback = callback
        self._inbox = Inbox(depth, limit_bytes, cost_bytes)
        self.entity = b""

    @property
    def guid(self) -> bytes:
        return self._participant.prefix + self.entity

    @property
    def dropped(self) -> int:
        """Number of samples that were dropped because the callback was too slow."""
        return self._inbox.dropped

    def writers(self) -> frozenset[bytes]:
        """Return the GUIDs of the matched writers."""
        return self._participant.ask(lambda core: frozenset(core.reader(self.entity).writers))

    def wait_for_writers(self, count: int = 1, timeout_s: float = 5.0) -> bool:
        """Wait until `count` writers have matched; return False after the timeout."""
        return self._participant.wait_for(
            lambda core: len(core.reader(self.entity).writers) >= count, timeout_s
        )

    def push(self, sample: RtpsSample) -> bool:
        """Add a sample, and drop the oldest ones beyond the limits. Return True if the inbox was empty."""
        return self._inbox.push(sample)

    def call_back(self) -> None:
        """Run the callback for all samples in the inbox."""
        while (sample := self._inbox.pop()) is not None:
            try:
                self._callback(sample)
            except ParticipantClosed:
                return
            except Exception:
                _LOG.exception("a callback for ROS 2 failed")

    def close(self) -> None:
        """Remove the reader, and notify the peers. May be called repeatedly."""
        self._participant.remove(self.entity)
