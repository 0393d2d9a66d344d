"""Delivery of submessages to the writers and readers of a participant that they are for."""

from __future__ import annotations

from typing import Final

from pipros_ros2.rtps.connections import Connections
from pipros_ros2.rtps.identity import PUBLICATIONS_WRITER, SUBSCRIPTIONS_WRITER, UNKNOWN_ENTITY
from pipros_ros2.rtps.submessages import (
    AckNack,
    Data,
    DataFrag,
    Gap,
    Heartbeat,
    HeartbeatFrag,
    NackFrag,
    Submessage,
)

_ENDPOINT_WORK: Final = 16
_ANSWER_WORK: Final = 8


class Delivery:
    """Passes submessages of known peers to connected endpoints."""

    def __init__(self, connections: Connections) -> None:
        self._connections = connections

    def deliver(self, prefix: bytes, submessage: Submessage, now: float) -> int:
        """Handle a submessage of the peer with a prefix; return the units of work that it caused."""
        work = self._work_of(prefix, submessage)
        if isinstance(submessage, AckNack | NackFrag):
            self._to_writer(prefix, submessage, now)
        else:
            self._to_readers(prefix, submessage, now)
        return work

    def _work_of(self, prefix: bytes, submessage: Submessage) -> int:
        """Return the units of work that a submessage causes."""
        if isinstance(submessage, Data | DataFrag | HeartbeatFrag):
            is_discovery = submessage.writer in (PUBLICATIONS_WRITER, SUBSCRIPTIONS_WRITER)
            return _ENDPOINT_WORK if is_discovery else 1
        if isinstance(submessage, AckNack):
            return _ANSWER_WORK + len(submessage.missing)
        if isinstance(submessage, NackFrag):
            return _ANSWER_WORK + len(submessage.missing) // 8
        guid = prefix + submessage.writer
        readers = self._connections.readers.get(guid, ())
        others = len(submessage.others) // 8 if isinstance(submessage, Gap) else 0
        return 1 + sum(_ANSWER_WORK + others + reader.work(guid) for reader in readers)

    def _to_readers(self, prefix: bytes, submessage: Submessage, now: float) -> None:
        guid = prefix + submessage.writer
        for reader in self._connections.readers.get(guid, ()):
            if submessage.reader != UNKNOWN_ENTITY and submessage.reader != reader.entity:
                continue
            if isinstance(submessage, Data):
                reader.on_data(guid, submessage, now)
            elif isinstance(submessage, Heartbeat):
                reader.on_heartbeat(guid, submessage, now)
            elif isinstance(submessage, DataFrag):
                reader.on_data_frag(guid, submessage, now)
            elif isinstance(submessage, HeartbeatFrag):
                reader.on_heartbeat_frag(guid, submessage, now)
            elif isinstance(submessage, Gap):
                reader.on_gap(guid, submessage)
            if reader.is_waiting:
                self._connections.busy.add(reader)

    def _to_writer(self, prefix: bytes, submessage: AckNack | NackFrag, now: float) -> None:
        writer = self._connections.writers.get(submessage.writer)
        if writer is None:
            return
        guid = prefix + submessage.reader
        if isinstance(submessage, AckNack):
            writer.on_acknack(guid, submessage, now)
        else:
            writer.on_nack_frag(guid, submessage)
        self._connections.busy.add(writer)
