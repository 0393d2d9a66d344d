"""The writing end, with readers that do not behave as expected."""

from dataclasses import replace

from pipros_ros2.rtps.decoding import read_datagram
from pipros_ros2.rtps.outbox import DatagramOutbox
from pipros_ros2.rtps.parameters import Address
from pipros_ros2.rtps.qos import DurabilityKind, Qos, ReliabilityKind
from pipros_ros2.rtps.submessages import AckNack, Data, DataFrag, Gap, Heartbeat, NackFrag, Submessage
from pipros_ros2.rtps.writer import QUEUE_BYTES, Writer

US, PEER = b"our prefix..", b"peer prefix."
WRITER, READER = b"\0\0\1\3", b"\0\0\1\4"
GUID = PEER + READER
HERE = Address("127.0.0.1", 7410)
LATCHED = Qos(durability=DurabilityKind.TRANSIENT_LOCAL, depth=5)


class Voice:
    """A writer that has matched one reader, and everything that it sends."""

    def __init__(
        self,
        offered: Qos,
        requested: Qos | None = None,
        fragment_bytes: int = 100,
        history_bytes: int = 1_000_000,
    ) -> None:
        self.now = 100.0
        self.outbox = DatagramOutbox()
        self.writer = Writer(US, WRITER, offered, history_bytes, self.outbox)
        self.fragment_bytes = fragment_bytes
        self._answers = 0
        if requested is not None:
            self.match(requested)

    def match(self, requested: Qos) -> None:
        self.writer.match(GUID, HERE, requested, self.fragment_bytes, self.now)

    def write(self, payload: bytes, recipients: frozenset[bytes] | None = None) -> None:
        self.writer.write(payload, self.now, recipients=recipients)

    def answer(self, base: int, missing: tuple[int, ...] = (), *, is_final: bool = True) -> None:
        self._answers += 1
        acknack = AckNack(READER, WRITER, base, missing, self._answers, is_final)
        self.writer.on_acknack(GUID, acknack, self.now)

    def ask_for_fragments(self, sequence: int, missing: tuple[int, ...]) -> None:
        self._answers += 1
        self.writer.on_nack_frag(GUID, NackFrag(READER, WRITER, sequence, missing, self._answers))

    def sent(self) -> list[Submessage]:
        """The submessages that the writer has sent since the last call, after all bursts."""
        while self.outbox.deadline <= self.now:
            self.outbox.poll(self.now)
            self.now += 0.001
        return self.taken()

    def taken(self) -> list[Submessage]:
        """The submessages that are ready, without waiting for a burst."""
        read = [read_datagram(b"".join(each.parts), PEER) for each in self.outbox.take()]
        return [submessage for each in read if each for submessage in each.submessages]

    def fragments(self, *, wait: bool = True) -> list[tuple[int, int]]:
        """The samples and numbers of the fragments sent since the last call, after all bursts if `wait`."""
        read = self.sent() if wait else self.taken()
        return [(each.sequence, each.first) for each in read if isinstance(each, DataFrag)]

    def numbers(self) -> list[int]:
        """The samples that the writer has sent since the last call."""
        return [each.sequence for each in self.sent() if isinstance(each, Data)]


def test_samples_wait_for_the_first_answer_of_a_reliable_reader() -> None:
    """Cyclone DDS drops samples that arrive before it knows the writer, and never requests them."""
    voice = Voice(Qos(depth=10), Qos())
    for number in range(3):
        voice.write(b"%4d" % number)
    early = voice.sent()

    assert [type(each) for each in early] == [Heartbeat]
    assert [(each.first, each.last) for each in early if isinstance(each, Heartbeat)] == [(1, 0)]
    voice.answer(1)
    assert voice.numbers() == [1, 2, 3]
    voice.answer(4)
    assert voice.writer.is_acknowledged


def test_a_request_for_a_heartbeat_does_not_answer_one() -> None:
    """Readers ask before a heartbeat; Cyclone DDS ignores the samples that the first one announces."""
    voice = Voice(Qos(depth=10), Qos())
    voice.write(b"one.")
    voice.sent()
    voice.answer(1, is_final=False)
    beats = [(each.first, each.last, each.is_final) for each in voice.sent() if isinstance(each, Heartbeat)]
    assert beats == [(1, 0, False)]
    voice.answer(1)

    assert voice.numbers() == [1]


def test_a_reader_that_only_asks_for_heartbeats_gets_samples_after_a_while() -> None:
    voice = Voice(Qos(depth=10), Qos())
    voice.write(b"one.")
    for _ in range(3):
        voice.answer(1, is_final=False)

    assert voice.numbers() == [1]


def test_a_reader_that_never_answers_gets_the_samples_that_are_kept_once_it_does() -> None:
    voice = Voice(Qos(depth=2), Qos())
    for number in range(5):
        voice.write(b"%4d" % number)
    voice.answer(1)
    held = voice.sent()

    assert [each.sequence for each in held if isinstance(each, Data)] == [4, 5]
    assert {each.first for each in held[1:] if isinstance(each, Heartbeat)} == {4}
    assert voice.writer.dropped == 3


