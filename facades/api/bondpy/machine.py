"""A bond's state as an smclib state machine, for Noetic's attribute `Bond.sm`."""

from __future__ import annotations

from pipros.libraries.bonds.life import State
from smclib import statemap

_STATES = {state: statemap.State(state.value, number) for number, state in enumerate(State)}


class BondMachine(statemap.FSMContext):
    """Mirror of the bond's state, without transitions of its own."""

    def __init__(self) -> None:
        super().__init__(_STATES[State.WAITING])

    def enter(self, state: State) -> None:
        """Set the state."""
        self.clearState()
        self.setState(_STATES[state])
