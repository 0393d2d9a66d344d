from __future__ import annotations

import pytest

from pipros.net.backlog import Backlog, WireMessage


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
