"""Service servers, which support rmw_fastrtps and rmw_cyclonedds peers at the same time."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from pipros.basics.errors import PiprosError
from pipros.net.shared_workers import SharedWorkers
from pipros_ros2.inbox import ROS2_INBOX_BYTES
from pipros_ros2.interface import ROS2_CALLS
from pipros_ros2.rtps.identity import guid_text
from pipros_ros2.rtps.participant import Participant
from pipros_ros2.rtps.participant_core import ParticipantCore
from pipros_ros2.rtps.qos import Qos
from pipros_ros2.rtps.service_styles import (
    ServiceRequest,
    Style,
    endpoint_id,
    id_entry,
    read_request,
    style_of,
    topics_of,
)
from pipros_ros2.rtps.topics import cost_bytes
from pipros_ros2.rtps.writer_proxy import RtpsSample

SERVICE_QOS: Final = Qos(depth=10)
WRITER_QOS: Final = Qos(depth=0)
"""Keeps requests and replies until they are acknowledged. With a limited depth, replies for other clients
would displace one for a client whose reader has not yet answered the first heartbeat.
"""
_LOG = logging.getLogger("pipros_ros2")
_REPLY_READER_S: Final = 0.1
"""How long a reply waits for the client's reply reader to match, as in rmw_cyclonedds."""


class UnknownStyle(PiprosError):
    """A peer offers a service, but the style of its requests and replies is unknown."""


def style_at(core: ParticipantCore, guid: bytes) -> Style | None:
    """Return the style of the peer with this endpoint, or None if the style is unknown."""
    peer, endpoint = core.peers.get(guid[:12]), core.endpoint(guid)
    return style_of(peer.data, endpoint) if peer and endpoint else None


class RtpsServer:
    """A service server for clients of both styles (see `service_styles`).

    Each reply is sent only to the client that made the request.

    Attributes:
        refused: number of requests that were malformed, of unknown style, or beyond the limits.
        unanswered: number of replies that were not sent because no reply reader of the client had matched.
    """

    def __init__(
        self,
        participant: Participant,
        service: str,
        request_type: str,
        reply_type: str,
        handler: Callable[[bytes], bytes | None],
        request_hash: bytes = b"",
        reply_hash: bytes = b"",
    ) -> None:
        """Announce the service. `request_type` and `reply_type` are DDS names.

        Args:
            handler: called in a worker thread with the request as CDR, including the encapsulation header.
                Returns the reply in the same form, or None to send no reply. What it raises is logged.
            request_hash, reply_hash: entries of USER_DATA such as `typehash=RIHS01_…;`.
        """
        requests, replies = topics_of(service)
        self.refused = self.unanswered = 0
        self._participant = participant
        self._service = service
        self._handler = handler
        self._workers = SharedWorkers("ros2 service", ROS2_CALLS, ROS2_INBOX_BYTES)
        entry = id_entry(os.urandom(16), is_client=False)
        self._writer = participant.add_writer(replies, reply_type, WRITER_QOS, entry + reply_hash)
        self._reader = participant.add_reader(
            requests, request_type, SERVICE_QOS, self._on_request, entry + request_hash, is_direct=True
        )

    def _on_request(self, sample: RtpsSample) -> None:
        if not self._workers.run(sample.writer[:12], self._answer, sample, cost=cost_bytes(sample)):
            self.refused += 1

    def _answer(self, sample: RtpsSample) -> None:
        try:
            style = self._participant.ask(lambda core: style_at(core, sample.writer))
            request = read_request(sample, style) if style else None
            if request is None:
                self.refused += 1
                reason = "is malformed" if style else "comes from a peer of unknown style"
                level = logging.WARNING if self.refused == 1 else logging.DEBUG
                _LOG.log(level, "a request for %s %s [%s]", self._service, reason, guid_text(sample.writer))
            elif (payload := self._handler(request.payload)) is not None:
                self._reply(request, payload)
        except Exception as error:
            _LOG.warning("the service %s for ROS 2 failed: %s", self._service, error)

    def _reply(self, request: ServiceRequest, payload: bytes) -> None:
        entity = self._writer.entity
        self._participant.wait_for(lambda core: bool(_recipients(core, entity, request)), _REPLY_READER_S)
        recipients = self._participant.ask(lambda core: _recipients(core, entity, request))
        if not recipients:
            self.unanswered += 1
            return
        # Without waiting for space: a client that acknowledges nothing must not stop replies to others.
        self._participant.write(entity, request.reply(payload), request.related, recipients)

    @property
    def guids(self) -> tuple[bytes, bytes]:
        """The GUIDs of the reader and of the writer."""
        return self._reader.guid, self._writer.guid

    def clients(self) -> int:
        """Return the number of matched clients."""
        return len(self._reader.writers())

    def close(self) -> None:
        """Close the server. May be called repeatedly."""
        self._reader.close()
        self._writer.close()
        self._workers.close()


def _recipients(core: ParticipantCore, entity: bytes, request: ServiceRequest) -> frozenset[bytes]:
    """Return the reply readers of the client that sent a request."""
    readers = core.writer(entity).readers
    if request.reply_reader is not None and request.reply_reader in readers:
        return frozenset([request.reply_reader])
    guids = [guid for guid in readers if guid[:12] == request.writer[:12]]
    if request.style is Style.FAST:
        return frozenset(guids) if request.reply_reader is None and len(guids) == 1 else frozenset()
    client = core.endpoint(request.writer)
    wanted = endpoint_id(client.user_data) if client else None
    ids = {guid: endpoint_id(found.user_data) for guid in guids if (found := core.endpoint(guid))}
    return frozenset(guid for guid, found in ids.items() if wanted is None or found in (None, wanted))


@dataclass(frozen=True, slots=True)
class Target:
    """A server's request reader."""

    reader: bytes
    style: Style | None
