"""The state machine of an outgoing link."""

from __future__ import annotations

import pytest

from pipros.net.outgoing_state import (
    NOT_WAITED_FOR,
    WAITING,
    WRITTEN_BY_LOOP,
    LinkEvent,
    LinkState,
    SendStatistics,
    after,
)


def after_all(*events: LinkEvent) -> LinkState:
    state = LinkState.IDLE
    for event in events:
        state = after(state, event)
    return state


def test_a_link_that_is_emptied_in_time_is_idle() -> None:
    assert after_all(LinkEvent.SOCKET_FULL) is LinkState.BEHIND
    assert after_all(LinkEvent.SOCKET_FULL, LinkEvent.EMPTIED) is LinkState.IDLE
    assert after_all(LinkEvent.SOCKET_FULL, LinkEvent.LEFT_TO_LOOP) is LinkState.QUEUED
    assert after_all(LinkEvent.SOCKET_FULL, LinkEvent.LEFT_TO_LOOP, LinkEvent.EMPTIED) is LinkState.IDLE


@pytest.mark.parametrize("events", [(), (LinkEvent.LEFT_TO_LOOP,)])
def test_a_stalled_link_is_idle_only_after_it_has_caught_up(events: tuple[LinkEvent, ...]) -> None:
    stalled = (LinkEvent.SOCKET_FULL, *events, LinkEvent.WAITED_IN_VAIN)
    assert after_all(*stalled) is LinkState.STALLED
    assert after_all(*stalled, LinkEvent.CAUGHT_UP) is LinkState.STALLED
    assert after_all(*stalled, LinkEvent.EMPTIED) is LinkState.RECOVERING
    assert after_all(*stalled, LinkEvent.EMPTIED, LinkEvent.SOCKET_FULL) is LinkState.STALLED
    assert after_all(*stalled, LinkEvent.EMPTIED, LinkEvent.CAUGHT_UP) is LinkState.IDLE


@pytest.mark.parametrize("state", LinkState)
def test_every_state_can_be_closed_for_good(state: LinkState) -> None:
    closed = after(state, LinkEvent.CLOSED)
    assert closed is LinkState.CLOSED
    assert {after(closed, event) for event in LinkEvent} == {LinkState.CLOSED}


def test_no_publisher_waits_for_what_the_loop_writes_after_a_stall() -> None:
    assert set(WRITTEN_BY_LOOP) < set(WAITING)
    assert set(NOT_WAITED_FOR) & set(WAITING) == {LinkState.STALLED}


def test_the_counts_of_links_are_added() -> None:
    ended, open_ = SendStatistics(), SendStatistics()
    ended.frames, ended.bytes, ended.dropped = 2, 30, 1
    open_.frames = 5
    ended.add(open_)
    assert ended.as_dict() == {"frames": 7, "bytes": 30, "dropped": 1}
