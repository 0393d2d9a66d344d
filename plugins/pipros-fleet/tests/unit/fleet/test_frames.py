"""Changes to transforms that are sent to other members."""

from __future__ import annotations

from typing import Any

from pipros.msg import load_message_class
from pipros_fleet.directory import DirectoryEntry
from pipros_fleet.fleet_rules import FleetRule
from pipros_fleet.frames import MAX_FRAMES, TF_TYPE, FrameChange, frame_change

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
