"""The shared-memory state of the link to one subscriber; see `pipros.net.shared_memory`."""

from __future__ import annotations

import array
import os
import socket
import sys
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from pipros.wire.slot_frames import SEGMENT, ControlFrame, Slot, encode

if TYPE_CHECKING:
    from pipros.net.shared_segment import Segment


class SlotGiver(Protocol):
    """The topic's memory, which gives slots to a subscriber and takes them back.

    A protocol because its implementation, `TopicMemory`, imports this module.
    """

    def give(self, link: LinkMemory, placed: PlacedMessage) -> bool: ...

    def take_back(self, link: LinkMemory, placed: PlacedMessage) -> None: ...

    def remove(self, link: LinkMemory) -> None: ...

    def report(self, error: OSError) -> None: ...


class MemorySharingLink(Protocol):
    """The link to a subscriber that shares memory.

    A protocol because its implementation, `LocalOutgoingLink`, imports the module of `TopicMemory`.
    """

    queue_size: int | None

    def end(self, reason: str) -> object:
        """Close the link, and log the reason unless it is empty."""

    def offer_memory(self) -> None:
        """Offer shared memory if it has not been offered yet."""

    def send_drop(self, frame: bytes) -> None:
        """Send a DROP frame, which announces that the newest segment is no longer used."""


class PlacedMessage(NamedTuple):
    """A message in a slot that the publisher holds until it calls `TopicMemory.release`."""

    segment: Segment
    slot: Slot
    frame: bytes


class LinkMemory:
    """The shared-memory state of one link.

    All methods except `close_descriptors` are called with the link's lock held.

    Attributes:
        is_ready: whether the subscriber has accepted the offer of memory.
        is_slow: whether the publisher's wait for the subscriber has timed out. Until a slow subscriber has
            handled all waiting messages, it is not waited for, and without a queue it gets no slot.
        known: the number of the newest segment that was sent to the subscriber; 0 for none.
    """

    def __init__(self, topic: SlotGiver, owner: MemorySharingLink) -> None:
        self.owner = owner
        self.is_ready = False
        self.is_slow = False
        self.acknowledgements = -1  # read end of the pipe, opened when the subscriber gets its first segment
        self.known = 0
        self._pipe_to_send = -1
        self._topic = topic

    def give(self, placed: PlacedMessage) -> tuple[bytes, list[Any]] | None:
        """Add the subscriber to the holders of a slot.

        Return the frames to send, with their descriptors; None if the subscriber has no room, or if no pipe
        can be created.
        """
        if not self._topic.give(self, placed):
            return None
        if self.known == placed.segment.number or sys.platform != "linux":
            return placed.frame, []
        segment = placed.segment
        descriptors = [segment.descriptor]
        if self.acknowledgements < 0:
            try:
                self.acknowledgements, self._pipe_to_send = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
            except OSError as error:
                self.take_back(placed)
                self._topic.report(error)
                return None
        if self._pipe_to_send >= 0:
            descriptors.append(self._pipe_to_send)
        introduction = encode(ControlFrame(SEGMENT, segment.number, segment.slot_bytes, segment.slots))
        rights = (socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", descriptors))
        return introduction + placed.frame, [rights]

    def sent(self, placed: PlacedMessage) -> None:
        """Record that the frames from `give` were sent."""
        if self.known != placed.segment.number:
            self.known = placed.segment.number
            if self._pipe_to_send >= 0:
                os.close(self._pipe_to_send)
                self._pipe_to_send = -1

    def take_back(self, placed: PlacedMessage) -> None:
        """Undo `give`, because the frames could not be sent."""
        self._topic.take_back(self, placed)

    def close(self) -> None:
        """Release all slots of the subscriber. May be called repeatedly."""
        self._topic.remove(self)

    def close_descriptors(self) -> None:
        """Close the pipe. Called with the topic's lock held."""
        for descriptor in (self.acknowledgements, self._pipe_to_send):
            if descriptor >= 0:
                os.close(descriptor)
        self.acknowledgements = self._pipe_to_send = -1
