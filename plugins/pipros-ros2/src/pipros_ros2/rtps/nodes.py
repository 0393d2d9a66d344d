"""Receive and publish a domain's nodes on the topic `ros_discovery_info`."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import Final

from pipros_ros2.rtps.graph_info import (
    READER_QOS,
    TOPIC,
    TYPE_HASH,
    TYPE_NAME,
    WRITER_QOS,
    GidBytes,
    GraphInfo,
    Knowledge,
    NodeInfo,
    ParticipantInfo,
)
from pipros_ros2.rtps.identity import PARTICIPANT_ENTITY
from pipros_ros2.rtps.participant import Participant
from pipros_ros2.rtps.topics import RtpsTopicWriter
from pipros_ros2.rtps.writer_proxy import RtpsSample

MAX_INFO_BYTES: Final = 256 * 1024
"""Maximum size of a participant's list of nodes: about 10,000 endpoints."""


class Nodes:
    """The nodes of all participants. Thread-safe."""

    def __init__(self, participant: Participant, size: GidBytes | None = None) -> None:
        """Subscribe to the topic. Nothing is published, and no writer announced, until the GID size is known.

        Args:
            size: GID size in this domain; None to learn it.
        """
        self._participant = participant
        self._lock = threading.Lock()
        self._info = GraphInfo(participant.prefix + PARTICIPANT_ENTITY, self._make_writer, size)
        participant.add_reader(TOPIC, TYPE_NAME, READER_QOS, self._on_sample, _type_hash(size))

    def _make_writer(self) -> RtpsTopicWriter:
        return self._participant.add_writer(TOPIC, TYPE_NAME, WRITER_QOS, _type_hash(self._info.size))

    def _on_sample(self, sample: RtpsSample) -> None:
        if len(sample.payload) > MAX_INFO_BYTES:
            return
        with self._lock:
            self._info.on_message(sample.payload, sample.writer[:12])

    @property
    def knowledge(self) -> Knowledge:
        """Whether the GID size in the domain is known."""
        return self._info.knowledge

    def announce(self, nodes: Sequence[NodeInfo]) -> None:
        """Publish our own nodes, now or as soon as the GID size is known."""
        with self._lock:
            self._info.announce(nodes)

    def forget(self, prefix: bytes) -> None:
        """Remove the nodes of a participant that has ended."""
        with self._lock:
            self._info.forget(prefix)

    def others(self) -> list[ParticipantInfo]:
        """Return the nodes of the other participants."""
        with self._lock:
            return list(self._info.others.values())


def _type_hash(size: GidBytes | None) -> bytes:
    return b"" if size is GidBytes.HUMBLE else TYPE_HASH
