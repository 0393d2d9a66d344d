"""The reading end, with a writer that announces data and does not send them."""

from __future__ import annotations

import math

import pytest

from pipros.basics.budget import Budget
from pipros_ros2.rtps.decoding import read_datagram
from pipros_ros2.rtps.encoding import data_frag_head, data_head, datagram_head, gap, heartbeat
from pipros_ros2.rtps.incomplete import PIECE_OVERHEAD_BYTES, Assembly, inline_bytes
from pipros_ros2.rtps.outbox import DatagramOutbox
from pipros_ros2.rtps.parameters import Address, Parameters
from pipros_ros2.rtps.reader import Reader
from pipros_ros2.rtps.submessages import (
    AckNack,
    Data,
    DataFrag,
    Gap,
    Heartbeat,
    HeartbeatFrag,
    NackFrag,
    Submessage,
)
from pipros_ros2.rtps.writer_proxy import RtpsSample

US, PEER = b"our prefix..", b"peer prefix."
READER, WRITER = b"\0\0\1\4", b"\0\0\1\3"
GUID = PEER + WRITER
HERE = Address("127.0.0.1", 7410)


class Ears:
    """A reader that has matched one writer, and everything that it delivers."""

    def __init__(self, *, is_reliable: bool = True, limit_bytes: int = 1_000_000) -> None:
        self.now = 100.0
        self.outbox = DatagramOutbox()
        self.budget = Budget(limit_bytes)
        self.delivered: list[RtpsSample] = []
        self.reader = Reader(US, READER, 1_000_000, self.outbox, self.delivered.append)
        self.reader.match(GUID, HERE, self.budget, self.now, is_reliable=is_reliable)
        self.requests()

    def requests(self) -> list[Submessage]:
        """The submessages that the reader has sent since the last call."""
        sent = [read_datagram(b"".join(each.parts), PEER) for each in self.outbox.take()]
        return [submessage for each in sent if each for submessage in each.submessages]

    def receive(self, *parts: bytes) -> None:
        """Handle the submessages of a datagram of the writer."""
        read = read_datagram(datagram_head(PEER, US) + b"".join(parts), US)
        assert read is not None
        for submessage in read.submessages:
            self.handle(submessage)

    def handle(self, submessage: Submessage) -> None:
        match submessage:
            case Data():
                self.reader.on_data(GUID, submessage, self.now)
            case DataFrag():
                self.reader.on_data_frag(GUID, submessage, self.now)
            case Heartbeat():
                self.reader.on_heartbeat(GUID, submessage, self.now)
            case HeartbeatFrag():
                self.reader.on_heartbeat_frag(GUID, submessage, self.now)
            case Gap():
                self.reader.on_gap(GUID, submessage)

    def sample(self, number: int) -> None:
        self.receive(data_head(READER, WRITER, number, 4), b"%4d" % number)

    def fragment(self, number: int, which: int) -> None:
        """One of three fragments of a sample of 300 bytes."""
        self.receive(data_frag_head(READER, WRITER, number, which, 100, 300, 100), bytes([which]) * 100)

    def beat(self, first: int, last: int, number: int = 1, *, is_final: bool = False) -> None:
        self.receive(heartbeat(READER, WRITER, first, last, number, is_final=is_final))

    def wait(self, seconds: float) -> None:
        """Advance the time, from one deadline to the next."""
        end = self.now + seconds
        while self.reader.deadline <= end:
            self.now = max(self.now, self.reader.deadline)
            self.reader.poll(self.now, self.now)
        self.now = end

    def numbers(self) -> list[int]:
        return [each.sequence for each in self.delivered]


def test_missing_samples_are_requested_until_they_arrive() -> None:
    ears = Ears()
    ears.beat(1, 3)
    ears.sample(3)
    ears.wait(1.0)
    requests = [each for each in ears.requests() if isinstance(each, AckNack)]

    assert {each.missing for each in requests[1:]} == {(1, 2)}
    assert 4 < len(requests) < 12
    ears.sample(1)
    ears.sample(2)
    assert ears.numbers() == [1, 2, 3]


