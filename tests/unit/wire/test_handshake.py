"""What two ends tell each other, and when one refuses."""

from __future__ import annotations

import pytest

from pipros.errors import ProtocolError, Refused
from pipros.wire.handshake import (
    Interface,
    accept_topic_link,
    check_service_request,
    check_topic_reply,
    check_topic_request,
    request_service_link,
    request_topic_link,
)

STRING = Interface("std_msgs/String", "992ce8a1687cec8c8bd883ec73ca41d1", "string data\n")
OTHER = Interface("a/B", "0" * 32)
ANY = Interface("*", "*")


def test_a_subscriber_and_a_publisher_of_one_type_agree() -> None:
    request = request_topic_link("/chat", "/listener", STRING, tcp_nodelay=True)
    assert check_topic_request(request, STRING) is None
    reply = accept_topic_link("/chat", "/talker", STRING, latching=True)
    check_topic_reply(reply, STRING, "host:1")
    assert (request["tcp_nodelay"], reply["latching"]) == ("1", "1")


def test_only_the_md5sum_decides() -> None:
    renamed = Interface("my_msgs/Text", STRING.md5sum)
    assert check_topic_request(request_topic_link("/c", "/l", renamed, tcp_nodelay=False), STRING) is None
    assert check_topic_request(request_topic_link("/c", "/l", ANY, tcp_nodelay=False), STRING) is None


def test_a_refusal_names_both_types_and_md5sums() -> None:
    refusal = check_topic_request(request_topic_link("/c", "/l", OTHER, tcp_nodelay=False), STRING)
    assert refusal is not None
    for part in ("/l", "/c", "a/B", "0" * 32, STRING.type, STRING.md5sum):
        assert part in refusal


@pytest.mark.parametrize("missing", ["callerid", "topic", "md5sum"])
def test_a_subscriber_must_say_who_it_is_and_what_it_wants(missing: str) -> None:
    request = request_topic_link("/c", "/l", STRING, tcp_nodelay=False)
    del request[missing]
    assert check_topic_request(request, STRING) == f"Missing required '{missing}' field"


def test_a_publisher_need_not_be_told_the_type() -> None:
    request = request_topic_link("/c", "/l", STRING, tcp_nodelay=False)
    del request["type"], request["message_definition"]
    assert check_topic_request(request, STRING) is None


def test_a_refusal_is_raised_in_the_publishers_words() -> None:
    with pytest.raises(Refused, match="no such topic"):
        check_topic_reply({"error": "no such topic"}, STRING, "host:1")


def test_a_publisher_of_another_type_is_not_listened_to() -> None:
    reply = accept_topic_link("/c", "/t", OTHER, latching=False)
    with pytest.raises(ProtocolError, match=r"sends \[a/B/0+\], but this node expects \[std_msgs/String/992"):
        check_topic_reply(reply, STRING, "host:1")


def test_a_service_client_adds_its_own_fields() -> None:
    request = request_service_link("/s", "/me", OTHER, persistent=True, extra={"token": "x"})
    assert (request["persistent"], request["token"], "probe" in request) == ("1", "x", False)
    assert check_service_request(request, OTHER) is None
    assert "md5sums do not match" in (check_service_request(request, STRING) or "")