def test_samples_that_are_displaced_before_they_are_sent_completely_are_lost() -> None:
    voice = Voice(Qos(depth=1), Qos())
    voice.answer(1)
    for number in range(3):
        voice.write(bytes([number]) * 250)

    assert voice.writer.lost == 2
    assert {each.sequence for each in voice.sent() if isinstance(each, DataFrag)} == {3}
    voice.answer(1, (1, 2))
    assert voice.writer.lost == 2


def test_a_sample_that_is_being_sent_is_completed_before_newer_ones_displace_it() -> None:
    voice = Voice(Qos(depth=2), Qos(), fragment_bytes=50_000)
    voice.answer(1)
    voice.write(bytes(200_000))
    voice.outbox.poll(voice.now)
    voice.now += 0.001
    for _ in range(3):
        voice.write(bytes(200_000))

    assert voice.fragments() == [(sequence, number) for sequence in (1, 2, 3, 4) for number in range(1, 5)]
    assert voice.writer.lost == 0
    voice.write(b"new.")
    voice.answer(1, (1, 2, 3, 4))
    assert voice.numbers() == [5]
    assert {number for number, _ in voice.fragments()} == set()


def test_a_late_reader_gets_no_more_latched_samples_than_the_depth() -> None:
    """Even if more are kept behind one that is being sent."""
    voice = Voice(replace(LATCHED, depth=1), replace(LATCHED, depth=1), fragment_bytes=50_000)
    voice.answer(1)
    voice.write(bytes(200_000))
    voice.outbox.poll(voice.now)
    for _ in range(3):
        voice.write(bytes(200_000))
    late = Address("127.0.0.1", 7412)
    voice.writer.match(PEER + b"\0\0\2\4", late, LATCHED, 50_000, voice.now)

    parts = [b"".join(each.parts) for each in voice.outbox.take() if each.address == late]
    read = [submessage for part in parts for submessage in read_datagram(part, PEER).submessages]
    assert [(each.first, each.last) for each in read if isinstance(each, Heartbeat)] == [(4, 4)]


