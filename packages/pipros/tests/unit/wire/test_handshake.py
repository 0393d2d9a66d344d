"""The headers that two peers exchange, and the reasons for a refusal."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros.basics.errors import LimitExceeded, ProtocolError, Refused
from pipros.wire.handshake import (
    WireType,
    accept_service_link,
    accept_topic_link,
    check_service_reply,
    check_topic_reply,
    request_service_link,
    request_topic_link,
    service_refusal,
    topic_refusal,
)
from pipros.wire.header import HeaderReader, decode_header, encode_header

STRING = WireType("std_msgs/String", "992ce8a1687cec8c8bd883ec73ca41d1", "string data\n")


OTHER = WireType("a/B", "0" * 32)


ANY = WireType("*", "*")


def test_a_subscriber_and_a_publisher_of_one_type_agree() -> None:
    request = request_topic_link("/chat", "/listener", STRING, tcp_nodelay=True)
    assert topic_refusal(request, STRING) is None
    reply = accept_topic_link("/chat", "/talker", STRING, latching=True)
    check_topic_reply(reply, STRING, "host:1")
    assert (request["tcp_nodelay"], reply["latching"]) == ("1", "1")


def test_only_the_md5sum_decides() -> None:
    renamed = WireType("my_msgs/Text", STRING.md5sum)
    assert topic_refusal(request_topic_link("/c", "/l", renamed, tcp_nodelay=False), STRING) is None
    assert topic_refusal(request_topic_link("/c", "/l", ANY, tcp_nodelay=False), STRING) is None


def test_a_refusal_names_both_types_and_md5sums() -> None:
    refusal = topic_refusal(request_topic_link("/c", "/l", OTHER, tcp_nodelay=False), STRING)
    for part in ("/l", "/c", "a/B", "0" * 32, STRING.type, STRING.md5sum):
        assert part in refusal


@pytest.mark.parametrize("missing", ["callerid", "topic", "md5sum"])
def test_a_subscriber_must_name_itself_and_the_topic(missing: str) -> None:
    request = request_topic_link("/c", "/l", STRING, tcp_nodelay=False)
    del request[missing]
    assert topic_refusal(request, STRING) == f"Missing required '{missing}' field"


def test_a_subscriber_may_omit_the_type() -> None:
    request = request_topic_link("/c", "/l", STRING, tcp_nodelay=False)
    del request["type"], request["message_definition"]
    assert topic_refusal(request, STRING) is None


def test_a_refusal_is_raised_with_the_publishers_text() -> None:
    with pytest.raises(Refused, match="no such topic"):
        check_topic_reply({"error": "no such topic"}, STRING, "host:1")


def test_a_publisher_of_another_type_is_not_connected() -> None:
    reply = accept_topic_link("/c", "/t", OTHER, latching=False)
    with pytest.raises(ProtocolError, match=r"sends \[a/B/0+\], but this node expects \[std_msgs/String/992"):
        check_topic_reply(reply, STRING, "host:1")


def test_a_service_client_adds_its_own_fields() -> None:
    request = request_service_link("/s", "/me", OTHER, persistent=True, extra={"token": "x"})
    assert (request["persistent"], request["token"], "probe" in request) == ("1", "x", False)
    assert service_refusal(request, OTHER) is None
    assert "md5sums do not match" in (service_refusal(request, STRING) or "")


def test_a_service_client_and_its_server_agree() -> None:
    request = request_service_link("/s", "/me", OTHER, probe=True)
    assert request["probe"] == "1"
    assert service_refusal(request, OTHER) is None
    reply = accept_service_link(
        "/s", "/server", OTHER, request_type="a/BRequest", response_type="a/BResponse"
    )
    check_service_reply(reply, "host:1")
    assert (reply["request_type"], reply["response_type"]) == ("a/BRequest", "a/BResponse")
    assert "request_type" not in accept_service_link("/s", "/server", OTHER)


def test_a_client_of_another_service_type_is_refused_with_both_md5sums() -> None:
    refusal = service_refusal(request_service_link("/s", "/me", OTHER), STRING)
    assert refusal == f"request from [/me]: md5sums do not match: [{OTHER.md5sum}] vs. [{STRING.md5sum}]"


@pytest.mark.parametrize("missing", ["service", "md5sum", "callerid"])
def test_a_service_client_must_name_itself_and_the_service(missing: str) -> None:
    request = request_service_link("/s", "/me", OTHER)
    del request[missing]
    assert service_refusal(request, OTHER) == f"Missing required '{missing}' field"


def test_a_refusal_is_raised_with_the_servers_text() -> None:
    with pytest.raises(Refused, match="no such service"):
        check_service_reply({"error": "no such service"}, "host:1")


def test_an_incomplete_response_names_the_peer_and_the_field() -> None:
    with pytest.raises(ProtocolError, match="service at host:1: Missing required 'callerid' field"):
        check_service_reply({}, "host:1")
    with pytest.raises(ProtocolError, match="publisher host:1: Missing required 'type' field"):
        check_topic_reply({"md5sum": STRING.md5sum}, STRING, "host:1")


# Connection headers, byte for byte, and malformed ones.


KEYS = st.text(st.characters(exclude_characters="=", exclude_categories=["Cs"]), min_size=1)


VALUES = st.text(st.characters(exclude_categories=["Cs"]))


def test_a_header_on_the_wire() -> None:
    assert encode_header({"topic": "/a", "x": "1=2"}) == (
        b"\x15\x00\x00\x00\x08\x00\x00\x00topic=/a\x05\x00\x00\x00x=1=2"
    )


@given(st.dictionaries(KEYS, VALUES))
def test_headers_survive_a_round_trip(fields: dict[str, str]) -> None:
    assert decode_header(encode_header(fields)[4:]) == fields


@pytest.mark.parametrize(("body", "problem"), [
    (b"\x01\x00", "ends inside a field length"),
    (b"\x09\x00\x00\x00a=b", "claims 9 bytes, but only 3 are left"), (b"\x03\x00\x00\x00abc", "has no '='"),
    (b"\x03\x00\x00\x00a=\xff", "is not UTF-8"),
])  # fmt: skip
def test_a_malformed_header_is_refused(body: bytes, problem: str) -> None:
    with pytest.raises(ProtocolError, match=problem):
        decode_header(body)


def test_a_header_byte_by_byte_leaves_the_following_bytes() -> None:
    reader = HeaderReader()
    stream = encode_header({"a": "b"})
    for byte in stream[:-1]:
        assert reader.feed(bytes([byte])) is None
    assert (reader.feed(stream[-1:] + b"rest"), reader.rest) == ({"a": "b"}, b"rest")


def test_a_header_has_at_most_a_thousand_fields() -> None:
    fields = {f"k{i}": "v" for i in range(1001)}
    with pytest.raises(LimitExceeded, match="at most 1000 fields"):
        HeaderReader().feed(encode_header(fields))
    del fields["k0"]
    assert HeaderReader().feed(encode_header(fields)) == fields


def test_a_header_above_the_limit_is_refused_at_once() -> None:
    with pytest.raises(LimitExceeded, match="2000 bytes was announced; the limit is 1000"):
        HeaderReader(limit_bytes=1000).feed(struct.pack("<I", 2000))
