"""What a view that opens later receives of a topic that others already watch."""

from __future__ import annotations

from pipros.basics.limits import Limits
from pipros.node.any_msg import AnyMsg
from pipros_page.topic_watch import TopicWatch
from pipros_tools.graph.raw_decoder import RawDecoder


def message(body: bytes, sender: str, *, latching: bool) -> AnyMsg:
    made = AnyMsg(body)
    made._connection_header = {"callerid": sender, "latching": "1" if latching else "0"}
    return made


def received(watch: TopicWatch, *, from_newest: bool = True) -> list[bytes]:
    found: list[bytes] = []
    with watch.listening(lambda each, _: found.append(each.body), from_newest=from_newest):
        pass
    return found


def test_a_later_listener_gets_the_newest_message_of_each_latching_publisher() -> None:
    watch = TopicWatch("/tf_static", RawDecoder())
    for body, sender in ((b"a1", "/a"), (b"b1", "/b"), (b"a2", "/a")):
        watch.note(message(body, sender, latching=True))
    assert (received(watch), received(watch, from_newest=False)) == ([b"b1", b"a2"], [])
    watch.note(message(b"c", "/c", latching=False))
    assert received(watch) == [b"b1", b"a2", b"c"]


def test_latched_messages_beyond_the_limit_are_dropped_oldest_first() -> None:
    watch = TopicWatch("/map", RawDecoder(), limits=Limits.parse("page_message_bytes=100"))
    for number in range(4):
        watch.note(message(b"%d" % number * 40, f"/map{number}", latching=True))
    assert [body[:1] for body in received(watch)] == [b"2", b"3"]
