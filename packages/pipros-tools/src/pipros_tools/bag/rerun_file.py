"""Write a bag's messages as a rerun recording (`.rrd`), with rerun's library.

Images, point clouds, scans, transforms, paths, log messages and strings become the corresponding rerun types.
The numbers in all other messages become curves, at most `CURVES` per topic. There are two timelines: the
times of receipt, and the stamps in the headers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import Any, Final

from pipros.basics.errors import MissingExtra
from pipros.basics.windows import replace_file
from pipros.msg.time import NS_PER_S, TVal
from pipros_libraries.pictures.cloud_columns import cloud_columns
from pipros_libraries.pictures.errors import PictureError
from pipros_libraries.pictures.image_message import image_png
from pipros_tools.bag.connection import Connection
from pipros_tools.bag.reader import BagReader

CURVES: Final = 64
POINTS: Final = 1_000_000


@contextmanager
def rerun_file(path: Path, bag: BagReader) -> Iterator[RerunSink]:
    """Context manager that provides a sink for a bag's messages. The file is complete after the block.

    If the block raises an exception, `path` stays unchanged.

    Raises:
        MissingExtra: rerun's library is not installed.
    """
    try:
        rerun: Any = import_module("rerun")
    except ImportError as error:
        what = f"{path} needs {error.name or error}, which is not installed. Try: pip install rerun-sdk"
        raise MissingExtra(what, name="rerun") from error
    part = path.with_name(f".{path.name}.part")
    recording = rerun.RecordingStream("pipros", recording_id=path.stem)
    try:
        recording.save(str(part))
        yield RerunSink(rerun, recording, bag)
        recording.flush()
        recording.disconnect()
        replace_file(part, path)
    finally:
        part.unlink(missing_ok=True)


class RerunSink:
    """Sink that adds messages to a recording. Malformed images and point clouds are skipped."""

    def __init__(self, rerun: Any, recording: Any, bag: BagReader) -> None:
        self._rerun = rerun
        self._bag = bag
        self._recording = recording
        self._classes: list[Any] = []
        self._kinds: Mapping[str, Callable[[Any], Any]] = {
            "sensor_msgs/Image": lambda message: rerun.EncodedImage(
                contents=image_png(message), media_type="image/png"
            ),
            "sensor_msgs/CompressedImage": lambda message: rerun.EncodedImage(
                contents=bytes(message.data),
                media_type="image/png" if bytes(message.data[:4]) == b"\x89PNG" else "image/jpeg",
            ),
            "sensor_msgs/PointCloud2": lambda message: rerun.Points3D(_cloud(message)),
            "sensor_msgs/LaserScan": lambda message: rerun.Points3D(_scan(message)),
            "nav_msgs/Path": lambda message: rerun.LineStrips3D(
                [[_triple(each.pose.position) for each in message.poses]]
            ),
            "rosgraph_msgs/Log": lambda message: rerun.TextLog(f"{message.name}: {message.msg}"),
            "std_msgs/String": lambda message: rerun.TextLog(message.data),
        }

    def add_connection(self, topic: str, header: Mapping[str, bytes]) -> Connection:
        """Add a connection. Raise `BagError` if the definition is invalid."""
        connection = Connection(len(self._classes), topic, header)
        self._classes.append(self._bag.class_of(connection))
        return connection

    def write(self, connection: Connection, seconds: int, nanoseconds: int, data: bytes) -> None:
        """Add a message. Raise `DeserializationError` if the message does not match its definition."""
        message = self._classes[connection.id]._from_bytes(data)
        self._set_time("receipt", seconds, nanoseconds)
        if message._has_header:
            self._set_time("header", message.header.stamp.secs, message.header.stamp.nsecs)
        if connection.type in ("tf2_msgs/TFMessage", "tf/tfMessage"):
            for each in message.transforms:
                self._log(f"tf/{each.child_frame_id.strip('/')}", self._transform(each))
            return
        kind = self._kinds.get(connection.type)
        try:
            if kind is not None:
                self._log(connection.topic, kind(message))
                return
        except PictureError:
            return
        for path, value in islice(_numbers(message, connection.topic.strip("/")), CURVES):
            self._log(path, self._rerun.Scalars(value))

    def finish(self) -> None:
        """Do nothing: `rerun_file` ends the recording."""

    def _set_time(self, timeline: str, seconds: int, nanoseconds: int) -> None:
        self._recording.set_time(timeline, timestamp=seconds + nanoseconds / NS_PER_S)

    def _log(self, path: str, found: Any) -> None:
        self._recording.log(path.strip("/"), found)

    def _transform(self, message: Any) -> Any:
        turn = message.transform.rotation
        return self._rerun.Transform3D(
            translation=_triple(message.transform.translation),
            quaternion=(turn.x, turn.y, turn.z, turn.w),
            parent_frame=message.header.frame_id.strip("/"),
            child_frame=message.child_frame_id.strip("/"),
        )


def _triple(point: Any) -> tuple[float, float, float]:
    return point.x, point.y, point.z


def _cloud(message: Any) -> list[tuple[float, ...]]:
    found = cloud_columns(message, (), POINTS)
    if found.problem:
        raise PictureError(found.problem)
    return list(zip(*(memoryview(each.data).cast("f") for each in found.columns), strict=True))


def _scan(message: Any) -> list[tuple[float, float, float]]:
    angles = (message.angle_min + n * message.angle_increment for n in range(len(message.ranges)))
    return [
        (distance * math.cos(angle), distance * math.sin(angle), 0.0)
        for distance, angle in zip(message.ranges, angles, strict=True)
        if message.range_min <= distance <= message.range_max
    ]


def _numbers(value: Any, path: str) -> Iterator[tuple[str, float]]:
    """Yield the path and value of each number in a message.

    Times, durations, headers, strings and byte arrays are skipped, and so are all but the first `CURVES`
    elements of an array.
    """
    if isinstance(value, bool | int | float):
        yield path, float(value)
    elif isinstance(value, TVal) or path.endswith("/header"):
        return
    elif hasattr(value, "_slot_types"):
        for name in value.__slots__:
            yield from _numbers(getattr(value, name), f"{path}/{name}")
    elif not isinstance(value, str | bytes):
        for number, each in enumerate(islice(value, CURVES)):
            yield from _numbers(each, f"{path}/{number}")
