"""The states of an `OutgoingLink`, and their transitions; its statistics.

    IDLE        no messages are queued; the publishing thread writes to the socket
    BEHIND      messages are queued for the publishing thread, which may wait for the subscriber
    QUEUED      messages are queued for the event loop
    STALLED     like QUEUED, but a publisher without a queue does not wait again until the link has caught up
    RECOVERING  a stalled link with no queued messages, whose subscriber has yet to read the written data
    CLOSED      the link has been closed

An event that is not in the table for a state has no effect.
"""

from __future__ import annotations

from enum import Enum, auto
from typing import Final


class LinkState(Enum):
    """The state of a link; see the module docstring."""

    IDLE = auto()
    BEHIND = auto()
    QUEUED = auto()
    STALLED = auto()
    RECOVERING = auto()
    CLOSED = auto()


class LinkEvent(Enum):
    """An event on a link."""

    SOCKET_FULL = auto()
    """The socket did not accept a whole message."""
    EMPTIED = auto()
    """The last queued message was written."""
    LEFT_TO_LOOP = auto()
    """The publishing thread does not wait, or has waited as long as is allowed for a link with a queue."""
    WAITED_IN_VAIN = auto()
    """The publishing thread has waited as long as is allowed for a link without a queue."""
    CAUGHT_UP = auto()
    """The subscriber has read nearly everything that was written."""
    CLOSED = auto()


_TRANSITIONS: Final[dict[LinkState, dict[LinkEvent, LinkState]]] = {
    LinkState.IDLE: {LinkEvent.SOCKET_FULL: LinkState.BEHIND, LinkEvent.CLOSED: LinkState.CLOSED},
    LinkState.BEHIND: {
        LinkEvent.EMPTIED: LinkState.IDLE,
        LinkEvent.LEFT_TO_LOOP: LinkState.QUEUED,
        LinkEvent.WAITED_IN_VAIN: LinkState.STALLED,
        LinkEvent.CLOSED: LinkState.CLOSED,
    },
    LinkState.QUEUED: {
        LinkEvent.EMPTIED: LinkState.IDLE,
        LinkEvent.WAITED_IN_VAIN: LinkState.STALLED,
        LinkEvent.CLOSED: LinkState.CLOSED,
    },
    LinkState.STALLED: {LinkEvent.EMPTIED: LinkState.RECOVERING, LinkEvent.CLOSED: LinkState.CLOSED},
    LinkState.RECOVERING: {
        LinkEvent.SOCKET_FULL: LinkState.STALLED,
        LinkEvent.CAUGHT_UP: LinkState.IDLE,
        LinkEvent.CLOSED: LinkState.CLOSED,
    },
    LinkState.CLOSED: {},
}

WAITING: Final = (LinkState.BEHIND, LinkState.QUEUED, LinkState.STALLED)
"""States in which messages are queued. (These are tuples, because enum members are slow to hash.)"""

WRITTEN_BY_LOOP: Final = (LinkState.QUEUED, LinkState.STALLED)

NOT_WAITED_FOR: Final = (LinkState.STALLED, LinkState.RECOVERING)


def after(state: LinkState, event: LinkEvent) -> LinkState:
    """Return the state after an event.

    >>> after(LinkState.IDLE, LinkEvent.SOCKET_FULL), after(LinkState.CLOSED, LinkEvent.EMPTIED)
    (<LinkState.BEHIND: 2>, <LinkState.CLOSED: 6>)
    """
    return _TRANSITIONS[state].get(event, state)


class SendStatistics:
    """Numbers of messages and bytes sent.

    `dropped` counts the messages that were lost because the peer was too slow or the link ended.
    """

    __slots__ = ("bytes", "dropped", "frames")

    def __init__(self) -> None:
        self.frames = self.bytes = self.dropped = 0

    def as_dict(self) -> dict[str, int]:
        return {"frames": self.frames, "bytes": self.bytes, "dropped": self.dropped}

    def add(self, other: SendStatistics) -> None:
        """Add another link's counts."""
        self.frames += other.frames
        self.bytes += other.bytes
        self.dropped += other.dropped
