"""Modify the transforms that a member sends: prefix their frame ids, and merge static transforms."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros.node.codec import encoder
from pipros_fleet.directory import DirectoryEntry
from pipros_fleet.fleet_rules import FleetRule

FrameChange = Callable[[bytes], bytes]
"""Function that converts the serialized body of a message to the body to send."""

TF_TYPE: Final = "tf2_msgs/TFMessage"
TF_TYPES: Final = (TF_TYPE, "tf/tfMessage")
STATIC_TOPIC: Final = "/tf_static"
MAX_FRAMES: Final = 10_000
"""Maximum number of static transforms per member. Beyond it, only known frames are updated."""


def frame_change(entry: DirectoryEntry, rule: FleetRule, member: str) -> FrameChange | None:
    """Return the function that changes a topic's messages, or None if the messages are sent unchanged."""
    if entry.type not in TF_TYPES:
        return None
    merges = entry.name == STATIC_TOPIC
    if not merges and not rule.has_prefixed_frames:
        return None
    return _Change(f"{member}/" if rule.has_prefixed_frames else "", merges=merges)


class _Change:
    """Prefixes frame ids, merges the static transforms of all publishers into one message, or does both."""

    def __init__(self, prefix: str, *, merges: bool) -> None:
        self._prefix = prefix
        self._class: Any = load_message_class(TF_TYPE)  # tf/tfMessage has the same layout
        self._encode = encoder(self._class)
        self._merged: dict[str, Any] | None = {} if merges else None

    def __call__(self, body: bytes) -> bytes:
        try:
            message = self._class._from_bytes(body)
        except (PiprosError, ValueError):
            return body
        for transform in message.transforms:
            transform.header.frame_id = self._prefixed(transform.header.frame_id)
            transform.child_frame_id = self._prefixed(transform.child_frame_id)
            child = transform.child_frame_id
            if self._merged is not None and (child in self._merged or len(self._merged) < MAX_FRAMES):
                self._merged[child] = transform
        if self._merged is not None:
            message.transforms = list(self._merged.values())
        return b"".join(self._encode(message))

    def _prefixed(self, frame: str) -> str:
        return self._prefix + frame.lstrip("/") if self._prefix else frame
