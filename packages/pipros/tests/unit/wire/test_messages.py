"""Messages are complete and in order for any split of the stream, and a claimed length allocates nothing."""

import itertools
import struct
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros.basics.errors import LimitExceeded
from pipros.wire.messages import MessageReader, ReplyReader


def framed(*bodies: bytes) -> bytes:
    return b"".join(struct.pack("<I", len(body)) + body for body in bodies)


def pieces(stream: bytes, sizes: list[int]) -> Iterator[bytes]:
    """Yield pieces of the stream with the given sizes, in rotation."""
    at = 0
    for size in itertools.cycle(sizes):
        if at >= len(stream):
            return
        yield stream[at : at + size]
        at += size


def fed(buffer: MessageReader, data: bytes) -> list[bytes]:
    return [bytes(message) for message in buffer.feed(data)]


def receive(buffer: MessageReader, data: bytes) -> list[bytes]:
    """Write into the buffer's free space, like a socket."""
    messages, view = [], memoryview(data)
    while view:
        space = buffer.space()
        count = min(len(space), len(view))
        space[:count] = view[:count]
        view = view[count:]
        messages += [bytes(message) for message in buffer.received(count)]
    return messages


@given(st.lists(st.binary(max_size=300), max_size=20), st.lists(st.integers(1, 500), min_size=1))
def test_messages_survive_any_split_of_the_stream(bodies: list[bytes], cuts: list[int]) -> None:
    buffer, received = MessageReader(), []
    for piece in pieces(framed(*bodies), cuts):
        received += fed(buffer, piece)
    assert received == bodies


@given(st.lists(st.binary(max_size=300), max_size=20), st.lists(st.integers(1, 500), min_size=1))
def test_bytes_may_be_received_by_another_thread(bodies: list[bytes], cuts: list[int]) -> None:
    buffer, received = MessageReader(), []
    for number, piece in enumerate(pieces(framed(*bodies), cuts)):
        received += (fed if number % 2 else receive)(buffer, piece)
    assert received == bodies


def test_a_message_larger_than_the_first_buffer_arrives_whole() -> None:
    body = bytes(range(256)) * 4096
    assert fed(MessageReader(), framed(b"before", body, b"after")) == [b"before", body, b"after"]


def test_a_message_above_the_limit_is_refused_before_it_arrives() -> None:
    with pytest.raises(LimitExceeded, match="message of 11 bytes was announced; the limit is 10"):
        fed(MessageReader(limit_bytes=10), struct.pack("<I", 11))


def test_memory_grows_with_what_arrives_not_with_what_is_claimed() -> None:
    buffer = MessageReader()
    claim = struct.pack("<I", 1 << 29)
    buffer.space()[: len(claim)] = claim
    assert list(buffer.received(len(claim))) == []
    assert len(buffer.space()) < 1 << 17


def test_room_is_used_again() -> None:
    buffer = MessageReader()
    first = buffer.space()
    for _ in range(1000):
        data = framed(b"x" * 1000)
        buffer.space()[: len(data)] = data
        assert [bytes(message) for message in buffer.received(len(data))] == [b"x" * 1000]
    assert buffer.space().obj is first.obj


def test_the_buffer_of_a_large_message_is_released_when_small_ones_follow() -> None:
    buffer = MessageReader()
    assert len(receive(buffer, framed(bytes(4_000_000)))) == 1
    for _ in range(250):
        assert receive(buffer, framed(b"small")) == [b"small"]
    assert len(buffer.space()) <= 128 * 1024


def test_the_buffer_for_large_messages_is_kept_while_they_arrive() -> None:
    buffer = MessageReader()
    for number in range(300):
        receive(buffer, framed(bytes(1_000_000) if number % 50 == 0 else b"small"))
    assert len(buffer.space()) >= 1_000_000


def test_an_idle_link_releases_its_buffer_but_never_a_partial_message() -> None:
    buffer = MessageReader()
    receive(buffer, framed(bytes(1_000_000)))
    receive(buffer, framed(b"in two")[:6])
    buffer.trim()
    assert receive(buffer, framed(b"in two")[6:]) == [b"in two"]
    assert buffer.is_large
    buffer.trim()
    assert not buffer.is_large
    assert receive(buffer, framed(b"after")) == [b"after"]


def test_bytes_that_were_received_elsewhere_may_exceed_the_buffer() -> None:
    buffer = MessageReader(limit_bytes=1000)
    data = framed(*[bytes([number]) * 100 for number in range(200)])
    assert fed(buffer, data[:-1]) == [bytes([n]) * 100 for n in range(199)]
    assert fed(buffer, data[-1:]) == [bytes([199]) * 100]


def test_feeding_a_stream_needs_only_the_memory_of_its_largest_piece() -> None:
    buffer, piece = MessageReader(), framed(*[bytes(1000)] * 100)
    fed(buffer, piece[:50])
    for _ in range(100):
        assert len(fed(buffer, piece[50:] + piece[:50])) == 100
    assert len(buffer.space()) < 4 * len(piece)


