"""The base classes of state machines that SMC, the State Machine Compiler, generates for Python."""

from __future__ import annotations

import sys
from typing import TextIO


class StateUndefinedException(Exception):
    """A transition was asked for while no state was set: from an action of another transition."""


class TransitionUndefinedException(Exception):
    """Neither the state nor its default has the transition."""


class State:
    """A state: its name, for people, and its number."""

    def __init__(self, name: str, id: int) -> None:  # noqa: A002  # Noetic's name for it
        self._name = name
        self._id = id

    def getName(self) -> str:
        """The name."""
        return self._name

    def getId(self) -> int:
        """The number, which no other state of the machine has."""
        return self._id


class FSMContext:
    """The machine: its state, the one before, and a stack of states to come back to."""

    def __init__(self, state: State | None) -> None:
        """`state` is where it starts."""
        self._state = state
        self._previous_state: State | None = None
        self._state_stack: list[State] = []
        self._transition: str | None = None
        self._debug_flag = False
        self._debug_stream: TextIO = sys.stderr

    def getDebugFlag(self) -> bool:
        """Whether changes of the state are written to the debug stream."""
        return self._debug_flag

    def setDebugFlag(self, flag: bool) -> None:
        """Has changes of the state written to the debug stream, or not."""
        self._debug_flag = flag

    def getDebugStream(self) -> TextIO:
        """Where changes are written, standard error at first."""
        return self._debug_stream

    def setDebugStream(self, stream: TextIO) -> None:
        """Has changes written elsewhere."""
        self._debug_stream = stream

    def getState(self) -> State:
        """The state.

        Raises:
            StateUndefinedException: during a transition.
        """
        if self._state is None:
            raise StateUndefinedException
        return self._state

    def isInTransition(self) -> bool:
        """Whether no state is set, as during a transition."""
        return self._state is None

    def getTransition(self) -> str | None:
        """The name of the current transition, for debugging."""
        return self._transition

    def clearState(self) -> None:
        """Begins a transition: no state is set until the next `setState`."""
        self._state, self._previous_state = None, self._state

    def getPreviousState(self) -> State | None:
        """The state that the last transition left."""
        return self._previous_state

    def setState(self, state: State) -> None:
        """Ends a transition.

        Raises:
            ValueError: `state` is not a State.
        """
        self._state = _checked(state)
        self._note("NEW STATE       : " + state.getName())

    def isStateStackEmpty(self) -> bool:
        """Whether no state was pushed."""
        return not self._state_stack

    def getStateStackDepth(self) -> int:
        """How many states were pushed."""
        return len(self._state_stack)

    def pushState(self, state: State) -> None:
        """Sets a state, and keeps the current one to come back to.

        Raises:
            ValueError: `state` is not a State.
        """
        new = _checked(state)
        if self._state is not None:
            self._state_stack.append(self._state)
        self._state = new
        self._note("PUSH TO STATE   : " + new.getName())

    def popState(self) -> None:
        """Goes back to the state that was left by the last `pushState`.

        Raises:
            ValueError: no state was pushed.
        """
        if not self._state_stack:
            self._note("POPPING ON EMPTY STATE STACK.")
            raise ValueError("empty state stack")
        self._state = self._state_stack.pop()
        self._note("POP TO STATE    : " + self._state.getName())

    def emptyStateStack(self) -> None:
        """Forgets the states that were pushed."""
        self._state_stack = []

    def _note(self, text: str) -> None:
        if self._debug_flag:
            self._debug_stream.write(f"{text}\n")


def _checked(state: object) -> State:
    if not isinstance(state, State):
        raise ValueError("state should be a statemap.State")
    return state
