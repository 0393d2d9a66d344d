"""A goal as its server sees it.

A client may cancel it (`CANCEL_REQUESTED`); all other events come from the program that works on it. An event
that is not in the table leaves the goal unchanged.
"""

from __future__ import annotations

from enum import Enum

from pipros.actions.status import Status


class Event(Enum):
    """What happens to a goal. The values say what it is then, for error messages."""

    ACCEPT = "active"
    REJECT = "rejected"
    CANCEL = "cancelled"
    ABORT = "aborted"
    SUCCEED = "succeeded"
    CANCEL_REQUESTED = "asked to be cancelled"


TRANSITIONS: dict[Event, dict[Status, Status]] = {
    Event.ACCEPT: {Status.PENDING: Status.ACTIVE, Status.RECALLING: Status.PREEMPTING},
    Event.REJECT: {Status.PENDING: Status.REJECTED, Status.RECALLING: Status.REJECTED},
    Event.CANCEL: {
        Status.PENDING: Status.RECALLED,
        Status.RECALLING: Status.RECALLED,
        Status.ACTIVE: Status.PREEMPTED,
        Status.PREEMPTING: Status.PREEMPTED,
    },
    Event.ABORT: {Status.ACTIVE: Status.ABORTED, Status.PREEMPTING: Status.ABORTED},
    Event.SUCCEED: {Status.ACTIVE: Status.SUCCEEDED, Status.PREEMPTING: Status.SUCCEEDED},
    Event.CANCEL_REQUESTED: {Status.PENDING: Status.RECALLING, Status.ACTIVE: Status.PREEMPTING},
}


def after(status: int, event: Event) -> Status | None:
    """The status after the event, None if it cannot happen."""
    return TRANSITIONS[event].get(Status(status)) if status in Status._value2member_map_ else None


def why_not(status: int, event: Event) -> str:
    """The error for an event that cannot happen."""
    possible = " or ".join(known.name for known in TRANSITIONS[event])
    now = Status(status).name if status in Status._value2member_map_ else str(status)
    return f"a goal must be {possible} to be {event.value}, but it is {now}"
