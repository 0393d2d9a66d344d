"""Requests and replies in the styles of rmw_fastrtps and rmw_cyclonedds."""

from __future__ import annotations

import pytest

from pipros_ros2.rtps.announcements import EndpointData, ParticipantData
from pipros_ros2.rtps.identity import CYCLONE_DDS, FAST_DDS, OWN_VENDOR
from pipros_ros2.rtps.parameters import Parameters, SampleIdentity, read_parameters, related_sample
from pipros_ros2.rtps.qos import Qos
from pipros_ros2.rtps.service_styles import (
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
from pipros_ros2.rtps.writer_proxy import RtpsSample

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
