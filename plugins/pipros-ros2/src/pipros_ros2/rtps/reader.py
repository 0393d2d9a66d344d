"""RTPS readers, which deliver each writer's samples in order and request missing ones.

Theory of operation. A sample of a reliable writer is delivered after all earlier samples that exist for this
reader; heartbeats and GAPs show which samples do not exist. Samples that arrive early wait, within a budget
of bytes. A missing sample is requested when a heartbeat reveals it, and again at doubling intervals. If
`MAX_REQUESTS` requests in a row yield no data, the samples before the first early one are skipped. There is
one request at a time: while the requested samples arrive, heartbeats cause no further request, because
repeated samples would displace new ones. Until a writer's first heartbeat arrives, empty ACKNACKs ask for
one, because the writer may have sent its heartbeat before it discovered this reader. Fast DDS responds to
these only if their base is 0, but Cyclone DDS rejects that base as malformed. From best-effort writers, late
and repeated samples are dropped.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from pipros.basics.budget import Budget
from pipros_ros2.rtps.encoding import acknack, datagram_head, nack_frag
from pipros_ros2.rtps.incomplete import Assembly, total_fragments
from pipros_ros2.rtps.outbox import DatagramOutbox
from pipros_ros2.rtps.parameters import Address
from pipros_ros2.rtps.submessages import Data, DataFrag, Gap, Heartbeat, HeartbeatFrag
from pipros_ros2.rtps.writer_proxy import REQUEST_AGAIN_S, RtpsSample, WriterProxy

SLOWEST_REQUEST_S: Final = 1.0
SLOWEST_GREETING_S: Final = 10.0
"""Maximum interval between ACKNACKs to a writer that has never sent a heartbeat."""
ARRIVING_S: Final = 0.004
"""Fragments are not requested if another fragment of the sample has arrived within this time."""
REQUEST_BYTES: Final = 128_000
"""Number of bytes that fit into a receive buffer of the usual size, 208 KiB."""
MAX_REQUESTS: Final = 12
MAX_GAPS: Final = 32
MAX_ASSEMBLIES: Final = 256
MAX_FRAGMENTS: Final = 1 << 17
"""`MAX_GAPS` to `MAX_FRAGMENTS` limit the work that one submessage causes; the budgets limit memory."""
KEPT_PER_WORK: Final = 64
"""Number of early samples and assemblies that a heartbeat walks through for one unit of work."""
ABANDONED_S: Final = 5.0
"""Fragments of a best-effort sample are dropped if no further fragment arrives within this time."""


@dataclass(slots=True, eq=False)
class Reader:
    """A reader of samples; see the module docstring. Not thread-safe.

    Attributes:
        deliver: called for each sample.
        request_bytes: maximum number of bytes to request at a time, if the size of the samples is known.
        lost: number of samples that were given up, that reliable writers no longer had, or that exceeded a
            limit.
    """

    prefix: bytes
    entity: bytes
    sample_bytes: int
    outbox: DatagramOutbox
    deliver: Callable[[RtpsSample], None]
    request_bytes: int = REQUEST_BYTES
    writers: dict[bytes, WriterProxy] = field(default_factory=dict)
    lost: int = 0
    _answers: int = 0
    _waiting: dict[bytes, WriterProxy] = field(default_factory=dict)

    @property
    def is_waiting(self) -> bool:
        """True if `deadline` is finite."""
        return bool(self._waiting)

    def work(self, guid: bytes) -> int:
        """Return the units of work that the data kept for a writer adds to the handling of a submessage."""
        writer = self.writers.get(guid)
        return 0 if writer is None else (len(writer.early) + len(writer.assemblies)) // KEPT_PER_WORK

    def match(
        self,
        guid: bytes,
        address: Address,
        budget: Budget,
        now: float,
        *,
        is_reliable: bool,
        question_base: int = 1,
    ) -> None:
        """Add a writer, or change its address."""
        known = self.writers.get(guid)
        if known is not None:
            known.address = address
            return
        head = datagram_head(self.prefix, guid[:12])
        writer = self.writers[guid] = WriterProxy(guid, address, head, is_reliable, budget, question_base)
        if is_reliable:
            self._acknowledge(writer, (), is_final=False)
            self._wait(writer, now)

    def unmatch(self, guid: bytes) -> None:
        """Remove a writer and its incomplete samples. Do nothing if the writer is unknown."""
        self._waiting.pop(guid, None)
        writer = self.writers.pop(guid, None)
        if writer is not None:
            writer.release(writer.assemblies)
            for sequence in list(writer.early):
                writer.take_early(sequence)

    def _wait(self, writer: WriterProxy, now: float) -> None:
        if writer.due == math.inf:
            writer.interval_s = REQUEST_AGAIN_S
            writer.requests = 0
            writer.due = now + writer.interval_s
            self._waiting[writer.guid] = writer

    def _acknowledge(self, writer: WriterProxy, missing: tuple[int, ...], *, is_final: bool) -> None:
        self._answers += 1
        is_question = not (writer.is_greeted or missing)
        base = writer.question_base if is_question else writer.expected
        text = acknack(self.entity, writer.guid[12:], base, missing, self._answers, is_final=is_final)
        self.outbox.send(writer.address, writer.head, text)

    def on_data(self, guid: bytes, data: Data, now: float) -> None:
        writer = self.writers.get(guid)
        if writer is None or not writer.is_new(data.sequence):
            return
        sample = RtpsSample(guid, data.sequence, bytes(data.payload), data.inline, data.has_payload)
        self._accept(writer, sample, now)

    def _accept(self, writer: WriterProxy, sample: RtpsSample, now: float) -> None:
        """Deliver a new sample, or keep it until the earlier ones have arrived."""
        if not writer.is_reliable or sample.sequence == writer.expected:
            writer.expected = sample.sequence + 1
            writer.has_progressed = True
            self.deliver(sample)
            if writer.early or writer.skipped or writer.assemblies:
                self._catch_up(writer)
        elif writer.keep_early(sample):
            writer.announced = max(writer.announced, sample.sequence)
            self._wait(writer, now)
        if sample.sequence in writer.requested:
            writer.requested.discard(sample.sequence)
            writer.has_progressed = True
            if not writer.is_answering and writer.announced >= writer.expected:
                self._request(writer, now)

    def _catch_up(self, writer: WriterProxy) -> None:
        """Deliver the early samples that are next, and skip those that do not exist."""
        while True:
            if writer.expected in writer.early:
                sample = writer.take_early(writer.expected)
                writer.expected += 1
                self.deliver(sample)
                continue
            end = max((end for start, end in writer.skipped if start <= writer.expected), default=0)
            if end <= writer.expected:
                break
            self._pass(writer, end)
        writer.skipped = [each for each in writer.skipped if each[1] > writer.expected]
        writer.release(each for each in writer.assemblies if each < writer.expected)

    def _advance(self, writer: WriterProxy, first: int) -> None:
        """Deliver the samples before `first` that have arrived, and skip the others."""
        if first <= writer.expected:
            return
        self._pass(writer, first)
        self._catch_up(writer)

    def _pass(self, writer: WriterProxy, end: int) -> None:
        """Deliver the samples before `end` that have arrived, and expect `end` next.

        Samples that a GAP covers are delivered if they arrived before it: writers also send a GAP for
        samples that their history no longer contains.
        """
        early = writer.early
        if end - writer.expected < len(early):  # fast for short GAPs; a datagram can hold thousands of them
            arrived = [each for each in range(writer.expected, end) if each in early]
        else:
            arrived = sorted(each for each in early if each < end)
        for sequence in arrived:
            self.deliver(writer.take_early(sequence))
        writer.expected = end

    def on_data_frag(self, guid: bytes, fragment: DataFrag, now: float) -> None:
        writer = self.writers.get(guid)
        if writer is None:
            return
        sequence = fragment.sequence
        assembly = writer.assemblies.get(sequence) or self._start(writer, fragment, now)
        if assembly is None:
            return
        if sequence == writer.expected or sequence in writer.requested:
            writer.has_progressed = True
        payload = assembly.add(fragment, now)
        if payload is None:
            writer.announced = max(writer.announced, sequence)
            self._wait(writer, now)
            if sequence in writer.requested and not writer.is_answering:
                self._request(writer, now)
            return
        del writer.assemblies[sequence]
        inline = assembly.inline
        assembly.release()
        writer.usual_bytes = len(payload)
        self._accept(writer, RtpsSample(guid, sequence, payload, inline), now)

    def _start(self, writer: WriterProxy, fragment: DataFrag, now: float) -> Assembly | None:
        """Return a new assembly, or None if the sample is not new or exceeds a limit."""
        sequence = fragment.sequence
        if not writer.is_new(sequence):
            return None
        fragments = total_fragments(fragment.fragment_bytes, fragment.sample_bytes)
        if fragment.sample_bytes > self.sample_bytes or fragments > MAX_FRAGMENTS:
            self.lost += 1
            self._skip(writer, (sequence, sequence + 1))
            return None
        if len(writer.assemblies) >= MAX_ASSEMBLIES:
            return None
        assembly = Assembly.start(writer.budget, fragment, now)
        if assembly is not None:
            writer.assemblies[sequence] = assembly
        return assembly

    def on_gap(self, guid: bytes, gap: Gap) -> None:
        writer = self.writers.get(guid)
        if writer is None or not writer.is_reliable:
            return
        writer.is_greeted = True
        others = [(sequence, sequence + 1) for sequence in gap.others]
        self._skip(writer, (gap.start, max(gap.start, gap.base)), *others)

    def _skip(self, writer: WriterProxy, *ranges: tuple[int, int]) -> None:
        """Skip the samples in a range, and in further ranges of one sample each."""
        skipped = []
        for start, end in ranges:
            if end <= writer.expected:
                continue
            writer.has_progressed = True
            # ranges beyond the limit are ignored; the writer repeats the GAP when their samples are requested
            if start <= writer.expected or len(writer.skipped) < MAX_GAPS:
                writer.skipped.append((start, end))
                skipped.append((start, end))
        if not skipped:
            return
        first, last = skipped[0]
        singles = {start for start, _ in skipped[1:]}
        writer.release(each for each in writer.assemblies if first <= each < last or each in singles)
        writer.requested = {
            each for each in writer.requested if not (first <= each < last or each in singles)
        }
        self._catch_up(writer)

    def on_heartbeat(self, guid: bytes, beat: Heartbeat, now: float) -> None:
        writer = self.writers.get(guid)
        if writer is None or not writer.is_reliable:
            return
        if beat.first > writer.expected:
            if writer.is_greeted:
                arrived = sum(each < beat.first for each in writer.early)
                self.lost += beat.first - writer.expected - arrived
            self._advance(writer, beat.first)
        writer.is_greeted = True
        writer.announced = beat.last
        if beat.last >= writer.expected:
            self._wait(writer, now)
            if not writer.is_answering:
                self._request(writer, now)
            return
        if not beat.is_final:
            self._acknowledge(writer, (), is_final=True)
        self._rest(writer)

    def on_heartbeat_frag(self, guid: bytes, beat: HeartbeatFrag, now: float) -> None:
        writer = self.writers.get(guid)
        if writer is not None and writer.is_reliable and writer.is_new(beat.sequence):
            writer.announced = max(writer.announced, beat.sequence)
            self._wait(writer, now)

    def _rest(self, writer: WriterProxy) -> None:
        if writer.is_greeted and not writer.assemblies:
            writer.due = math.inf
            self._waiting.pop(writer.guid, None)

    def _request(self, writer: WriterProxy, now: float, *, is_repeated: bool = False) -> None:
        """Acknowledge, and request the next missing samples or fragments, up to `request_bytes`.

        If more were requested at once, the samples would overflow the receive buffer. A repeated request also
        asks for a heartbeat, which may reveal that the samples are no longer kept.
        """
        whole: list[int] = []
        left_bytes = self.request_bytes
        fragments: list[tuple[int, tuple[int, ...]]] = []
        for sequence in writer.missing():
            assembly = writer.assemblies.get(sequence)
            if assembly is None:
                whole.append(sequence)
                left_bytes -= writer.usual_bytes
            elif now - assembly.changed_at >= ARRIVING_S or assembly.is_answered:
                lacking = assembly.request(left_bytes)
                fragments.append((sequence, lacking))
                left_bytes -= len(lacking) * assembly.fragment_bytes
            if left_bytes <= 0:
                break
        writer.requested = {*whole, *(sequence for sequence, _ in fragments)}
        self._acknowledge(writer, tuple(whole), is_final=bool(whole) or not is_repeated)
        for sequence, lacking in fragments:
            self._answers += 1
            text = nack_frag(self.entity, writer.guid[12:], sequence, lacking, self._answers)
            self.outbox.send(writer.address, writer.head, text)

    @property
    def deadline(self) -> float:
        """Time at which `poll` must be called; infinite if nothing is pending."""
        return min((writer.due for writer in self._waiting.values()), default=math.inf)

    def poll(self, now: float, handled_until: float) -> None:
        """Repeat the requests and drop the abandoned fragments that were due by `handled_until`.

        All datagrams that arrived before `handled_until` must have been handled.
        """
        for writer in [each for each in self._waiting.values() if each.due <= handled_until]:
            if writer.is_reliable:
                self._poll_reliable(writer, now)
            else:
                self._abandon_old(writer, now)

    def _poll_reliable(self, writer: WriterProxy, now: float) -> None:
        if writer.has_progressed:
            writer.has_progressed = False
            writer.interval_s, writer.requests = REQUEST_AGAIN_S, 0
            if writer.is_answering:
                writer.due = now + writer.interval_s
                return
        else:
            slowest_s = SLOWEST_REQUEST_S if writer.is_greeted else SLOWEST_GREETING_S
            writer.interval_s = min(writer.interval_s * 2, slowest_s)
        writer.due = now + writer.interval_s
        if writer.announced >= writer.expected:
            writer.requests += 1
            if writer.requests > MAX_REQUESTS and writer.early:
                self.lost += min(writer.early) - writer.expected
                self._advance(writer, min(writer.early))
                writer.requests = 0
            else:
                self._request(writer, now, is_repeated=True)
        elif not writer.is_greeted:
            self._acknowledge(writer, (), is_final=False)
        else:
            self._rest(writer)

    def _abandon_old(self, writer: WriterProxy, now: float) -> None:
        assemblies = writer.assemblies.items()
        writer.release(seq for seq, each in assemblies if now - each.changed_at >= ABANDONED_S)
        writer.due = now + ABANDONED_S
        if not writer.assemblies:
            writer.due = math.inf
            self._waiting.pop(writer.guid, None)
