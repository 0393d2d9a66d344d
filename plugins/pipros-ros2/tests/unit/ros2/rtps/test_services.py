"""Servers and clients on real sockets, with peers of both styles and of none."""

import threading
from collections.abc import Iterator

import pytest

from pipros.basics.errors import NotFound
from pipros_ros2.rtps.announcements import EndpointData, ParticipantData
from pipros_ros2.rtps.domain import Discovery
from pipros_ros2.rtps.identity import CYCLONE_DDS, FAST_DDS, OWN_VENDOR
from pipros_ros2.rtps.parameters import Parameters, SampleIdentity, read_parameters, related_sample
from pipros_ros2.rtps.participant import Participant
from pipros_ros2.rtps.qos import Qos
from pipros_ros2.rtps.service_client import RtpsClient
from pipros_ros2.rtps.service_styles import (
    PIPROS_MARK,
    Style,
    cyclone_head,
    endpoint_id,
    id_entry,
    read_cyclone_head,
    read_request,
    split_head,
    style_of,
    with_head,
)
from pipros_ros2.rtps.services import RtpsServer, UnknownStyle
from pipros_ros2.rtps.topics import RtpsTopicWriter
from pipros_ros2.rtps.writer_proxy import RtpsSample
from tests.support.constants import Constants
from tests.support.ros2_domains import free_domain
from tests.support.waiting import wait_until

REQUEST, REPLY = "a::srv::dds_::B_Request_", "a::srv::dds_::B_Response_"
MARKED = f"enclave=/;{PIPROS_MARK}=test;".encode()
UNMARKED = b"enclave=/;"
"""USER_DATA of a participant of no known vendor."""
QOS = Qos(depth=1000)
CDR = b"\0\1\0\0"


@pytest.fixture
def pair() -> Iterator[tuple[Participant, Participant]]:
    with (
        free_domain() as domain,
        Participant(Discovery(domain), MARKED) as one,
        Participant(Discovery(domain), MARKED) as other,
    ):
        yield one, other


def test_services_are_called_by_many_clients(pair: tuple[Participant, Participant]) -> None:
    server = RtpsServer(pair[0], "/twice", REQUEST, REPLY, lambda payload: payload[:4] + payload[4:] * 2)
    clients = [RtpsClient(pair[1], "/twice", REQUEST, REPLY) for _ in range(3)]
    for client in clients:
        assert client.wait_for_server(60)
    for number in range(30):
        payload = b"\0\1\0\0" + number.to_bytes(4, "little")
        assert clients[number % 3].call(payload, 60.0) == payload + payload[4:]

    assert (server.clients(), server.refused, server.unanswered) == (3, 0, 0)
    server.close()
    wait_until(lambda: not clients[0].wait_for_server(0.0))
    with pytest.raises(NotFound, match="/twice"):
        clients[0].call(b"\0\1\0\0", 1.0)
    clients[0].close()


def test_a_service_that_does_not_reply_times_out(pair: tuple[Participant, Participant]) -> None:
    server = RtpsServer(pair[0], "/silent", REQUEST, REPLY, lambda _: None)
    client = RtpsClient(pair[1], "/silent", REQUEST, REPLY)
    assert client.wait_for_server(60)
    with pytest.raises(TimeoutError, match="/silent"):
        client.call(b"\0\1\0\0", 0.3)
    assert server.unanswered == 0


def test_nothing_is_sent_to_a_server_of_unknown_style(pair: tuple[Participant, Participant]) -> None:
    """Both endpoints of a service, by a peer that neither is a known vendor nor has ids in its USER_DATA."""
    with Participant(pair[0].discovery, UNMARKED) as stranger:
        received: list[RtpsSample] = []
        stranger.add_reader("rq/oddRequest", REQUEST, QOS, received.append)
        stranger.add_writer("rr/oddReply", REPLY, QOS)
        client = RtpsClient(pair[1], "/odd", REQUEST, REPLY)
        assert client.wait_for_server(60)
        with pytest.raises(UnknownStyle, match="/odd"):
            client.call(b"\0\1\0\0", 1.0)
        assert received == []


class CycloneClient:
    """A client in the style of rmw_cyclonedds, which sees the replies for all clients."""

    def __init__(
        self, participant: Participant, service: str, number: int, *, has_reader: bool = True
    ) -> None:
        entry = id_entry(number.to_bytes(16, "big"), is_client=True)
        self._number = number
        self.replies: list[bytes] = []
        if has_reader:
            self.reader = participant.add_reader(f"rr{service}Reply", REPLY, QOS, self._on_reply, entry)
        self.requests = participant.add_writer(f"rq{service}Request", REQUEST, QOS, entry)

    def _on_reply(self, sample: RtpsSample) -> None:
        self.replies.append(sample.payload)

    def call(self, sequence: int, payload: bytes) -> None:
        wait_for_reader(self.requests)
        self.requests.write(with_head(payload, cyclone_head(self._number, sequence)))

    def reply(self, sequence: int, payload: bytes) -> bytes:
        return with_head(payload, cyclone_head(self._number, sequence))


