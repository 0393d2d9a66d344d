"""What waits for a subscriber, and the states of its link."""

import pytest

from pipros.net.backlog import Backlog, WireMessage
from pipros.net.outgoing_state import (
    NOT_WAITED_FOR,
    WAITING,
    WRITTEN_BY_LOOP,
    LinkEvent,
    LinkState,
    SendStatistics,
    after,
)


def backlog_of(*messages: WireMessage) -> Backlog:
    backlog = Backlog()
    for message in messages:
        backlog.append(message, sum(map(len, message)))
    return backlog


def contents(backlog: Backlog) -> bytes:
    return b"".join(backlog.next_buffers())


@pytest.mark.parametrize("step", [1, 2, 3, 5, 11])
def test_messages_are_sent_in_order_for_any_split(step: int) -> None:
    backlog = backlog_of((b"ab", b"cde"), (b"f",), (b"", b"ghijk"))
    out, messages = b"", 0
    while backlog:
        sent = contents(backlog)[:step]
        out += sent
        messages += backlog.remove_sent(len(sent))
    assert (out, messages) == (b"abcdefghijk", 3)


def test_freed_space_is_reused() -> None:
    backlog = backlog_of((b"abc",), (b"def",))
    backlog.remove_sent(6)
    backlog.append((b"ghijkl",), 6)

    assert backlog.drop_oldest(None, 6) == 0
    assert contents(backlog) == b"ghijkl"


def test_the_rest_of_a_message_is_sent_first() -> None:
    backlog = Backlog()
    backlog.append_rest((b"abc", b"def"), 4)
    backlog.append((b"g",), 1)

    assert contents(backlog) == b"efg"
    assert (backlog.remove_sent(3), bool(backlog)) == (2, False)


# The state machine of an outgoing link.


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
