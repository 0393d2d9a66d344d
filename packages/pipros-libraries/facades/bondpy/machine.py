"""A bond's state as an smclib state machine, for Noetic's attribute `Bond.sm`."""

from __future__ import annotations

from pipros_libraries.bonds.life import BondState
from smclib import statemap

_STATES = {state: statemap.State(state.value, number) for number, state in enumerate(BondState)}


class BondMachine(statemap.FSMContext):
    """Mirror of the bond's state. The machine itself has no transitions."""

    def __init__(self) -> None:
        super().__init__(_STATES[BondState.WAITING])

    def enter(self, state: BondState) -> None:
        """Set the state."""
        self.clearState()
        self.setState(_STATES[state])
