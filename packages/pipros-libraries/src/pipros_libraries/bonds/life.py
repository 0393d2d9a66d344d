"""The state machine of one side of a bond. It uses neither topics nor a clock.

Each side periodically publishes that it is alive. The first message from the other side (the sister) forms
the bond. A heartbeat timeout breaks the bond immediately. If one side breaks a formed bond, both sides enter
ENDING and publish that they are ending, each until its sister has done the same or the disconnect timeout
expires.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, auto


class BondState(Enum):
    """States of one side of a bond. The values are the names in Noetic's state machine."""

    WAITING = "SM.WaitingForSister"
    ALIVE = "SM.Alive"
    ENDING = "SM.AwaitSisterDeath"
    DEAD = "SM.Dead"


class BondEvent(Enum):
    """Events of one side of a bond."""

    SISTER_ALIVE = auto()
    SISTER_ENDS = auto()
    BREAK = auto()
    """This side breaks the bond."""
    CONNECT_TIMEOUT = auto()
    HEARTBEAT_TIMEOUT = auto()
    DISCONNECT_TIMEOUT = auto()


_W, _A, _E, _D = BondState.WAITING, BondState.ALIVE, BondState.ENDING, BondState.DEAD

# An event that is not listed for a state does not change the state.
NEXT: Mapping[tuple[BondState, BondEvent], BondState] = {
    (_W, BondEvent.SISTER_ALIVE): _A,
    (_W, BondEvent.SISTER_ENDS): _E,
    (_W, BondEvent.CONNECT_TIMEOUT): _D,
    (_W, BondEvent.BREAK): _D,
    (_A, BondEvent.SISTER_ENDS): _E,
    (_A, BondEvent.HEARTBEAT_TIMEOUT): _D,
    (_A, BondEvent.BREAK): _E,
    (_E, BondEvent.SISTER_ENDS): _D,
    (_E, BondEvent.DISCONNECT_TIMEOUT): _D,
}


class Life:
    """State of one side of a bond.

    >>> life = Life()
    >>> [life.take(event).name for event in (BondEvent.SISTER_ALIVE, BondEvent.BREAK, BondEvent.SISTER_ENDS)]
    ['ALIVE', 'ENDING', 'DEAD']
    """

    def __init__(self) -> None:
        self.state = BondState.WAITING
        self.was_formed = False
        """Whether a message from the sister arrived while this side was waiting for it."""

    def take(self, event: BondEvent) -> BondState:
        """Handle an event and return the new state."""
        before, self.state = self.state, NEXT.get((self.state, event), self.state)
        if before is BondState.WAITING and event in (BondEvent.SISTER_ALIVE, BondEvent.SISTER_ENDS):
            self.was_formed = True
        return self.state