def test_a_heartbeat_that_lacks_nothing_is_acknowledged() -> None:
    ears = Ears()
    ears.beat(1, 1)
    ears.sample(1)
    ears.requests()
    ears.beat(1, 1, 2)
    ears.beat(1, 1, 3, is_final=True)

    assert [(each.base, each.missing) for each in ears.requests() if isinstance(each, AckNack)] == [(2, ())]
    assert ears.reader.deadline == math.inf


def test_a_heartbeat_is_asked_for_until_it_arrives() -> None:
    ears = Ears()
    ears.wait(0.5)
    asked = [each for each in ears.requests() if isinstance(each, AckNack)]

    assert [(each.base, each.missing, each.is_final) for each in asked] == [(1, (), False)] * len(asked)
    assert 3 <= len(asked) <= 6


def test_samples_that_a_writer_never_sends_are_given_up() -> None:
    ears = Ears()
    ears.beat(1, 2)
    ears.sample(2)
    ears.wait(60.0)

    assert (ears.numbers(), ears.reader.lost) == ([2], 1)


def test_samples_that_are_no_longer_kept_are_passed_over() -> None:
    ears = Ears()
    ears.beat(1, 1)
    ears.sample(1)
    ears.sample(4)
    ears.beat(6, 6, 2)
    ears.sample(6)

    assert (ears.numbers(), ears.reader.lost) == ([1, 4, 6], 3)


def test_gaps_before_and_after_early_samples_are_passed_over() -> None:
    ears = Ears()
    ears.receive(gap(READER, WRITER, 4, 6))
    ears.sample(6)
    ears.receive(gap(READER, WRITER, 1, 3))
    ears.sample(3)

    assert ears.numbers() == [3, 6]


@pytest.mark.parametrize("end", [6, 20])
def test_early_samples_in_a_gap_are_delivered(end: int) -> None:
    """A writer that keeps few samples sends a GAP for those that it has replaced."""
    ears = Ears()
    ears.beat(1, 30)
    for number in (1, 2, 5, 4, 29, 28, 27, 26):
        ears.sample(number)
    ears.receive(gap(READER, WRITER, 3, end))

    assert ears.numbers() == [1, 2, 4, 5]
    ears.wait(60.0)
    assert ears.numbers() == [1, 2, 4, 5, 26, 27, 28, 29]
    assert (ears.reader.lost, ears.budget.used) == (26 - end, 0)


def test_repeated_samples_and_gaps_do_nothing() -> None:
    ears = Ears()
    ears.beat(1, 1)
    for _ in range(2):
        ears.sample(1)
        ears.receive(gap(READER, WRITER, 1, 2))

    assert ears.numbers() == [1]


def test_missing_fragments_are_requested() -> None:
    ears = Ears()
    ears.beat(1, 1)
    ears.requests()
    ears.fragment(1, 2)
    ears.wait(0.1)
    wanted = {each.missing for each in ears.requests() if isinstance(each, NackFrag)}
    ears.fragment(1, 1)
    ears.fragment(1, 3)

    assert wanted == {(1, 3)}
    assert ears.delivered[0].payload == bytes([1]) * 100 + bytes([2]) * 100 + bytes([3]) * 100
    assert ears.budget.used == 0


def test_the_tail_of_a_sample_is_requested_after_a_heartbeat_of_fragments() -> None:
    ears = Ears()
    ears.beat(1, 1)
    ears.handle(HeartbeatFrag(READER, WRITER, 2, 3, 1))
    ears.sample(1)
    ears.wait(0.1)

    assert any(each.missing == (2,) for each in ears.requests() if isinstance(each, AckNack))


