"""Attachments, compression, and the count of lost messages."""

from dataclasses import replace

import pytest

from pipros.basics.errors import InvalidName, LimitExceeded, ProtocolError
from pipros_fleet import keys
from pipros_fleet.messages import MessageAttachment, ReceivedMessage, compressed, decompressed, pack, unpack

FIRST = MessageAttachment(3, "0123456789abcdef", 1, 5, "992ce8a1687cec8c8bd883ec73ca41d1")


def numbered(sequence: int, instance: str = FIRST.instance) -> MessageAttachment:
    return replace(FIRST, sequence=sequence, instance=instance)


def test_an_attachment_survives_its_encoding() -> None:
    latched = replace(FIRST, is_latched=True, is_compressed=True)
    assert (unpack(pack(FIRST)), unpack(pack(latched)), len(pack(FIRST))) == (FIRST, latched, 48)


@pytest.mark.parametrize("content", [b"", b"x" * 48, pack(FIRST)[:-1], pack(FIRST) + b"x"])
def test_malformed_attachments_raise(content: bytes) -> None:
    with pytest.raises(ProtocolError, match="48 bytes and version 2"):
        unpack(content)


def test_compressed_messages_are_bounded() -> None:
    body = bytes(100_000)
    assert decompressed(compressed(body), 100_000) == body
    with pytest.raises(LimitExceeded, match="fleet_message_bytes"):
        decompressed(compressed(body), 99_999)
    with pytest.raises(ProtocolError, match="malformed"):
        decompressed(b"nonsense", 100)
    with pytest.raises(ProtocolError, match="incomplete"):
        decompressed(compressed(body)[:-4], 200_000)


def test_missing_messages_are_counted() -> None:
    received = ReceivedMessage()
    assert all(received.is_new(numbered(number), 10) for number in (5, 6, 9))
    assert (received.messages, received.bytes, received.lost) == (3, 30, 2)
    assert not received.is_new(numbered(9), 10)
    received.restart()
    assert received.is_new(numbered(20), 10)
    assert received.lost == 2


def test_a_new_run_of_the_sender_loses_nothing() -> None:
    received = ReceivedMessage()
    received.is_new(numbered(50), 1)
    assert received.is_new(numbered(1, "f" * 16), 1)
    assert received.lost == 0


def test_replayed_messages_are_neither_repeated_nor_lost() -> None:
    received = ReceivedMessage()
    assert received.is_new(numbered(3), 1)
    assert received.is_new(numbered(1), 1, is_replay=True)
    assert not received.is_new(numbered(1), 1, is_replay=True)
    assert received.is_new(numbered(4), 1)
    assert received.is_new(numbered(5), 1, is_replay=True)
    assert not received.is_new(numbered(5), 1)
    assert received.is_new(numbered(6), 1)
    assert received.lost == 0


def test_a_result_that_was_received_is_recognized_when_it_is_sent_again() -> None:
    received = ReceivedMessage(remembers=True)
    assert received.is_new(numbered(1), 1)
    assert not received.is_new(numbered(1), 1, is_replay=True)
    assert received.is_new(numbered(3), 1)
    assert received.is_new(numbered(2), 1, is_replay=True), "it was lost in between"


def test_only_the_last_thousands_of_results_are_remembered() -> None:
    received = ReceivedMessage(remembers=True)
    assert all(received.is_new(numbered(number), 1) for number in range(1, 10_001))
    assert not received.is_new(numbered(9_000), 1, is_replay=True)
    assert received.is_new(numbered(1), 1, is_replay=True)


# Keys of the fleet protocol.


@pytest.mark.parametrize(
    "name", ["/chatter", "/a/b_1/C", "/_x/9", "/with space", "/ü/*/$#?", "/@a", "/a%2Fb"]
)
def test_names_survive_a_key(name: str) -> None:
    key = keys.topic("r1", name)
    found = keys.parts(key)
    assert found is not None
    member, kind, rest = found
    assert (member, kind) == ("r1", "t")
    assert keys.unmangled("/".join(rest)) == name
    assert not set("*$#?@") & set(key)


@pytest.mark.parametrize(("members", "pattern"), [
    ("*", "*"), ("**", "*"), ("robot*", "robot$*"), ("*_a", "$*_a"), ("a/b*", "a_b$*"), ("", "_"),
    ("r1", "r1"),
])  # fmt: skip
def test_members_with_wildcards_become_patterns(members: str, pattern: str) -> None:
    assert keys.pattern_of(members) == pattern


def test_tokens_are_read_strictly() -> None:
    token = keys.live("r1", 1, "0123456789abcdef")
    assert keys.read_live(token) == ("r1", 1, "0123456789abcdef")
    for wrong in ("pipros/r1/live/1/x", "pipros/r1/live/x/0123456789abcdef", "pipros/r 1/live/1/" + "0" * 16):
        assert keys.read_live(wrong) is None
    assert keys.read_live("other/r1/live/1/0123456789abcdef") is None
    assert keys.read_live("pipros/r1/t/x") is None
    assert keys.parts("pipros") is None


@pytest.mark.parametrize(("key", "expected"), [
    (keys.directory("r1"), ("r1", "directory", [])), (keys.wanted("r1", "op"), ("r1", "wanted", ["op"])),
    (keys.into("op", "r1", "/cmd vel"), ("op", "in", ["r1", "cmd%20vel"])),
    (keys.service("r1", "op", "/arm/move"), ("r1", "s", ["op", "arm", "move"])),
    (keys.parameters("r1", "get", "op"), ("r1", "get", ["op"])),
    (keys.definition("r1", "std_msgs/String"), ("r1", "definition", ["std_msgs%2FString"])),
    (keys.statistics("r1"), ("r1", "statistics", [])),
])  # fmt: skip
def test_keys_begin_with_the_member_that_publishes_or_answers(
    key: str, expected: tuple[str, str, list[str]]
) -> None:
    assert keys.parts(key) == expected


@pytest.mark.parametrize("name", ["", "a/b", "1a", "a-b", "*", "a b", "/a"])
def test_illegal_members_raise(name: str) -> None:
    with pytest.raises(InvalidName, match="is not a legal name for a member"):
        keys.member_name(name)
    assert keys.member_name("robot_1") == "robot_1"
