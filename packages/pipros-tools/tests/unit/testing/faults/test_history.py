from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros_tools.testing.faults.history import History, NumberGap, TornMessage, numbered_text, read_numbered


def history_of(*numbers: int, sink: str = "sink") -> History:
    history = History()
    for number in numbers:
        history.receive(numbered_text("talker", number), sink)
    return history


@given(st.integers(1, 10**12), st.integers(0, 200))
def test_a_numbered_text_returns_its_source_and_number(number: int, size: int) -> None:
    assert read_numbered(numbered_text("talker", number, size)) == ("talker", number)


@given(st.integers(0, 200), st.integers(0, 7))
def test_a_flipped_bit_changes_the_checksum(place: int, bit: int) -> None:
    text = bytearray(numbered_text("talker", 1234, 200).encode())
    text[place] ^= 1 << bit

    with pytest.raises(TornMessage):
        read_numbered(text.decode(errors="replace"))


@pytest.mark.parametrize("text", ["", "talker", "talker 1", "talker x 00000000 ", "talker 1 00000000 a"])
def test_a_text_without_number_and_checksum_is_torn(text: str) -> None:
    with pytest.raises(TornMessage):
        read_numbered(text)


def test_mixed_messages_are_detected() -> None:
    one, other = numbered_text("talker", 1, 100), numbered_text("talker", 2, 100)

    with pytest.raises(TornMessage):
        read_numbered(one[:60] + other[60:])


def test_a_complete_ordered_history_has_no_problems() -> None:
    history = history_of(5, 6, 7)

    assert (history.problems(), history.received, history.last("talker")) == ([], 3, 7)


def test_duplicates_disorder_and_torn_messages_are_reported() -> None:
    history = history_of(1, 2, 2, 5, 3)
    history.receive("talker 9 nonsense")

    assert history.problems(counted=10) == [
        "[sink] a message is corrupted, or was not created by numbered_text: 'talker 9 nonsense'",
        "[sink] from [talker]: 1 messages were duplicated",
        "[sink] from [talker]: 1 messages were reordered",
    ]


def test_losses_must_be_counted_by_a_node() -> None:
    history = history_of(1, 4, 5, 10)

    assert history.gaps == [NumberGap("sink", "talker", 2, 2), NumberGap("sink", "talker", 6, 4)]
    assert history.problems(counted=6) == []
    assert history.problems(counted=5) == [
        "6 messages were lost and 5 counted; the largest gap is 4 from number 6 of [talker] at [sink]"
    ]


def test_each_broken_link_explains_one_gap() -> None:
    history = history_of(1, 4, 5, 10)

    assert (history.problems(breaks=2), history.problems(breaks=1, counted=2)) == ([], [])
    assert history.problems(breaks=1, counted=1) != []


def test_sources_and_sinks_are_distinguished() -> None:
    history = History()
    for source, sink in (("a", "x"), ("b", "x"), ("a", "y"), ("b", "y")):
        history.receive(numbered_text(source, 1), sink)

    assert (history.problems(), history.received) == ([], 4)


def test_texts_are_numbered_for_each_source() -> None:
    history = History()
    made = [history.next_text("a"), history.next_text("b"), history.next_text("a", size=10)]

    assert [read_numbered(text) for text in made] == [("a", 1), ("b", 1), ("a", 2)]
    assert len(made[2]) == len(made[0]) + 10
