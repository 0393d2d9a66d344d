"""Service clients, which support rmw_fastrtps and rmw_cyclonedds peers at the same time."""

from __future__ import annotations

import contextlib
import itertools
import os
import time
from queue import SimpleQueue

from pipros.basics.errors import NotFound
from pipros.basics.interruptible_wait import get_within_slice
from pipros_ros2.rtps.parameters import SampleIdentity, read_related_sample
from pipros_ros2.rtps.participant import Participant
from pipros_ros2.rtps.participant_core import ParticipantCore
from pipros_ros2.rtps.service_styles import (
    Style,
    cyclone_head,
    id_entry,
    read_cyclone_head,
    split_head,
    topics_of,
    with_head,
)
from pipros_ros2.rtps.services import SERVICE_QOS, WRITER_QOS, Target, UnknownStyle, style_at
from pipros_ros2.rtps.writer_proxy import RtpsSample


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
        self._writer = participant.add_writer(requests, request_type, WRITER_QOS, entry + request_hash)

    @property
    def guids(self) -> tuple[bytes, bytes]:
        """The GUIDs of the reader and of the writer."""
        return self._reader.guid, self._writer.guid

    def wait_for_server(self, timeout_s: float = 5.0) -> bool:
        """Wait for a server; return False after the timeout."""
        return self._participant.wait_for(lambda core: self._server(core) is not None, timeout_s)

    def _server(self, core: ParticipantCore) -> Target | None:
        """Return the newest server whose style is known, otherwise the newest server; None if there is none.

        A server that was killed stays in the list until its lease ends, in addition to its replacement.
        """
        writers = core.reader(self._reader.entity).writers
        offering = {guid[:12] for guid in writers}
        readers = [guid for guid in core.writer(self._writer.entity).readers if guid[:12] in offering]
        newest_first = [Target(guid, style_at(core, guid)) for guid in reversed(readers)]
        return next((each for each in newest_first if each.style), newest_first[0] if newest_first else None)

    def _has_server(self, core: ParticipantCore, reader: bytes) -> bool:
        """Return whether the server with this request reader is still known, and this client is open."""
        with contextlib.suppress(NotFound):  # this client was closed
            return reader in core.writer(self._writer.entity).readers
        return False

    def call(self, payload: bytes, timeout_s: float) -> bytes:
        """Call the service with CDR, including the encapsulation header; return the reply in the same form.

        Raises:
            NotFound: there is no server, or it ended before it replied.
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
                if not self._participant.ask(lambda core: self._has_server(core, target.reader)):
                    raise NotFound(f"the server of [{self._service}] ended before it replied")
        finally:
            self._pending.pop(key, None)
        raise TimeoutError(f"service [{self._service}] did not reply within {timeout_s} s")

    def _send(self, target: Target, payload: bytes, replies: SimpleQueue[bytes]) -> tuple[Style, int]:
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
