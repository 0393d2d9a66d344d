"""Transforms as columns: the pose of one frame relative to another at the time of each row."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np

from pipros.basics.printable import listed
from pipros.msg.time import NS_PER_S
from pipros_data.table import Table
from pipros_libraries.transforms.buffer import TransformBuffer
from pipros_libraries.transforms.errors import TransformException
from pipros_libraries.transforms.messages import in_ns, pose_of_transform
from pipros_tools.bag.merge import merged

if TYPE_CHECKING:
    from pipros_tools.bag.reader import BagMessage, BagReader

_TYPES = ("tf2_msgs/TFMessage", "tf/tfMessage")
PARTS = ("x", "y", "z", "qx", "qy", "qz", "qw")


def with_transform(
    table: Table,
    readers: Sequence[BagReader],
    target: str,
    source: str,
    *,
    on: str = "header",
    gap: float = 10.0,
    prefix: str | None = None,
    tf: str = "/tf",
    tf_static: str = "/tf_static",
) -> Table:
    """Return the table with the pose of `source` relative to `target` at the time of each row.

    The columns are `x`, `y`, `z` (m) and the quaternion `qx`, `qy`, `qz`, `qw`. Poses are interpolated as in
    tf2, and never extrapolated. Rows without a transform are gaps. If all rows are gaps, unknown frames
    cause a warning.

    Args:
        readers: the bags with the transforms.
        on: the times of the rows: `header` for the stamps of the headers, or `receipt`.
        gap: poses are interpolated over pauses of up to this many seconds between transforms, and never over
            pauses of more than twice this time. Transforms are read up to this long after each row, and kept
            for twice this time.
        prefix: added to the names of the columns; by default, `source` and a dot.
        tf, tf_static: the topics of the transforms. Static transforms apply from the start.

    Raises:
        ValueError: `gap` is not positive, `on` is unknown, messages have no header, or a column already
            exists.
    """
    if not gap > 0:
        raise ValueError(f"gap must be > 0, got {gap}")
    ahead = round(gap * NS_PER_S)
    times = table.times(on)
    buffer = TransformBuffer(2 * ahead)
    for static in _messages(readers, tf_static):
        _insert(buffer, static, is_static=True)
    poses = np.zeros((len(times), len(PARTS)))
    is_gap = np.ones(len(times), np.bool_)
    waiting = _messages(readers, tf)
    received = next(waiting, None)
    target, source = target.lstrip("/"), source.lstrip("/")
    for row in np.argsort(times, kind="stable").tolist():
        time = int(times[row])
        while received is not None and received.time.to_nsec() <= time + ahead:
            _insert(buffer, received, is_static=False)
            received = next(waiting, None)
        if time > 0:  # for 0, tf2 would return the latest transform
            with suppress(TransformException):
                poses[row], is_gap[row] = buffer.lookup(target, source, time)[1], False
    names = buffer.frame_names()
    for unknown in sorted({target, source}.difference(names)) if is_gap.all() and len(times) else ():
        warnings.warn(f"unknown frame {unknown!r}; known: {', '.join(map(listed, names))}", stacklevel=3)
    prefix = f"{source}." if prefix is None else prefix
    columns = {f"{prefix}{part}": np.ascontiguousarray(poses[:, n]) for n, part in enumerate(PARTS)}
    return table.with_columns(columns, dict.fromkeys(columns, is_gap))


def _messages(readers: Sequence[BagReader], topic: str) -> Iterator[BagMessage]:
    return merged(readers, lambda each: each.topic == topic and each.type in _TYPES)


def _insert(buffer: TransformBuffer, received: BagMessage, *, is_static: bool) -> None:
    for each in received.message.transforms:
        names, stamp = (each.header.frame_id, each.child_frame_id), in_ns(each.header.stamp)
        buffer.insert(*names, stamp, pose_of_transform(each.transform), "", is_static)
