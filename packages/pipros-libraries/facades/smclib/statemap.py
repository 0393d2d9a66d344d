"""Base classes of the state machines that SMC, the State Machine Compiler, generates for Python."""

from __future__ import annotations

import sys
from typing import TextIO


class StateUndefinedException(Exception):
    """A transition was triggered while no state was set, that is, by an action of another transition."""


class TransitionUndefinedException(Exception):
    """Neither the current state nor the default state defines the transition."""


class State:
    """A state with a name, and with a number that is unique within the machine."""

    def __init__(self, name: str, id: int) -> None:  # noqa: A002  # Noetic's name for it
        self._name = name
        self._id = id

    def getName(self) -> str:
        """Return the name."""
        return self._name

    def getId(self) -> int:
        """Return the number."""
        return self._id


class FSMContext:
    """A state machine, consisting of the current state, the previous state and a stack of states."""

    def __init__(self, state: State | None) -> None:
        """Set the initial state."""
        self._state = state
        self._previous_state: State | None = None
        self._state_stack: list[State] = []
        self._transition: str | None = None
        self._debug_flag = False
        self._debug_stream: TextIO = sys.stderr

    def getDebugFlag(self) -> bool:
        """Return whether state changes are written to the debug stream."""
        return self._debug_flag

    def setDebugFlag(self, flag: bool) -> None:
        """Enable or disable writing state changes to the debug stream."""
        self._debug_flag = flag

    def getDebugStream(self) -> TextIO:
        """Return the debug stream, which defaults to standard error."""
        return self._debug_stream

    def setDebugStream(self, stream: TextIO) -> None:
        """Set the debug stream."""
        self._debug_stream = stream

    def getState(self) -> State:
        """Return the current state.

        Raises:
            StateUndefinedException: a transition is in progress.
        """
        if self._state is None:
            raise StateUndefinedException
        return self._state

    def isInTransition(self) -> bool:
        """Return whether a transition is in progress, that is, no state is set."""
        return self._state is None

    def getTransition(self) -> str | None:
        """Return the name of the current transition, for debugging."""
        return self._transition

    def clearState(self) -> None:
        """Start a transition. No state is set until the next `setState`."""
        self._state, self._previous_state = None, self._state

    def getPreviousState(self) -> State | None:
        """Return the state before the last transition."""
        return self._previous_state

    def setState(self, state: State) -> None:
        """Set the state and end the transition.

        Raises:
            ValueError: `state` is not a State.
        """
        self._state = _require_state(state)
        self._log("NEW STATE       : " + state.getName())

    def isStateStackEmpty(self) -> bool:
        """Return whether the state stack is empty."""
        return not self._state_stack

    def getStateStackDepth(self) -> int:
        """Return the number of states on the stack."""
        return len(self._state_stack)

    def pushState(self, state: State) -> None:
        """Push the current state onto the stack and set a new state.

        Raises:
            ValueError: `state` is not a State.
        """
        new = _require_state(state)
        if self._state is not None:
            self._state_stack.append(self._state)
        self._state = new
        self._log("PUSH TO STATE   : " + new.getName())

    def popState(self) -> None:
        """Pop the topmost state from the stack and make it the current state.

        Raises:
            ValueError: the stack is empty.
        """
        if not self._state_stack:
            self._log("POPPING ON EMPTY STATE STACK.")
            raise ValueError("empty state stack")
        self._state = self._state_stack.pop()
        self._log("POP TO STATE    : " + self._state.getName())

    def emptyStateStack(self) -> None:
        """Clear the state stack."""
        self._state_stack = []

    def _log(self, text: str) -> None:
        if self._debug_flag:
            self._debug_stream.write(f"{text}\n")


def _require_state(state: object) -> State:
    if not isinstance(state, State):
        raise ValueError("state should be a statemap.State")
    return state
