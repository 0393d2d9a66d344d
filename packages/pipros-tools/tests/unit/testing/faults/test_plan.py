import itertools
import random
from collections.abc import Iterable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros_tools.testing.faults.history import History, NumberGap, TornMessage, numbered_text, read_numbered
from pipros_tools.testing.faults.plan import Cut, Faults, FaultyStream, Piece

DATA = random.Random(1).randbytes(5000)  # noqa: S311


def passed(stream: FaultyStream, chunks: Iterable[bytes]) -> tuple[bytes, list[Piece], bool]:
    """Return the bytes that a peer gets, the pieces, and whether the connection was cut."""
    pieces = []
    for step in itertools.chain.from_iterable(map(stream.feed, chunks)):
        if isinstance(step, Cut):
            return b"".join(piece.data for piece in pieces), pieces, True
        pieces.append(step)
    return b"".join(piece.data for piece in pieces), pieces, False


def chunks_of(data: bytes, size: int) -> list[bytes]:
    return [data[start : start + size] for start in range(0, len(data), size)]


def test_without_faults_bytes_pass_as_they_came() -> None:
    assert passed(FaultyStream("1", Faults()), [b"one", b"two"])[1] == [Piece(b"one"), Piece(b"two")]


def test_pieces_are_complete_and_within_the_requested_size() -> None:
    got, pieces, _ = passed(FaultyStream("1", Faults(split_bytes=7)), [DATA])

    assert got == DATA
    assert {len(piece.data) for piece in pieces} - {len(pieces[-1].data)} <= set(range(1, 8))
    assert len(pieces) > len(DATA) / 7


@given(st.integers(1, 700), st.integers(1, 700))
def test_received_bytes_do_not_depend_on_packet_boundaries(first: int, second: int) -> None:
    faults = Faults(split_bytes=9, corrupt_every_bytes=200, cut_every_bytes=3000)

    one, other = (passed(FaultyStream("7", faults), chunks_of(DATA, size)) for size in (first, second))

    assert (one[0], one[2]) == (other[0], other[2])


def test_another_seed_gives_other_faults() -> None:
    faults = Faults(corrupt_every_bytes=100)

    assert len({passed(FaultyStream(str(seed), faults), [DATA])[0] for seed in range(20)}) == 20


def test_corrupted_bytes_are_changed_in_one_bit_and_counted() -> None:
    got, pieces, _ = passed(FaultyStream("1", Faults(corrupt_every_bytes=100)), [DATA])

    changed = [a ^ b for a, b in zip(got, DATA, strict=True) if a != b]
    assert len(changed) == sum(piece.corrupted for piece in pieces)
    assert {bits.bit_count() for bits in changed} == {1}
    assert 20 <= len(changed) <= 100


def test_a_cut_comes_after_what_was_before_it_and_nothing_follows() -> None:
    got, _, is_cut = passed(FaultyStream("1", Faults(cut_every_bytes=1000)), [DATA])

    assert is_cut
    assert got == DATA[: len(got)]


def test_stalls_pause_after_a_piece() -> None:
    faults = Faults(stall_every_bytes=1000, stall_s=0.5)
    got, pieces, _ = passed(FaultyStream("1", faults), [DATA])

    assert got == DATA
    assert {piece.pause_s for piece in pieces} == {0.0, 0.5}


def test_delays_lie_between_delay_and_jitter() -> None:
    faults = Faults(delay_s=0.1, jitter_s=0.2, split_bytes=10)
    _, pieces, _ = passed(FaultyStream("1", faults), [DATA])

    assert 0.1 <= min(piece.delay_s for piece in pieces) < 0.15
    assert 0.25 < max(piece.delay_s for piece in pieces) <= 0.3


def test_faults_can_change_in_the_middle_of_a_stream() -> None:
    stream = FaultyStream("1", Faults(corrupt_every_bytes=1))
    assert passed(stream, [DATA[:100]])[0] != DATA[:100]

    stream.use(Faults())

    assert passed(stream, [DATA[100:]])[0] == DATA[100:]


@pytest.mark.parametrize(("faults", "text"), [
    ({"delay_s": -1}, "delay_s must be 0 or more, got -1"),
    ({"delay_s": float("nan")}, "delay_s must be 0 or more, got nan"),
    ({"stall_every_bytes": 10}, "stall_every_bytes needs stall_s"),
])  # fmt: skip
def test_invalid_faults_are_refused(faults: dict[str, float], text: str) -> None:
    with pytest.raises(ValueError, match=text):
        Faults(**faults)  # type: ignore[arg-type]


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
