"""Point clouds for the Scene tab, packed as columns."""

from __future__ import annotations

import asyncio
import json
import time
from typing import Any, Final

from pipros.msg import load_message_class
from pipros.node.any_msg import AnyMsg
from pipros.pictures.cloud_columns import cloud_columns, point_columns
from pipros.server.daemon_pool import DaemonPool
from pipros.web.scene.topic import sender_of
from pipros.web.topic_watch import Newest, TopicWatch

LEAST_POINTS: Final = 500
LONGEST_SEND_S: Final = 0.4
"""If sending a cloud takes longer than this (s), the next clouds have fewer points.

Therefore, a browser on a slow link still receives about two clouds per second.
"""
MAX_PACKINGS: Final = 4
"""Maximum number of packings of the newest cloud that are kept for further viewers."""


class CloudTopic:
    """A point cloud topic. Each cloud is packed once for all viewers that request the same points.

    For use in one event loop.
    """

    def __init__(self, watch: TopicWatch, computations: DaemonPool) -> None:
        self.watch = watch
        self._computations = computations
        self._number = -1
        self._packed: dict[tuple[tuple[str, ...], int], asyncio.Future[bytes]] = {}

    async def packed(self, newest: Newest, fields: tuple[str, ...], limit: int) -> bytes:
        """Return at most `limit` points of a message, with the given fields; see `SceneViews.cloud`."""
        if newest.number != self._number:
            self._number = newest.number
            self._packed.clear()
        key = fields, limit
        if key not in self._packed:
            if len(self._packed) >= MAX_PACKINGS:
                del self._packed[next(iter(self._packed))]
            packing = asyncio.ensure_future(
                self._computations.run(
                    _packed_cloud, self.watch, newest.message, list(fields), limit, newest.number
                )
            )
            self._packed[key] = packing
            packing.add_done_callback(lambda done: self._check(key, done))
        return await asyncio.shield(self._packed[key])

    def _check(self, key: tuple[tuple[str, ...], int], packing: asyncio.Future[bytes]) -> None:
        """Discard a failed result, so that the next request packs the cloud again."""
        if (packing.cancelled() or packing.exception()) and self._packed.get(key) is packing:
            del self._packed[key]


def fitting_points(points: int, limit: int, sent_s: float) -> int:
    """Return the maximum number of points for the next cloud, if sending `points` points took `sent_s`."""
    if sent_s > LONGEST_SEND_S:
        return min(points, max(LEAST_POINTS, int(points * LONGEST_SEND_S / sent_s)))
    return points if sent_s > LONGEST_SEND_S / 4 else min(limit, points + points // 4 + 1)


def _packed_cloud(watch: TopicWatch, message: AnyMsg, wanted: list[str], limit: int, turn: int) -> bytes:
    is_old = message.header.get("type") == "sensor_msgs/PointCloud"
    kind = "sensor_msgs/PointCloud" if is_old else "sensor_msgs/PointCloud2"
    cloud: Any = watch.decode_as(message, load_message_class(kind))
    columns = point_columns if is_old else cloud_columns
    found = columns(cloud, wanted, limit, turn)
    head = {
        "frame": cloud.header.frame_id,
        "stamp": [cloud.header.stamp.secs, cloud.header.stamp.nsecs],
        "arrival": time.time(),
        "count": found.count,
        "step": found.step,
        "problem": found.problem,
        "columns": [[column.name, column.datatype, len(column.data)] for column in found.columns],
        "from": sender_of(message),
    }
    text = json.dumps(head).encode()
    padding = b" " * (
        -(len(text) + 5) % 8
    )  # the columns begin at a multiple of 8 bytes, after the number of the view
    return b"".join([text, padding, b"\n", *(column.data for column in found.columns)])
