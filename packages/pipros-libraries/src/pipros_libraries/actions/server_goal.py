"""Server-side state of a goal.

A client may request cancellation (`CANCEL_REQUESTED`); all other events come from the program that executes
the goal. An event that is not in the table leaves the goal unchanged.
"""

from __future__ import annotations

from enum import Enum

from pipros_libraries.actions.status import Status


class GoalEvent(Enum):
    """Events of a goal. The values are used in error texts: "a goal must be … to be rejected"."""

    ACCEPT = "active"
    REJECT = "rejected"
    CANCEL = "cancelled"
    ABORT = "aborted"
    SUCCEED = "succeeded"
    CANCEL_REQUESTED = "cancelled by request"


TRANSITIONS: dict[GoalEvent, dict[Status, Status]] = {
    GoalEvent.ACCEPT: {Status.PENDING: Status.ACTIVE, Status.RECALLING: Status.PREEMPTING},
    GoalEvent.REJECT: {Status.PENDING: Status.REJECTED, Status.RECALLING: Status.REJECTED},
    GoalEvent.CANCEL: {
        Status.PENDING: Status.RECALLED,
        Status.RECALLING: Status.RECALLED,
        Status.ACTIVE: Status.PREEMPTED,
        Status.PREEMPTING: Status.PREEMPTED,
    },
    GoalEvent.ABORT: {Status.ACTIVE: Status.ABORTED, Status.PREEMPTING: Status.ABORTED},
    GoalEvent.SUCCEED: {Status.ACTIVE: Status.SUCCEEDED, Status.PREEMPTING: Status.SUCCEEDED},
    GoalEvent.CANCEL_REQUESTED: {Status.PENDING: Status.RECALLING, Status.ACTIVE: Status.PREEMPTING},
}


def after(status: int, event: GoalEvent) -> Status | None:
    """Return the status after the event, or None if `status` is unknown or does not permit the event."""
    return TRANSITIONS[event].get(Status(status)) if status in Status._value2member_map_ else None


def why_not(status: int, event: GoalEvent) -> str:
    """Return the error message for an event that is invalid in this status."""
    possible = " or ".join(known.name for known in TRANSITIONS[event])
    now = Status(status).name if status in Status._value2member_map_ else str(status)
    return f"a goal must be {possible} to be {event.value}, but it is {now}"