def wait_for_reader(writer: RtpsTopicWriter) -> None:
    assert writer.wait_for_readers(timeout_s=60)


def test_each_client_of_cyclone_gets_its_own_replies_alone(pair: tuple[Participant, Participant]) -> None:
    server = RtpsServer(pair[0], "/twice", REQUEST, REPLY, lambda payload: payload[:4] + payload[4:] * 2)
    with Participant(pair[0].discovery, UNMARKED) as peer:
        clients = [CycloneClient(peer, "/twice", number) for number in (1, 2)]
        for sequence in range(3):
            for client in clients:
                client.call(sequence, CDR + b"abcd")

        for client in clients:
            expected = [client.reply(sequence, CDR + b"abcdabcd") for sequence in range(3)]
            wait_until(lambda client=client, expected=expected: sorted(client.replies) == expected)
    assert (server.refused, server.unanswered) == (0, 0)


def test_requests_that_cannot_be_answered_are_counted(pair: tuple[Participant, Participant]) -> None:
    calls: list[bytes] = []

    def handle(payload: bytes) -> bytes:
        calls.append(payload)
        return payload

    server = RtpsServer(pair[0], "/odd", REQUEST, REPLY, handle)
    with Participant(pair[0].discovery, UNMARKED) as peer:
        without_reader = CycloneClient(peer, "/odd", 3, has_reader=False)
        without_reader.call(1, CDR + b"abcd")
        wait_until(lambda: server.unanswered == 1)
        assert calls == [CDR + b"abcd"]
        without_reader.requests.write(CDR + b"short")
        wait_until(lambda: server.refused == 1)
        stranger = peer.add_writer("rq/oddRequest", REQUEST, QOS)
        wait_for_reader(stranger)
        stranger.write(CDR + b"abcd" * 8)
        wait_until(lambda: server.refused == 2)

    assert calls == [CDR + b"abcd"]


def test_replies_that_a_client_never_acknowledges_do_not_stop_those_for_others(
    pair: tuple[Participant, Participant], constants: Constants
) -> None:
    constants(ROS2_HISTORY_BYTES=10_000)
    server = RtpsServer(pair[0], "/long", REQUEST, REPLY, lambda payload: payload + bytes(3000))
    client = RtpsClient(pair[1], "/long", REQUEST, REPLY)
    assert client.wait_for_server(60)
    with Participant(pair[0].discovery, UNMARKED) as peer:
        deaf = CycloneClient(peer, "/long", 1)
        deaf.call(0, CDR)
        wait_until(lambda: deaf.replies)
        peer.ask(lambda core: core.reader(deaf.reader.entity).writers.clear())
        for sequence in range(1, 5):
            deaf.call(sequence, CDR)
        replies = server.guids[1][12:]
        wait_until(lambda: not pair[0].ask(lambda core: core.writer(replies).has_space(3000)))

        assert client.call(CDR + b"some", 20.0) == CDR + b"some" + bytes(3000)


def test_a_server_in_the_style_of_cyclone_is_called(pair: tuple[Participant, Participant]) -> None:
    """It answers with a reply for another client first, which the client ignores."""
    with Participant(pair[0].discovery, UNMARKED) as peer:
        entry = id_entry(bytes(16), is_client=False)
        replies = peer.add_writer("rr/addReply", REPLY, QOS, entry)

        def answer(sample: RtpsSample) -> None:
            head, body = sample.payload[4:20], sample.payload[20:]
            for client in (cyclone_head(4711, 1), head):
                replies.write(CDR + client + body[::-1])

        peer.add_reader("rq/addRequest", REQUEST, QOS, answer, entry)
        client = RtpsClient(pair[1], "/add", REQUEST, REPLY)
        assert client.wait_for_server(60)

        assert client.call(CDR + b"abcd", 60.0) == CDR + b"dcba"
        assert client.call(CDR + b"efgh", 60.0) == CDR + b"hgfe"


def test_the_newest_server_is_called(pair: tuple[Participant, Participant]) -> None:
    """A server that was killed stays until its lease ends; the one started in its place gets the calls."""
    old = RtpsServer(pair[0], "/again", REQUEST, REPLY, lambda _: None)
    client = RtpsClient(pair[1], "/again", REQUEST, REPLY)
    assert client.wait_for_server(60)
    with Participant(pair[0].discovery, MARKED) as restarted:
        new = RtpsServer(restarted, "/again", REQUEST, REPLY, lambda payload: payload)
        wait_until(lambda: old.clients() == new.clients() == 1)
        wait_until(lambda: len(pair[1].ask(lambda engine: engine.writer(client.guids[1][12:]).readers)) == 2)
        wait_until(lambda: len(pair[1].ask(lambda engine: engine.reader(client.guids[0][12:]).writers)) == 2)

        assert client.call(CDR + b"some", 60.0) == CDR + b"some"