def test_fed_messages_are_available_at_once() -> None:
    buffer = MessageReader()
    first, second = framed(b"first"), framed(b"second")
    buffer.feed(first[:3])
    assert buffer.has_partial_message
    assert fed(buffer, first[3:] + second) == [b"first", b"second"]


def replies_of(*replies: tuple[bool, bytes]) -> bytes:
    return b"".join(struct.pack("<BI", ok, len(body)) + body for ok, body in replies)


def taken(reader: ReplyReader) -> list[tuple[bool, bytes]]:
    return list(iter(reader.next_reply, None))


@given(
    st.lists(st.tuples(st.booleans(), st.binary(max_size=300)), max_size=10),
    st.lists(st.integers(1, 500), min_size=1),
)
def test_replies_survive_any_split_of_the_stream(replies: list[tuple[bool, bytes]], cuts: list[int]) -> None:
    reader, received = ReplyReader(), []
    for piece in pieces(replies_of(*replies), cuts):
        reader.feed(piece)
        received += taken(reader)
    assert received == replies


@given(st.binary(max_size=300), st.integers(0, 304))
def test_missing_bytes_is_never_more_than_a_reply_really_needs(body: bytes, arrived: int) -> None:
    reader, data = ReplyReader(), replies_of((True, body))
    reader.feed(data[:arrived])
    lacks = max(0, len(data) - arrived)
    assert (reader.next_reply() is None) == bool(lacks)
    if lacks:
        assert reader.missing_bytes == (lacks if arrived >= 5 else 5 - arrived)


def test_a_reply_above_the_limit_is_refused_before_it_arrives() -> None:
    reader = ReplyReader(limit_bytes=10)
    reader.feed(struct.pack("<BI", 1, 11))
    with pytest.raises(LimitExceeded, match="reply of 11 bytes was announced; the limit is 10"):
        reader.next_reply()


def test_a_reply_succeeds_only_if_its_first_byte_is_one() -> None:
    reader = ReplyReader()
    reader.feed(replies_of((True, b"yes"), (False, b"no")) + struct.pack("<BI", 2, 0))
    assert taken(reader) == [(True, b"yes"), (False, b"no"), (False, b"")]


def receive_whole(buffer: MessageReader, data: memoryview, max_bytes: int) -> list[memoryview | bytes]:
    """Like `receive`, at most `max_bytes` bytes at a time, and large messages as bytes."""
    messages: list[memoryview | bytes] = []
    while data:
        if buffer.has_partial_message and (whole := buffer.whole_bytes):
            count = buffer.feed_whole(bytes(data[: min(max_bytes, whole)]))
        else:
            space = buffer.space()
            count = min(len(space), len(data), max_bytes)
            space[:count] = data[:count]
        data = data[count:]
        messages += [each if isinstance(each, bytes) else bytes(each) for each in buffer.received(count)]
    return messages


@given(
    st.lists(st.sampled_from([b"", b"abc", b"x" * 140_000, bytes(300_000)]), max_size=12),
    st.integers(1000, 400_000),
)
def test_large_messages_that_are_kept_survive_any_split_of_the_stream(
    bodies: list[bytes], max_bytes: int
) -> None:
    buffer = MessageReader(keeps_large=True)
    assert receive_whole(buffer, memoryview(framed(*bodies)), max_bytes) == bodies


def test_a_large_message_after_another_is_passed_without_a_copy() -> None:
    buffer, body = MessageReader(keeps_large=True), bytes(200_000)
    receive(buffer, framed(body))
    receive(buffer, framed(body)[:4])
    assert buffer.whole_bytes == len(body)
    (message,) = buffer.received(buffer.feed_whole(body))
    assert message is body


def test_large_messages_that_follow_each_other_at_once_are_passed_without_a_copy() -> None:
    buffer = MessageReader(keeps_large=True)
    stream = memoryview(framed(*[bytes([number]) * 200_000 for number in range(5)]))
    messages = list[memoryview | bytes]()
    while stream:
        if whole := buffer.whole_bytes:
            count = buffer.feed_whole(bytes(stream[:whole]))
        else:
            count = min(len(space := buffer.space()), len(stream))
            space[:count] = stream[:count]
        stream = stream[count:]
        messages += buffer.received(count)
    assert [type(message) for message in messages] == [memoryview, bytes, bytes, bytes, bytes]
    assert messages[4] == bytes([4]) * 200_000


def test_a_message_larger_than_all_before_is_not_received_whole() -> None:
    buffer = MessageReader(keeps_large=True)
    receive(buffer, framed(bytes(200_000)))
    receive(buffer, framed(bytes(100_000_000))[:4])
    assert not buffer.whole_bytes