def test_fragments_that_contradict_each_other_are_dropped() -> None:
    ears = Ears()
    ears.beat(1, 1)
    ears.fragment(1, 1)
    ears.receive(data_frag_head(READER, WRITER, 1, 2, 150, 300, 152), bytes(152))
    ears.fragment(1, 2)
    ears.fragment(1, 3)

    assert ears.delivered[0].payload == bytes([1]) * 100 + bytes([2]) * 100 + bytes([3]) * 100


def test_incomplete_best_effort_samples_are_dropped_after_a_while() -> None:
    ears = Ears(is_reliable=False)
    ears.fragment(1, 1)
    assert ears.budget.used > 0
    ears.wait(11.0)

    assert (ears.budget.used, ears.reader.deadline) == (0, math.inf)


def test_a_newer_best_effort_sample_replaces_an_incomplete_one() -> None:
    ears = Ears(is_reliable=False)
    ears.fragment(1, 1)
    ears.sample(2)
    ears.fragment(1, 2)
    ears.sample(1)

    assert (ears.numbers(), ears.budget.used) == ([2], 0)


def test_early_samples_beyond_the_limit_are_requested_again() -> None:
    ears = Ears(limit_bytes=2000)
    ears.beat(1, 30)
    for number in range(2, 31):
        ears.sample(number)
    assert ears.budget.used <= 2000
    ears.sample(1)
    ears.requests()
    ears.beat(1, 30, 2)
    ears.wait(0.1)
    requests = [each for each in ears.requests() if isinstance(each, AckNack) and each.missing]

    assert requests[-1].missing == tuple(range(ears.numbers()[-1] + 1, 31))


def test_the_end_of_a_writer_frees_what_it_used() -> None:
    ears = Ears()
    ears.beat(1, 9)
    ears.sample(3)
    ears.fragment(5, 1)
    ears.reader.unmatch(GUID)
    ears.reader.unmatch(GUID)
    ears.sample(1)

    assert (ears.budget.used, ears.numbers(), ears.reader.deadline) == (0, [], math.inf)


def fragment_requests(ears: Ears) -> list[tuple[int, ...]]:
    return [each.missing for each in ears.requests() if isinstance(each, NackFrag)]


def test_heartbeats_cause_no_second_request_while_the_first_is_answered() -> None:
    """Cyclone DDS sends many heartbeats; each repeated answer would displace a new one."""
    ears = Ears()
    ears.beat(1, 1)
    ears.requests()
    ears.fragment(1, 3)
    ears.now += 0.01
    for number in range(2, 50):
        ears.beat(1, 1, number)
        ears.now += 0.0001
    assert fragment_requests(ears) == []  # the whole sample was requested, and the answer has begun
    ears.wait(0.03)
    assert fragment_requests(ears) == [(1, 2)]
    ears.fragment(1, 2)
    ears.fragment(1, 1)

    assert ears.numbers() == [1]


def test_the_next_request_follows_when_everything_requested_has_arrived() -> None:
    ears = Ears()
    ears.beat(1, 2)
    ears.beat(1, 400, 2)
    ears.requests()
    for number in (1, 2):
        ears.sample(number)
    (request,) = [each for each in ears.requests() if isinstance(each, AckNack)]

    assert (request.base, request.missing) == (3, tuple(range(3, 259)))


def test_nothing_is_requested_again_before_what_has_arrived_is_handled() -> None:
    """The answers may wait in the backlog of a busy process."""
    ears = Ears()
    ears.beat(1, 3)
    ears.requests()
    asked_at, ears.now = ears.now, ears.now + 5.0
    ears.reader.poll(ears.now, handled_until=asked_at + 0.001)
    assert ears.requests() == []
    ears.reader.poll(ears.now, handled_until=asked_at + 0.1)

    assert [each.missing for each in ears.requests() if isinstance(each, AckNack)] == [(1, 2, 3)]