def test_samples_beyond_the_depth_are_limited_in_bytes() -> None:
    voice = Voice(Qos(depth=2), Qos(), fragment_bytes=50_000, history_bytes=2 * QUEUE_BYTES)
    voice.answer(1)
    voice.write(bytes(QUEUE_BYTES // 4))
    voice.outbox.poll(voice.now)
    for _ in range(5):
        voice.write(bytes(QUEUE_BYTES // 4))

    voice.now += 0.001
    assert {number for number, _ in voice.fragments()} == {1, 5, 6}


def test_samples_that_cannot_be_sent_as_fast_as_they_are_written_leave_no_hole() -> None:
    """Otherwise, a GAP could name a sample of which a reader has fragments: Fast DDS's `take` then hangs."""
    voice = Voice(Qos(depth=10), Qos(), fragment_bytes=50_000)
    voice.answer(1)
    arrived = []
    for _ in range(30):
        voice.write(bytes(300_000))
        voice.outbox.poll(voice.now)
        voice.now += 0.001
        arrived += voice.fragments(wait=False)
    arrived += voice.fragments()
    voice.answer(1, tuple(range(1, 31)))
    later = voice.sent()

    assert [each for each in later if isinstance(each, Gap)] == []
    again = {each.sequence for each in later if isinstance(each, DataFrag)}
    assert again == set(range(min(again), 31))
    whole = [number for number in range(1, 31) if (number, 1) in arrived and (number, 6) in arrived]
    assert 10 < len(whole) < 30


def test_samples_that_a_reader_requests_in_vain_are_lost() -> None:
    voice = Voice(Qos(depth=2), Qos())
    voice.answer(1)
    for number in range(4):
        voice.write(b"%4d" % number)
    assert (voice.numbers(), voice.writer.dropped, voice.writer.lost) == ([1, 2, 3, 4], 2, 0)

    for _ in range(2):
        voice.answer(2, (2, 3))

    assert voice.writer.lost == 1


def test_best_effort_readers_get_samples_at_once() -> None:
    voice = Voice(Qos(), Qos(ReliabilityKind.BEST_EFFORT))
    voice.write(b"now.")

    assert voice.numbers() == [1]
    assert voice.writer.is_acknowledged


def test_samples_for_others_become_gaps() -> None:
    voice = Voice(Qos(depth=10), Qos())
    voice.answer(1)
    voice.write(b"one.", frozenset([b"another reader.."]))
    voice.write(b"two.")
    sent = voice.sent()

    assert [(each.start, each.base) for each in sent if isinstance(each, Gap)] == [(1, 2)]
    voice.answer(1, (1,))
    assert [(each.start, each.base) for each in voice.sent() if isinstance(each, Gap)] == [(1, 2)]


def test_no_gap_names_a_sample_that_is_no_longer_kept() -> None:
    voice = Voice(Qos(depth=2), Qos())
    voice.answer(1)
    for _ in range(4):
        voice.write(b"one.", frozenset([b"another reader.."]))
    voice.write(b"two.")
    sent = voice.sent()

    assert [(each.start, each.base) for each in sent if isinstance(each, Gap)] == [(4, 5)]
    assert [(each.first, each.last) for each in sent if isinstance(each, Heartbeat)][-1] == (4, 5)


def test_requested_fragments_are_sent_before_newer_samples() -> None:
    """Otherwise, the requested sample would be displaced before its turn, and hardly any would arrive."""
    voice = Voice(Qos(depth=10), Qos(), fragment_bytes=50_000, history_bytes=5_000_000)
    voice.answer(1)
    voice.write(bytes(250_000))
    assert len(voice.fragments()) == 5
    for _ in range(3):
        voice.write(bytes(250_000))
    voice.ask_for_fragments(1, (2, 4))

    order = voice.fragments()
    assert (order[:3], len(order)) == ([(1, 2), (1, 4), (2, 1)], 17)


def test_requests_leave_half_of_each_burst_to_newer_samples() -> None:
    voice = Voice(Qos(depth=10), Qos(), fragment_bytes=50_000, history_bytes=5_000_000)
    voice.answer(1)
    voice.write(bytes(1_000_000))
    voice.fragments()
    voice.write(bytes(1_000_000))
    voice.ask_for_fragments(1, tuple(range(1, 21)))
    voice.outbox.poll(voice.now)

    assert {sequence for sequence, _ in voice.fragments(wait=False)} == {1, 2}


def test_readers_must_answer_the_heartbeat_after_fragments() -> None:
    """So that they request lost fragments at once, as from Fast DDS and Cyclone DDS."""
    voice = Voice(Qos(depth=10), Qos())
    voice.answer(1)
    voice.write(bytes(250))

    assert [each.is_final for each in voice.sent() if isinstance(each, Heartbeat)][-1] is False


def test_requested_fragments_are_sent_again_and_others_ignored() -> None:
    voice = Voice(Qos(depth=1), Qos())
    voice.answer(1)
    voice.write(bytes(250))
    assert [each.first for each in voice.sent() if isinstance(each, DataFrag)] == [1, 2, 3]
    voice.ask_for_fragments(1, (2, 9))
    assert [each.first for each in voice.sent() if isinstance(each, DataFrag)] == [2]
    voice.write(b"new.")
    voice.ask_for_fragments(1, (1,))

    sent = voice.sent()
    assert [each for each in sent if isinstance(each, Gap)] == []
    assert [(each.first, each.last) for each in sent if isinstance(each, Heartbeat)][-1] == (2, 2)


def test_answers_of_strangers_and_repeated_answers_do_nothing() -> None:
    voice = Voice(Qos(depth=10), Qos())
    voice.answer(1)
    voice.write(b"one.")
    voice.sent()
    voice.answer(1, (1,))
    voice.ask_for_fragments(1, (1,))
    voice.sent()
    voice.writer.on_acknack(GUID, AckNack(READER, WRITER, 1, (1,), 2, True), voice.now)
    voice.writer.on_nack_frag(GUID, NackFrag(READER, WRITER, 1, (1,), 3))
    for number in (2, 9):
        again = AckNack(READER, WRITER, 1, (1,), number, False)
        voice.writer.on_acknack(b"stranger........", again, voice.now)
        voice.writer.on_nack_frag(b"stranger........", NackFrag(READER, WRITER, 1, (1,), number))

    assert voice.sent() == []


def test_a_reader_that_starts_again_gets_the_latched_sample_until_it_answers() -> None:
    """A participant that has taken us for dead, and then finds us again, has new readers and new numbers."""
    voice = Voice(LATCHED, LATCHED)
    voice.answer(1)
    voice.write(b"map.")
    voice.answer(2)
    voice.sent()
    assert voice.writer.is_acknowledged

    again = AckNack(READER, WRITER, 0, (), 2, False)  # with the number of the last answer
    voice.writer.on_acknack(GUID, again, voice.now)
    (beat,) = [each for each in voice.sent() if isinstance(each, Heartbeat)]
    assert (beat.last, beat.is_final) == (1, False)
    voice.answer(1, (1,))
    assert voice.numbers() == [1]
    voice.now = voice.writer.deadline
    voice.writer.poll(voice.now)
    assert [type(each) for each in voice.sent()] == [Heartbeat]
    voice.answer(2)
    assert voice.writer.is_acknowledged


def test_a_late_latched_reader_gets_the_history_once() -> None:
    """As from Fast DDS and Cyclone DDS: samples that were sent before the request would be sent twice."""
    voice = Voice(LATCHED)
    for number in range(7):
        voice.write(b"%4d" % number)
    voice.match(LATCHED)

    beats = [(each.first, each.last, each.is_final) for each in voice.sent() if isinstance(each, Heartbeat)]
    assert beats == [(3, 7, False)]
    voice.answer(3, (3, 4, 5, 6, 7))
    assert voice.numbers() == [3, 4, 5, 6, 7]
