"""Client-side state of a goal.

The server publishes the status of its goals several times a second, and a result when a goal ends. Statuses
and results are published on separate topics, so they may arrive in any order, and a status may be missed. A
single status may therefore cause several transitions, such as from WAITING_FOR_GOAL_ACK through ACTIVE to
WAITING_FOR_RESULT.
"""

from __future__ import annotations

from enum import IntEnum

from pipros_libraries.actions.status import Status


class ClientGoalState(IntEnum):
    """States of a client's goal. The values match actionlib.CommState."""

    WAITING_FOR_GOAL_ACK = 0
    PENDING = 1
    ACTIVE = 2
    WAITING_FOR_RESULT = 3
    WAITING_FOR_CANCEL_ACK = 4
    RECALLING = 5
    PREEMPTING = 6
    DONE = 7
    LOST = 8


_PENDING, _ACTIVE, _WAIT = ClientGoalState.PENDING, ClientGoalState.ACTIVE, ClientGoalState.WAITING_FOR_RESULT
_RECALLING, _PREEMPTING = ClientGoalState.RECALLING, ClientGoalState.PREEMPTING
_FINISHED = (Status.SUCCEEDED, Status.ABORTED)

STAYS: tuple[ClientGoalState, ...] = ()

TRANSITIONS: dict[ClientGoalState, dict[Status, tuple[ClientGoalState, ...]]] = {
    ClientGoalState.WAITING_FOR_GOAL_ACK: {
        Status.PENDING: (_PENDING,),
        Status.ACTIVE: (_ACTIVE,),
        Status.REJECTED: (_PENDING, _WAIT),
        Status.RECALLING: (_PENDING, _RECALLING),
        Status.RECALLED: (_PENDING, _WAIT),
        Status.PREEMPTED: (_ACTIVE, _PREEMPTING, _WAIT),
        Status.PREEMPTING: (_ACTIVE, _PREEMPTING),
        **dict.fromkeys(_FINISHED, (_ACTIVE, _WAIT)),
    },
    ClientGoalState.PENDING: {
        Status.PENDING: STAYS,
        Status.ACTIVE: (_ACTIVE,),
        Status.REJECTED: (_WAIT,),
        Status.RECALLING: (_RECALLING,),
        Status.RECALLED: (_RECALLING, _WAIT),
        Status.PREEMPTED: (_ACTIVE, _PREEMPTING, _WAIT),
        Status.PREEMPTING: (_ACTIVE, _PREEMPTING),
        **dict.fromkeys(_FINISHED, (_ACTIVE, _WAIT)),
    },
    ClientGoalState.ACTIVE: {
        Status.ACTIVE: STAYS,
        Status.PREEMPTED: (_PREEMPTING, _WAIT),
        Status.PREEMPTING: (_PREEMPTING,),
        **dict.fromkeys(_FINISHED, (_WAIT,)),
    },
    ClientGoalState.WAITING_FOR_RESULT: dict.fromkeys(
        (Status.ACTIVE, Status.REJECTED, Status.RECALLED, Status.PREEMPTED, *_FINISHED), STAYS
    ),
    ClientGoalState.WAITING_FOR_CANCEL_ACK: {
        Status.PENDING: STAYS,
        Status.ACTIVE: STAYS,
        Status.REJECTED: (_WAIT,),
        Status.RECALLING: (_RECALLING,),
        Status.RECALLED: (_RECALLING, _WAIT),
        Status.PREEMPTED: (_PREEMPTING, _WAIT),
        Status.PREEMPTING: (_PREEMPTING,),
        **dict.fromkeys(_FINISHED, (_PREEMPTING, _WAIT)),
    },
    ClientGoalState.RECALLING: {
        Status.RECALLING: STAYS,
        Status.REJECTED: (_WAIT,),
        Status.RECALLED: (_WAIT,),
        Status.PREEMPTED: (_PREEMPTING, _WAIT),
        Status.PREEMPTING: (_PREEMPTING,),
        **dict.fromkeys(_FINISHED, (_PREEMPTING, _WAIT)),
    },
    ClientGoalState.PREEMPTING: {
        Status.PREEMPTING: STAYS,
        **dict.fromkeys((Status.PREEMPTED, *_FINISHED), (_WAIT,)),
    },
}
"""The states to enter when a status arrives, in order.

A status that is not listed for a state is invalid in that state.
"""

MAY_BE_CANCELLED = frozenset(
    {
        ClientGoalState.WAITING_FOR_GOAL_ACK,
        ClientGoalState.PENDING,
        ClientGoalState.ACTIVE,
        ClientGoalState.WAITING_FOR_CANCEL_ACK,
    }
)
MAY_BE_MISSING = frozenset(
    {ClientGoalState.WAITING_FOR_GOAL_ACK, ClientGoalState.WAITING_FOR_RESULT, ClientGoalState.DONE}
)
"""States in which the server may omit the goal, because the goal has not arrived or was removed."""


LOST_RESULT_S = 5.0
"""How long the server may omit a goal whose final status is known, before its result is considered lost."""


class ClientGoal:
    """State of a goal. Each event method returns the states entered, in order."""

    def __init__(self) -> None:
        self.state = ClientGoalState.WAITING_FOR_GOAL_ACK
        self.status = Status.PENDING
        self._omitted_at_s: float | None = None  # when the server first omitted the goal, which had ended

    def on_status(self, status: int | None, now_s: float = 0.0) -> list[ClientGoalState]:
        """Handle a status list from the server.

        `status` is this goal's status, or None if the list omits the goal. If the goal's current state does
        not permit an omission, the goal is lost and becomes DONE. If its final status is known, it becomes
        DONE after `LOST_RESULT_S`, because the result was lost. `now_s` is a monotonic time.

        Raises:
            ValueError: the status is unknown, or invalid in the current state. The state is unchanged.
        """
        if self.state is ClientGoalState.DONE:
            return []
        if status is None:
            if self.state is ClientGoalState.WAITING_FOR_RESULT:
                if self._omitted_at_s is None:
                    self._omitted_at_s = now_s
                is_overdue = now_s - self._omitted_at_s > LOST_RESULT_S
                return self._enter((ClientGoalState.DONE,)) if is_overdue else []
            if self.state in MAY_BE_MISSING:
                return []
            self.status = Status.LOST
            return self._enter((ClientGoalState.DONE,))
        if status not in Status._value2member_map_:
            raise ValueError(f"server reported unknown goal status {status}")
        self.status, self._omitted_at_s = Status(status), None
        states = TRANSITIONS[self.state].get(self.status)
        if states is None:
            raise ValueError(
                f"server reported status {self.status.name}, which is invalid in state {self.state.name}"
            )
        return self._enter(states)

    def on_result(self, status: int) -> list[ClientGoalState]:
        """Handle a result and the final status in it. Do nothing if the goal is already done.

        The goal becomes DONE even if the status is invalid.
        """
        if self.state is ClientGoalState.DONE:
            return []
        try:
            states = self.on_status(status)
        except ValueError:  # missed statuses no longer matter
            states = []
        return states + self._enter((ClientGoalState.DONE,))

    def on_cancel(self) -> list[ClientGoalState]:
        """Handle a cancellation by the client. Do nothing if the goal is already ending."""
        return (
            self._enter((ClientGoalState.WAITING_FOR_CANCEL_ACK,)) if self.state in MAY_BE_CANCELLED else []
        )

    def _enter(self, states: tuple[ClientGoalState, ...]) -> list[ClientGoalState]:
        if states:
            self.state = states[-1]
        return list(states)
