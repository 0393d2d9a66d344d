"""The state machine of an outgoing link."""

from __future__ import annotations

import pytest

from pipros.net.outgoing_state import NOT_WAITED_FOR, WAITING, WRITTEN_BY_LOOP, Event, State, after


def after_all(*events: Event) -> State:
    state = State.IDLE
    for event in events:
        state = after(state, event)
    return state


def test_a_link_that_is_emptied_in_time_is_idle() -> None:
    assert after_all(Event.SOCKET_FULL) is State.BEHIND
    assert after_all(Event.SOCKET_FULL, Event.EMPTIED) is State.IDLE
    assert after_all(Event.SOCKET_FULL, Event.LEFT_TO_LOOP) is State.QUEUED
    assert after_all(Event.SOCKET_FULL, Event.LEFT_TO_LOOP, Event.EMPTIED) is State.IDLE


@pytest.mark.parametrize("events", [(), (Event.LEFT_TO_LOOP,)])
def test_a_stalled_link_is_idle_only_after_it_has_caught_up(events: tuple[Event, ...]) -> None:
    stalled = (Event.SOCKET_FULL, *events, Event.WAITED_IN_VAIN)
    assert after_all(*stalled) is State.STALLED
    assert after_all(*stalled, Event.CAUGHT_UP) is State.STALLED
    assert after_all(*stalled, Event.EMPTIED) is State.RECOVERING
    assert after_all(*stalled, Event.EMPTIED, Event.SOCKET_FULL) is State.STALLED
    assert after_all(*stalled, Event.EMPTIED, Event.CAUGHT_UP) is State.IDLE


@pytest.mark.parametrize("state", State)
def test_every_state_can_be_closed_for_good(state: State) -> None:
    closed = after(state, Event.CLOSED)
    assert closed is State.CLOSED
    assert {after(closed, event) for event in Event} == {State.CLOSED}


def test_no_publisher_waits_for_what_the_loop_writes_after_a_stall() -> None:
    assert set(WRITTEN_BY_LOOP) < set(WAITING)
    assert set(NOT_WAITED_FOR) & set(WAITING) == {State.STALLED}
