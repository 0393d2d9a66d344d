"""A goal as its client sees it: what the client knows about the goal's progress at the server.

The server repeats the status of its goals several times a second, and sends a result at the end, on topics of
their own: any of them may come first, and statuses may be missed. So a status may pass through several states
at once, such as from WAITING_FOR_GOAL_ACK through ACTIVE to WAITING_FOR_RESULT.
"""

from __future__ import annotations

from enum import IntEnum

from pipros.actions.status import TERMINAL, Status


class State(IntEnum):
    """The states of a client's goal; the numbers are those of actionlib.CommState."""

    WAITING_FOR_GOAL_ACK = 0
    PENDING = 1
    ACTIVE = 2
    WAITING_FOR_RESULT = 3
    WAITING_FOR_CANCEL_ACK = 4
    RECALLING = 5
    PREEMPTING = 6
    DONE = 7
    LOST = 8


_PENDING, _ACTIVE, _WAIT = State.PENDING, State.ACTIVE, State.WAITING_FOR_RESULT
_RECALLING, _PREEMPTING = State.RECALLING, State.PREEMPTING
_FINISHED = (Status.SUCCEEDED, Status.ABORTED)

STAYS: tuple[State, ...] = ()

TRANSITIONS: dict[State, dict[Status, tuple[State, ...]]] = {
    State.WAITING_FOR_GOAL_ACK: {
        Status.PENDING: (_PENDING,),
        Status.ACTIVE: (_ACTIVE,),
        Status.REJECTED: (_PENDING, _WAIT),
        Status.RECALLING: (_PENDING, _RECALLING),
        Status.RECALLED: (_PENDING, _WAIT),
        Status.PREEMPTED: (_ACTIVE, _PREEMPTING, _WAIT),
        Status.PREEMPTING: (_ACTIVE, _PREEMPTING),
        **dict.fromkeys(_FINISHED, (_ACTIVE, _WAIT)),
    },
    State.PENDING: {
        Status.PENDING: STAYS,
        Status.ACTIVE: (_ACTIVE,),
        Status.REJECTED: (_WAIT,),
        Status.RECALLING: (_RECALLING,),
        Status.RECALLED: (_RECALLING, _WAIT),
        Status.PREEMPTED: (_ACTIVE, _PREEMPTING, _WAIT),
        Status.PREEMPTING: (_ACTIVE, _PREEMPTING),
        **dict.fromkeys(_FINISHED, (_ACTIVE, _WAIT)),
    },
    State.ACTIVE: {
        Status.ACTIVE: STAYS,
        Status.PREEMPTED: (_PREEMPTING, _WAIT),
        Status.PREEMPTING: (_PREEMPTING,),
        **dict.fromkeys(_FINISHED, (_WAIT,)),
    },
    State.WAITING_FOR_RESULT: dict.fromkeys(
        (Status.ACTIVE, Status.REJECTED, Status.RECALLED, Status.PREEMPTED, *_FINISHED), STAYS
    ),
    State.WAITING_FOR_CANCEL_ACK: {
        Status.PENDING: STAYS,
        Status.ACTIVE: STAYS,
        Status.REJECTED: (_WAIT,),
        Status.RECALLING: (_RECALLING,),
        Status.RECALLED: (_RECALLING, _WAIT),
        Status.PREEMPTED: (_PREEMPTING, _WAIT),
        Status.PREEMPTING: (_PREEMPTING,),
        **dict.fromkeys(_FINISHED, (_PREEMPTING, _WAIT)),
    },
    State.RECALLING: {
        Status.RECALLING: STAYS,
        Status.REJECTED: (_WAIT,),
        Status.RECALLED: (_WAIT,),
        Status.PREEMPTED: (_PREEMPTING, _WAIT),
        Status.PREEMPTING: (_PREEMPTING,),
        **dict.fromkeys(_FINISHED, (_PREEMPTING, _WAIT)),
    },
    State.PREEMPTING: {
        Status.PREEMPTING: STAYS,
        **dict.fromkeys((Status.PREEMPTED, *_FINISHED), (_WAIT,)),
    },
}
"""The states that a status passes through. A status that is not listed is impossible in that state."""

MAY_BE_CANCELLED = frozenset(
    {State.WAITING_FOR_GOAL_ACK, State.PENDING, State.ACTIVE, State.WAITING_FOR_CANCEL_ACK}
)
MAY_BE_MISSING = frozenset({State.WAITING_FOR_GOAL_ACK, State.WAITING_FOR_RESULT, State.DONE})
"""The states in which a server need not list the goal: it does not know it yet, or has forgotten it."""


class ClientGoal:
    """The state of a goal. Each method returns the states that it passed through, in order."""

    def __init__(self) -> None:
        self.state = State.WAITING_FOR_GOAL_ACK
        self.status = Status.PENDING

    def on_status(self, status: int | None) -> list[State]:
        """The server listed its goals: this one with a status, or not at all.

        Raises:
            ValueError: the status is impossible now; nothing has changed but `status`.
        """
        if self.state is State.DONE:
            return []
        if status is None:
            if self.state in MAY_BE_MISSING:
                return []
            self.status = Status.LOST
            return self._go((State.DONE,))
        if status not in Status._value2member_map_:
            raise ValueError(f"the server said the unknown status {status} of a goal")
        self.status = Status(status)
        way = TRANSITIONS[self.state].get(self.status)
        if way is None:
            raise ValueError(f"a goal cannot be {self.status.name} while its client is in {self.state.name}")
        return self._go(way)

    def on_result(self, status: int) -> list[State]:
        """The result came, with the last status. A goal that is done already stays so."""
        if self.state is State.DONE:
            return []
        try:
            way = self.on_status(status)
        except ValueError:  # the statuses that were missed no longer matter
            way = []
        return way + self._go((State.DONE,))

    def on_cancel(self) -> list[State]:
        """The client cancels it. Nothing happens if it is ending already."""
        return self._go((State.WAITING_FOR_CANCEL_ACK,)) if self.state in MAY_BE_CANCELLED else []

    def terminal_status(self) -> Status:
        """How it ended; LOST if it did not."""
        return self.status if self.status in TERMINAL else Status.LOST

    def _go(self, way: tuple[State, ...]) -> list[State]:
        if way:
            self.state = way[-1]
        return list(way)