def test_overlapping_runs_of_fragments_are_joined() -> None:
    """Cyclone DDS sends ten fragments at a time, and repeats them one by one."""
    ears = Ears()
    ears.beat(1, 1)
    pieces = [bytes([number]) * 100 for number in (1, 2, 3)]
    ears.fragment(1, 2)
    for first, part in ((1, pieces[0] + pieces[1]), (2, pieces[1] + pieces[2])):
        run = DataFrag(READER, WRITER, 1, first, 2, 100, 300, None, memoryview(part))
        ears.handle(run)

    assert [each.payload for each in ears.delivered] == [b"".join(pieces)]
    assert ears.budget.used == 0


def fragments_of_large_samples(ears: Ears, sequence: int, which: range) -> None:
    """Some of the 100 fragments, of 1,000 bytes each, of a sample."""
    for number in which:
        head = data_frag_head(READER, WRITER, sequence, number, 1_000, 100_000, 1_000)
        ears.receive(head, bytes(1_000))


def test_fragments_of_an_answered_sample_cause_no_requests_for_others() -> None:
    """During a flood, each arriving fragment caused a request for all samples that had lost some."""
    ears = Ears()
    ears.beat(1, 3)
    for sequence in (1, 2, 3):
        fragments_of_large_samples(ears, sequence, range(1, 31))
    ears.wait(0.1)
    ears.requests()
    for sequence in (1, 2):
        fragments_of_large_samples(ears, sequence, range(31, 100))

    assert fragment_requests(ears) == []
    for sequence in (1, 2, 3):
        fragments_of_large_samples(ears, sequence, range(31, 101))
    assert ears.numbers() == [1, 2, 3]


# Fragments of one sample: joined, and counted in the budget until they are released.


HASH: Parameters = {0x70: [b"key hash of 16 b"]}
SIZE, COUNT = 1000, 3


def fragment(which: int, inline: Parameters | None = None) -> DataFrag:
    """One of three fragments of a sample."""
    return DataFrag(READER, WRITER, 1, which, 1, SIZE, COUNT * SIZE, inline, bytes([which]) * SIZE)


def started(budget: Budget) -> Assembly:
    made = Assembly.start(budget, fragment(1), 100.0)
    assert made is not None
    return made


def test_fragments_are_joined_in_any_order_with_the_first_inline_values() -> None:
    budget = Budget(100_000)
    assembly = started(budget)
    other: Parameters = {0x70: [b"a later key hash"]}
    assert assembly.add(fragment(3, HASH), 101.0) is None
    assert assembly.add(fragment(1, other), 102.0) is None

    assert assembly.add(fragment(2), 103.0) == b"".join(bytes([which]) * SIZE for which in (1, 2, 3))
    assert (assembly.inline, assembly.changed_at) == (HASH, 103.0)
    assert budget.used >= COUNT * (SIZE + PIECE_OVERHEAD_BYTES) + inline_bytes(HASH)
    assembly.release()
    assert budget.used == 0


def test_inline_values_beyond_the_budget_are_left_out() -> None:
    budget = Budget(10_000)
    assembly = started(budget)
    assembly.add(fragment(1, {0x70: [bytes(20_000)]}), 101.0)

    assert assembly.inline is None
    assert assembly.missing() == (2, 3)


def test_a_fragment_beyond_the_budget_is_dropped_and_remains_missing() -> None:
    budget = Budget(10_000)
    assembly = started(budget)
    assembly.add(fragment(1), 101.0)
    others = budget.left
    budget.take(others)
    for which in (2, 3):
        assert assembly.add(fragment(which), 102.0) is None
    assert 3 in assembly.missing()

    budget.give_back(others)
    for which in assembly.missing():
        complete = assembly.add(fragment(which), 103.0)
    assert complete == b"".join(bytes([which]) * SIZE for which in (1, 2, 3))


def test_no_assembly_starts_without_budget() -> None:
    assert Assembly.start(Budget(PIECE_OVERHEAD_BYTES - 1), fragment(1), 100.0) is None
