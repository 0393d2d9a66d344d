"""Service servers and clients, which support rmw_fastrtps and rmw_cyclonedds peers at the same time."""

from __future__ import annotations

import itertools
import logging
import os
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from queue import SimpleQueue
from typing import Final

from pipros.basics.budget import Budget
from pipros.basics.errors import NotFound, PiprosError
from pipros.basics.interruptible_wait import get_within_slice
from pipros.basics.limits import process_limits
from pipros.basics.turns import Turns
from pipros.net.workers import Workers
from pipros.ros2.limits import Ros2Limits
from pipros.ros2.rtps.identity import guid_text
from pipros.ros2.rtps.parameters import SampleIdentity, read_related_sample
from pipros.ros2.rtps.participant import Participant
from pipros.ros2.rtps.participant_core import ParticipantCore
from pipros.ros2.rtps.qos import Qos
from pipros.ros2.rtps.reader import RtpsSample
from pipros.ros2.rtps.service_styles import (
    ServiceRequest,
    Style,
    cyclone_head,
    endpoint_id,
    id_entry,
    read_cyclone_head,
    read_request,
    split_head,
    style_of,
    topics_of,
    with_head,
)
from pipros.ros2.rtps.topics import cost_bytes

SERVICE_QOS: Final = Qos(depth=10)
_WRITER_QOS: Final = Qos(depth=0)
"""Keeps requests and replies until they are acknowledged. With a limited depth, replies for other clients
would displace one for a client whose reader has not yet answered the first heartbeat.
"""
_LOG = logging.getLogger("pipros.ros2")
_REPLY_READER_S: Final = 0.1
"""How long a reply waits for the client's reply reader to match, as in rmw_cyclonedds."""
_WORKERS: Final = 16


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
                Returns the reply in the same form, or None to send no reply.
            request_hash, reply_hash: entries of USER_DATA such as `typehash=RIHS01_…;`.
        """
        requests, replies = topics_of(service)
        self.refused = self.unanswered = 0
        self._participant = participant
        self._service = service
        self._handler = handler
        self._workers = Workers("ros2 service", _WORKERS)
        self._queued = Budget(process_limits().of(Ros2Limits).ros2_inbox_bytes)
        self._clients: dict[bytes, Budget] = {}
        self._turns: Turns[bytes, RtpsSample] = Turns()
        self._lock = threading.Lock()
        entry = id_entry(os.urandom(16), is_client=False)
        self._writer = participant.add_writer(replies, reply_type, _WRITER_QOS, entry + reply_hash)
        self._reader = participant.add_reader(
            requests, request_type, SERVICE_QOS, self._on_request, entry + request_hash, is_direct=True
        )

    def _on_request(self, sample: RtpsSample) -> None:
        """Queue a request.

        Participants take turns. Each may use at most half of the memory that the others leave.
        """
        client = sample.writer[:12]
        with self._lock:
            budget = self._clients.get(client) or Budget(self._queued.limit, self._queued, part=0.5)
            if not budget.take(cost_bytes(sample)):
                self.refused += 1
                return
            self._clients[client] = budget
            self._turns.put(client, sample)
        try:
            self._workers.run(self._answer_next)
        except RuntimeError:  # the system cannot start another thread
            with self._lock:
                self.refused += 1
                if self._turns:
                    self._forget(self._turns.pop()[1])

    def _forget(self, sample: RtpsSample) -> None:
        """Return the bytes of a request to its budget. The caller holds the lock."""
        client = sample.writer[:12]
        budget = self._clients[client]
        budget.give_back(cost_bytes(sample))
        if not budget.used:
            del self._clients[client]

    def _answer_next(self) -> None:
        with self._lock:
            if not self._turns:
                return
            _, sample = self._turns.pop()
        try:
            self._answer(sample)
        finally:
            with self._lock:
                self._forget(sample)

    def _answer(self, sample: RtpsSample) -> None:
        try:
            style = self._participant.ask(lambda core: style_at(core, sample.writer))
            request = read_request(sample, style) if style else None
            if request is None:
                self.refused += 1
                reason = "is malformed" if style else "comes from a peer of unknown style"
                _LOG.warning("a request for %s %s [%s]", self._service, reason, guid_text(sample.writer))
                return
            payload = self._handler(request.payload)
            if payload is not None:
                self._reply(request, payload)
        except PiprosError as error:
            _LOG.warning("the reply of %s was not sent: %s", self._service, error)

    def _reply(self, request: ServiceRequest, payload: bytes) -> None:
        entity = self._writer.entity
        self._participant.wait_for(lambda core: bool(_recipients(core, entity, request)), _REPLY_READER_S)
        recipients = self._participant.ask(lambda core: _recipients(core, entity, request))
        if not recipients:
            self.unanswered += 1
            return
        self._writer.write(request.reply(payload), related=request.related, recipients=recipients)

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
class _Target:
    """A server's request reader."""

    reader: bytes
    style: Style | None


