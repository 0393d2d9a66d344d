"""The threads that send messages over a link."""

import threading
from collections.abc import Iterator
from typing import Any

import pytest

from pipros.basics.limits import process_limits
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_fleet.directory import DirectoryEntry
from pipros_fleet.fleet_rules import FleetRule, Priority
from pipros_fleet.frames import MAX_FRAMES, TF_TYPE, FrameChange, frame_change
from pipros_fleet.outbox import QUEUE
from pipros_fleet.sources import Sender, SentTopic, SourceMessage
from tests.support.waiting import wait_until

DEADLINE_S = 60


class FakeLink:
    """Link that records the messages. Keys in `full` block until `has_room` is set."""

    is_connected = True

    def __init__(self) -> None:
        self.sent: list[tuple[str, int, threading.Thread]] = []
        self.full: set[str] = set()
        self.waits = threading.Event()
        self.has_room = threading.Event()

    def put(
        self, key: str, payload: bytes, attachment: bytes = b"", priority: Priority = Priority.NORMAL
    ) -> None:
        del attachment, priority
        if key in self.full:
            self.waits.set()
            self.has_room.wait(DEADLINE_S)
        self.sent.append((key, len(payload), threading.current_thread()))


@pytest.fixture
def link() -> FakeLink:
    return FakeLink()


@pytest.fixture
def sender(link: FakeLink) -> Iterator[Sender]:
    sender = Sender(link, "00" * 8, process_limits())
    yield sender
    link.has_room.set()
    sender.close()


def source(sender: Sender, key: str, **rule: bool) -> SentTopic:
    found = SentTopic(
        Node("unused"), sender, DirectoryEntry(f"/{key}", "std_msgs/String", "0" * 32), key,
        FleetRule("/**", **rule),
    )  # fmt: skip
    sender.add(found)
    return found


@pytest.mark.parametrize("size", [1, 1_000_000])
def test_the_receiving_thread_sends_if_nothing_is_queued(link: FakeLink, sender: Sender, size: int) -> None:
    sender.offer(SourceMessage(source(sender, "a"), 0, bytes(size), is_latched=False))
    assert link.sent == [("a", size, threading.current_thread())]


def test_compressed_messages_are_left_to_the_thread(link: FakeLink, sender: Sender) -> None:
    sender.offer(SourceMessage(source(sender, "a", is_compressed=True), 0, b"", is_latched=False))
    wait_until(lambda: link.sent, DEADLINE_S, "the message")
    assert link.sent[0][2] is not threading.current_thread()


def test_a_topic_waiting_for_the_link_blocks_no_other(link: FakeLink, sender: Sender) -> None:
    link.full.add("images")
    images, commands = source(sender, "images"), source(sender, "commands")
    blocked = threading.Thread(
        target=sender.offer, args=(SourceMessage(images, 0, b"image", is_latched=False),), daemon=True
    )
    blocked.start()
    assert link.waits.wait(DEADLINE_S)
    sender.offer(SourceMessage(commands, 0, b"stop", is_latched=False))
    assert [key for key, _, _ in link.sent] == ["commands"]
    link.has_room.set()
    blocked.join(DEADLINE_S)
    assert [key for key, _, _ in link.sent] == ["commands", "images"]


def test_a_publisher_waits_for_its_earlier_messages_so_that_none_is_dropped(
    link: FakeLink, sender: Sender, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pipros_fleet.sources.CATCH_UP_S", DEADLINE_S)
    monkeypatch.setattr("pipros_fleet.sources.FULL_AFTER_S", DEADLINE_S)
    link.full.add("images")
    images = source(sender, "images")
    for _ in range(QUEUE):
        sender.outbox.push("images", SourceMessage(images, 0, b"image", is_latched=False), 5)
    sender.offer(SourceMessage(source(sender, "other", is_compressed=True), 0, b"", is_latched=False))
    assert link.waits.wait(DEADLINE_S)
    link.has_room.set()
    for _ in range(2 * QUEUE):
        sender.offer(SourceMessage(images, 0, b"image", is_latched=False))
    assert sender.dropped("images") == 0
    assert len([key for key, _, _ in link.sent if key == "images"]) == 3 * QUEUE


# Changes to transforms that are sent to other members.


TFMessage: Any = load_message_class(TF_TYPE)
TransformStamped: Any = load_message_class("geometry_msgs/TransformStamped")
PREFIXED = FleetRule("/**", has_prefixed_frames=True)


def body(*frames: tuple[str, str]) -> bytes:
    message = TFMessage()
    for parent, child in frames:
        transform = TransformStamped(child_frame_id=child)
        transform.header.frame_id = parent
        message.transforms.append(transform)
    return b"".join(message._to_buffers())


def frames_in(content: bytes) -> list[tuple[str, str]]:
    return [(each.header.frame_id, each.child_frame_id) for each in TFMessage._from_bytes(content).transforms]


def change_of(name: str, rule: FleetRule) -> FrameChange:
    change = frame_change(DirectoryEntry(name, TF_TYPE, "0" * 32), rule, "robot1")
    assert change is not None
    return change


def test_other_topics_are_not_changed() -> None:
    assert frame_change(DirectoryEntry("/tf_static", "std_msgs/String", "0" * 32), PREFIXED, "robot1") is None
    assert frame_change(DirectoryEntry("/tf", TF_TYPE, "0" * 32), FleetRule("/**"), "robot1") is None


def test_frames_get_the_members_name() -> None:
    change = change_of("/tf", PREFIXED)
    assert frames_in(change(body(("/odom", "base")))) == [("robot1/odom", "robot1/base")]
    assert frames_in(change(body(("odom", "laser")))) == [("robot1/odom", "robot1/laser")]


def test_static_transforms_of_all_publishers_are_merged() -> None:
    change = change_of("/tf_static", FleetRule("/**"))
    change(body(("base", "laser"), ("base", "camera")))
    assert sorted(frames_in(change(body(("mast", "camera"))))) == [("base", "laser"), ("mast", "camera")]


def test_malformed_messages_are_passed_on() -> None:
    assert change_of("/tf", PREFIXED)(b"\xff") == b"\xff"


def test_beyond_the_limit_known_frames_are_still_updated() -> None:
    change = change_of("/tf_static", FleetRule("/**"))
    change(body(*(("base", str(number)) for number in range(MAX_FRAMES))))
    found = frames_in(change(body(("mast", "0"), ("base", "new"))))
    assert len(found) == MAX_FRAMES
    assert ("mast", "0") in found
