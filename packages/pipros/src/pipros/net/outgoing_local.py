"""The sending end of a link to a subscriber that accepts shared memory (`pipros.net.shared_memory`)."""

from __future__ import annotations

import contextlib
import socket
import sys
import time
from collections.abc import Callable
from typing import Any

from pipros.basics.limits import Limits
from pipros.net.backlog import WireMessage
from pipros.net.link_memory import PlacedMessage
from pipros.net.loop import BackgroundLoop
from pipros.net.outgoing import OutgoingLink
from pipros.net.outgoing_state import LinkEvent, LinkState
from pipros.net.shared_memory import TopicMemory
from pipros.net.timings import LinkTimings
from pipros.wire.slot_frames import OFFER, ControlFrame, encode

_OFFER = encode(ControlFrame(OFFER, 0))

RETURN_INTERVAL_S = 0.1
"""Interval between attempts to return from the stream to shared memory."""

# aliases: enum lookups per message are slow
_IDLE, _RECOVERING, _QUEUED = LinkState.IDLE, LinkState.RECOVERING, LinkState.QUEUED


class LocalOutgoingLink(OutgoingLink):
    """Sends messages to one subscriber on this machine, through its stream or in shared memory.

    Attributes:
        memory: the link's shared-memory state.
    """

    def __init__(
        self,
        sock: socket.socket,
        loop: BackgroundLoop,
        *,
        queue_size: int | None,
        limits: Limits,
        timings: LinkTimings,
        memory: TopicMemory,
        on_closed: Callable[[OutgoingLink], object],
    ) -> None:
        self.memory = memory.add(self)
        self._is_offered = False
        self._next_return_s = 0.0
        super().__init__(
            sock, loop, queue_size=queue_size, limits=limits, timings=timings, on_closed=on_closed
        )

    def send_placed(self, placed: PlacedMessage, message: WireMessage, size: int) -> None:
        """Like `send`, for a message that is also in a slot.

        The subscriber gets the slot if no earlier message is queued and the subscriber has room for another
        slot. Otherwise, the message is sent through the stream.
        """
        with self._lock:
            if self.state is _IDLE and (given := self.memory.give(placed)) is not None:
                frames, rights = given
                try:
                    sent = _send(self.sock, frames, rights)
                except OSError:  # the socket is full or closed, or too many descriptors are in flight
                    self.memory.take_back(placed)
                else:
                    self.memory.sent(placed)
                    self.statistics.bytes += size - len(frames) + sent
                    if sent == len(frames):
                        self.statistics.frames += 1
                    else:
                        self._backlog.append_rest((frames,), sent)
                        self._apply(LinkEvent.SOCKET_FULL)
                    return
        self.send(message, size)

    @property
    def is_briefly_waited_for(self) -> bool:
        """Also from time to time while the event loop sends large messages through the stream.

        Otherwise, a publisher that is always ahead would never use shared memory again.
        """
        if super().is_briefly_waited_for:
            return True
        now_s = time.monotonic()
        with self._lock:
            if self.state is not _QUEUED or not self.memory.is_ready or now_s < self._next_return_s:
                return False
            self._next_return_s = now_s + RETURN_INTERVAL_S
            return self._backlog.is_in_large_buffer

    def offer_memory(self) -> None:
        """Offer shared memory if it has not been offered yet."""
        if not self._is_offered:
            self._is_offered = True
            with self._lock:
                self._send_frame(_OFFER)

    def send_drop(self, frame: bytes) -> None:
        """Send a DROP frame, which announces that the newest segment is no longer used."""
        with self._lock:
            self._send_frame(frame)
            self.memory.known = 0

    def end(self, reason: str) -> None:
        """Close the link, and log the reason unless it is empty."""
        self.end_reason = reason
        self.close()

    def _send_frame(self, frame: bytes) -> None:
        """Send a control frame, after the rest of a partially written message. The caller holds the lock."""
        if self.is_closed:
            return
        sent = 0
        if self.state is _IDLE or self.state is _RECOVERING:
            with contextlib.suppress(OSError):  # sending the next message reports a closed socket
                sent = self.sock.send(frame)
        if sent == len(frame):
            return
        self.statistics.bytes -= len(frame) - sent
        if self._backlog.insert(frame[sent:]):
            self.statistics.frames -= 1
        self._apply(LinkEvent.SOCKET_FULL)
        self._apply(LinkEvent.LEFT_TO_LOOP)

    def _read(self) -> None:
        super()._read()
        if self._received_bytes:  # the reply to the offer
            self.memory.is_ready = self._is_offered

    def _give_up(self) -> None:
        super()._give_up()
        self.memory.close()


def _send(sock: socket.socket, frames: bytes, rights: list[Any]) -> int:
    """Send frames with their descriptors, which arrive with the first byte."""
    if sys.platform == "win32" or not rights:
        return sock.send(frames)
    return sock.sendmsg([frames], rights)