class RtpsClient:
    """A service client. Thread-safe; calls may run concurrently."""

    def __init__(
        self,
        participant: Participant,
        service: str,
        request_type: str,
        reply_type: str,
        request_hash: bytes = b"",
        reply_hash: bytes = b"",
    ) -> None:
        """Announce the client. See `RtpsServer` for the arguments."""
        requests, replies = topics_of(service)
        self._participant = participant
        self._service = service
        self._id = int.from_bytes(os.urandom(8), "little")
        self._numbers = itertools.count(1)
        self._pending: dict[tuple[Style, int], SimpleQueue[bytes]] = {}
        entry = id_entry(os.urandom(16), is_client=True)
        self._reader = participant.add_reader(
            replies, reply_type, SERVICE_QOS, self._on_reply, entry + reply_hash, is_direct=True
        )
        self._writer = participant.add_writer(requests, request_type, _WRITER_QOS, entry + request_hash)

    @property
    def guids(self) -> tuple[bytes, bytes]:
        """The GUIDs of the reader and of the writer."""
        return self._reader.guid, self._writer.guid

    def wait_for_server(self, timeout_s: float = 5.0) -> bool:
        """Wait for a server; return False after the timeout."""
        return self._participant.wait_for(lambda core: self._server(core) is not None, timeout_s)

    def _server(self, core: ParticipantCore) -> _Target | None:
        """Return the newest server whose style is known, otherwise the newest server; None if there is none.

        A server that was killed stays in the list until its lease ends, in addition to its replacement.
        """
        writers = core.reader(self._reader.entity).writers
        offering = {guid[:12] for guid in writers}
        readers = [guid for guid in core.writer(self._writer.entity).readers if guid[:12] in offering]
        newest_first = [_Target(guid, style_at(core, guid)) for guid in reversed(readers)]
        return next((each for each in newest_first if each.style), newest_first[0] if newest_first else None)

    def call(self, payload: bytes, timeout_s: float) -> bytes:
        """Call the service with CDR, including the encapsulation header; return the reply in the same form.

        Raises:
            NotFound: there is no server.
            UnknownStyle: the server's style is unknown; nothing was sent.
            TimeoutError: the reply did not arrive in time.
        """
        deadline = time.monotonic() + timeout_s
        target = self._participant.ask(self._server)
        if target is None:
            raise NotFound(f"service [{self._service}] has no server in ROS 2")
        if target.style is None:
            raise UnknownStyle(
                f"service [{self._service}] is offered by a DDS implementation whose service style is unknown"
            )
        replies: SimpleQueue[bytes] = SimpleQueue()
        key = self._send(target, payload, replies)
        try:
            while (left_s := deadline - time.monotonic()) > 0:
                reply = get_within_slice(replies, left_s)
                if reply is not None:
                    return reply
        finally:
            self._pending.pop(key, None)
        raise TimeoutError(f"service [{self._service}] did not reply within {timeout_s} s")

    def _send(self, target: _Target, payload: bytes, replies: SimpleQueue[bytes]) -> tuple[Style, int]:
        entity, recipients = self._writer.entity, frozenset([target.reader])
        if target.style is Style.CYCLONE:
            number = next(self._numbers)
            self._pending[Style.CYCLONE, number] = replies
            payload = with_head(payload, cyclone_head(self._id, number))
            self._participant.write(entity, payload, None, recipients)
            return Style.CYCLONE, number
        related = SampleIdentity(self._reader.guid, 0)

        def register(number: int) -> None:
            self._pending[Style.FAST, number] = replies

        number = self._participant.write(entity, payload, related, recipients, register)
        return Style.FAST, number

    def _on_reply(self, sample: RtpsSample) -> None:
        related = read_related_sample(sample.inline)
        payload = sample.payload
        if related is not None:
            if related.guid not in (self._reader.guid, self._writer.guid):
                return
            waiting = self._pending.get((Style.FAST, related.sequence))
        else:
            found = split_head(payload)
            numbers = read_cyclone_head(found[0]) if found else None
            if found is None or numbers is None or numbers[0] != self._id:
                return
            waiting, payload = self._pending.get((Style.CYCLONE, numbers[1])), found[1]
        if waiting is not None:
            waiting.put(payload)

    def close(self) -> None:
        """Close the client. May be called repeatedly."""
        self._reader.close()
        self._writer.close()
