"""Tools for coordinate frames."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros_assistants.answer import Answer, ToolRefused
from pipros_assistants.robot import (
    ASSISTANT_SAMPLE_BYTES,
    MessageSamples,
    RobotAccess,
    SampledMessage,
    decoded,
)
from pipros_assistants.tools.arguments import Cursor, Name, Wait
from pipros_libraries.transforms.buffer import TransformBuffer
from pipros_libraries.transforms.messages import in_ns, pose_of_transform

TOPICS: Final = ("/tf", "/tf_static")
_NS: Final = 1e9


class FrameTools:
    """Tools for coordinate frames."""

    def __init__(self, robot: RobotAccess) -> None:
        self._robot = robot

    def list_frames(self, wait_s: Wait = 2.0, cursor: Cursor = 0) -> Answer:
        """List the coordinate frames that are published during the wait, with parent, publisher and rate."""
        buffer = self._buffer(self._robot.sample(TOPICS, wait_s))
        rows = [
            {"frame": child, "parent": parent, "publisher": sender, "rate_hz": round(rate, 2)}
            for parent, child, sender, rate in sorted(buffer.edges(), key=lambda edge: edge[1])
        ]
        return Answer(
            rows,
            "The rate is meaningless for static frames and for frames with a single message.",
            {"frames": len(rows)},
        )

    def find_transform(self, target: Name, source: Name, wait_s: Wait = 2.0) -> Answer:
        """Find the pose of the frame source in the frame target: position in metres, quaternion x, y, z, w,
        and the age of the transform."""
        samples = self._robot.sample(TOPICS, wait_s)
        buffer = self._buffer(samples)
        frame, origin = target.lstrip("/"), source.lstrip("/")
        try:
            if frame == origin and not buffer.frame_exists(frame):  # for which lookup returns the identity
                raise PiprosError(f"the frame {frame} does not exist")
            time_ns, pose = buffer.lookup(frame, origin, 0)
        except PiprosError as error:
            known = ", ".join(sorted(buffer.frame_names())[:50])
            raise ToolRefused(
                "this transform is unknown; data has the reason and the known frames",
                [str(error), known],
            ) from None
        age_s = samples.now_s - time_ns / _NS if time_ns else None
        return Answer(
            [{"target": target, "source": source, "position_m": pose[:3], "quaternion_xyzw": pose[3:]}],
            "" if time_ns else "All transforms between these frames are static.",
            {"age_s": None if age_s is None else round(age_s, 3)},
        )

    def _buffer(self, samples: MessageSamples) -> TransformBuffer:
        buffer = TransformBuffer(limit_bytes=ASSISTANT_SAMPLE_BYTES)
        for received, message in decoded(samples.received):
            for each in getattr(message, "transforms", ()):
                _insert(buffer, received, each)
        return buffer


def _insert(buffer: TransformBuffer, received: SampledMessage, stamped: Any) -> Sequence[str]:
    return buffer.insert(
        stamped.header.frame_id[:300],
        stamped.child_frame_id[:300],
        in_ns(stamped.header.stamp),
        pose_of_transform(stamped.transform),
        received.raw.header.get("callerid", "")[:300],
        received.topic == "/tf_static",
    )
