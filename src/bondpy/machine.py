"""A bond's state as a machine of smclib, as Noetic's bonds show it in `bond.sm`."""

from __future__ import annotations

from pipros.bonds.life import State
from smclib import statemap

_STATES = {state.value: statemap.State(state.value, number) for number, state in enumerate(State)}


class BondMachine(statemap.FSMContext):
    """Only shows the state; the bond itself changes it."""

    def __init__(self) -> None:
        super().__init__(_STATES[State.WAITING.value])

    def enter(self, name: str) -> None:
        """Shows the state of that name."""
        self.clearState()
        self.setState(_STATES[name])