def test_calls_that_timed_out_do_not_affect_later_ones(pair: tuple[Participant, Participant]) -> None:
    going_on = threading.Event()

    def handle(payload: bytes) -> bytes | None:
        assert going_on.wait(60)
        return None if payload == CDR + b"none" else payload

    RtpsServer(pair[0], "/slow", REQUEST, REPLY, handle)
    client = RtpsClient(pair[1], "/slow", REQUEST, REPLY)
    assert client.wait_for_server(60)
    with pytest.raises(TimeoutError, match="/slow"):
        client.call(CDR + b"none", 0.05)
    going_on.set()

    assert client.call(CDR + b"some", 60.0) == CDR + b"some"


def test_small_requests_that_are_queued_count_more_than_their_bytes(
    pair: tuple[Participant, Participant], constants: Constants
) -> None:
    constants(ROS2_INBOX_BYTES=4000)  # half of it for one client
    may_reply = threading.Event()

    def hang(payload: bytes) -> bytes:
        may_reply.wait(60.0)
        return payload

    server = RtpsServer(pair[0], "/slow", REQUEST, REPLY, hang)
    with Participant(pair[0].discovery, UNMARKED) as peer:
        client = CycloneClient(peer, "/slow", 1)
        for sequence in range(6):
            client.call(sequence, CDR + b"1234")
        wait_until(lambda: server.refused == 3, 30, "the requests beyond the limit")
        may_reply.set()
    server.close()


# Requests and replies in the styles of rmw_fastrtps and rmw_cyclonedds.


PREFIX = bytes(range(12))
WRITER, READER = PREFIX + b"\0\0\1\3", PREFIX + b"\0\0\2\4"
BODY = b"\0\1\0\0" + b"message."
CONNEXT = b"\1\1"


@pytest.mark.parametrize(("vendor", "participant", "endpoint", "expected"), [
    (FAST_DDS, b"enclave=/;\0", b"", Style.FAST), (CYCLONE_DDS, b"enclave=/;", b"", Style.CYCLONE),
    (OWN_VENDOR, b"enclave=/;pipros=x;", b"serviceid=1;", Style.FAST),
    (OWN_VENDOR, b"enclave=/;", b"serviceid=1;", Style.CYCLONE),
    (CONNEXT, b"enclave=/;", b"typehash=RIHS01_00;", None),
])  # fmt: skip
def test_the_style_follows_vendor_and_ids(
    vendor: bytes, participant: bytes, endpoint: bytes, expected: Style | None
) -> None:
    peer = ParticipantData(PREFIX, vendor, user_data=participant)

    assert style_of(peer, EndpointData(WRITER, "rq/aRequest", "T", Qos(), endpoint)) is expected


def inline_of(identity: SampleIdentity) -> Parameters:
    return read_parameters(related_sample(identity), 0, is_little=True)[0]


def test_a_reply_to_fast_names_the_reader_and_the_request() -> None:
    request = read_request(RtpsSample(WRITER, 7, BODY, inline_of(SampleIdentity(READER, 0))), Style.FAST)
    assert request is not None

    assert (request.payload, request.reply_reader) == (BODY, READER)
    assert request.related == SampleIdentity(READER, 7)
    assert request.reply(BODY) == BODY


def test_a_request_without_a_reader_is_named_by_its_writer() -> None:
    request = read_request(RtpsSample(WRITER, 7, BODY), Style.FAST)
    assert request is not None

    assert (request.reply_reader, request.related) == (None, SampleIdentity(WRITER, 7))


def test_a_request_that_names_the_reader_of_another_participant_is_refused() -> None:
    other = SampleIdentity(bytes(reversed(range(16))), 0)

    assert read_request(RtpsSample(WRITER, 7, BODY, inline_of(other)), Style.FAST) is None


def test_a_reply_to_cyclone_repeats_the_bytes_before_the_message() -> None:
    head = cyclone_head(4711, 3)
    request = read_request(RtpsSample(WRITER, 7, with_head(BODY, head)), Style.CYCLONE)
    assert request is not None

    assert (request.payload, request.related) == (BODY, None)
    assert request.reply(BODY) == BODY[:4] + head + BODY[4:]
    assert (split_head(request.reply(BODY)), read_cyclone_head(head)) == ((head, BODY), (4711, 3))


@pytest.mark.parametrize("payload", [b"", BODY, b"\0\0\0\0" + bytes(24)])
def test_short_and_big_endian_requests_of_cyclone_are_refused(payload: bytes) -> None:
    assert read_request(RtpsSample(WRITER, 7, payload), Style.CYCLONE) is None


def test_ids_are_found_among_other_entries() -> None:
    assert endpoint_id(id_entry(bytes(16), is_client=False) + b"typehash=x;") == ".".join("0" * 16)
    assert endpoint_id(id_entry(b"\xff" * 16, is_client=True)) == ".".join(["ff"] * 16)
    assert endpoint_id(b"typehash=x;") is None
    assert read_cyclone_head(b"short") is None
