"""Data for the Scene tab: serialized messages, point clouds as columns, robots, meshes, and the `.rviz` file.

The browser decodes all messages except point clouds, stores the transforms, and draws.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import time
from collections.abc import AsyncIterator, Iterator, Mapping
from concurrent.futures import Future
from typing import Any, Final

from pipros.basics import names
from pipros.basics.errors import PiprosError
from pipros.basics.limits import process_limits
from pipros.msg import load_message_class
from pipros.node.any_msg import AnyMsg
from pipros_libraries.pictures.cloud_columns import cloud_columns, point_columns
from pipros_page.limits import PageLimits
from pipros_page.scene.layout_file import SceneFile
from pipros_page.scene.topic import LONGEST_QUEUE, SceneTopic, add_senders, batch, sender_of
from pipros_page.shared import Shared
from pipros_page.topic_watch import Newest, TopicWatch
from pipros_page.views.scene_robots import RobotDescriptions
from pipros_page.views.topics import topic_name
from pipros_page.watched_system import WatchedSystem
from pipros_server.act_gate import GatedPublisher
from pipros_server.daemon_pool import DaemonPool
from pipros_server.view_server import RequestRefused
from pipros_tools.graph import params
from pipros_tools.graph.message_from_yaml import message_from_yaml

SEND_INTERVAL_S: Final = 0.033
CLOUD_INTERVAL_S: Final = 0.1
POLL_INTERVAL_S: Final = 1.0
MAX_FEEDBACK_TOPICS: Final = 100
FEEDBACK_QUEUE: Final = 100
MAX_POINTS: Final = 2_000_000
MAX_FIELDS: Final = 8
LARGE_BYTES: Final = 256_000
"""Batches above this size are compressed for browsers that are not on loopback."""
_TF_TOPICS: Final = ("/tf", "/tf_static")
_TF_HISTORY_S: Final = 10.0


class SceneViews:
    """The views and actions of the Scene tab."""

    def __init__(self, system: WatchedSystem, file: SceneFile | None = None) -> None:
        self._system = system
        self._file = file or SceneFile()
        self._topics: dict[str, Shared[SceneTopic]] = {}
        self._clouds: dict[str, Shared[CloudTopic]] = {}
        self._robots = RobotDescriptions(system)
        self._feedback: dict[str, Future[GatedPublisher]] = {}

    async def config(self, _: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the configuration, now and whenever a file is loaded."""
        version = -1
        while True:
            if version != self._file.version:
                version = self._file.version
                yield {
                    "config": self._file.config,
                    "path": str(self._file.path or ""),
                    "fixed_frame": self._file.fixed_frame,
                    "version": version,
                    "simulated": await self._system.questions.run(self._is_simulated),
                }
            await asyncio.sleep(POLL_INTERVAL_S / 2)

    async def save(self, arguments: Mapping[str, object]) -> Any:
        """Write the file that the scene was loaded from."""
        try:
            return str(await self._system.computations.run(self._file.save, arguments.get("config")))
        except OSError as error:
            raise RequestRefused(f"cannot write {self._file.path}: {error.strerror}") from None

    async def feedback(self, arguments: Mapping[str, object]) -> Any:
        """Publish feedback on an interactive marker; without feedback, only advertise the topic.

        The publishers stay open until the server stops, so that the feedback of one drag stays complete and
        in order.
        """
        name, value = topic_name(arguments), arguments.get("feedback")
        if not isinstance(value, (dict, type(None))):
            raise RequestRefused(f"feedback must be an object with the message's fields, got {value!r:.100}")
        message_class = load_message_class("visualization_msgs/InteractiveMarkerFeedback")
        if name not in self._feedback:
            if len(self._feedback) >= MAX_FEEDBACK_TOPICS:
                raise RequestRefused(f"feedback can be published to at most {MAX_FEEDBACK_TOPICS} topics")
            self._feedback[name] = self._system.questions.start(
                self._system.gate.advertise, name, message_class, queue_size=FEEDBACK_QUEUE
            )
        advertising = self._feedback[name]
        try:
            publisher = await asyncio.shield(asyncio.wrap_future(advertising))
        except PiprosError:
            self._feedback.pop(name, None)
            raise
        if value is None:
            return None
        client = f"{self._system.node.name}/{value.get('client_id', '')}"
        publisher.publish(message_from_yaml(message_class, {**value, "client_id": client}, 0))
        return None

    async def messages(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the layout of a topic's type as JSON, then batches of its serialized messages, oldest first.

        A batch consists of one byte (1 if the rest is zlib-compressed), followed for each message by its
        arrival time (f64, s), size (u32), sender number (u16) and data. A JSON list of senders, numbered from
        1, precedes the first batch that refers to a new sender; sender 0 is unknown. If the browser is slow,
        the oldest messages are dropped, and their total number (`lost`) is yielded as JSON. If `queue`
        is 1, the browser receives only the newest message.
        """
        name = topic_name(arguments)
        queue = _number(arguments, "queue", 10, LONGEST_QUEUE)
        with self._shared(name).use() as topic, topic.queued(queue) as pending:
            layout: Mapping[str, Any] | None = None
            senders: dict[str, int] = {}
            lost = 0
            while True:
                messages, dropped = pending.pop_all()
                if layout != topic.layout:  # after `pop_all`, because `add` sets it before it queues
                    layout = topic.layout
                    yield {"layout": layout}
                lost += dropped
                if dropped:
                    yield {"lost": lost}
                if messages:
                    if add_senders(senders, messages):
                        yield {"senders": list(senders)}
                    yield await self._packed(messages, senders, is_compressed=bool(arguments.get("deflate")))
                await asyncio.sleep(SEND_INTERVAL_S)

    async def cloud(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield a topic's newest `PointCloud2` or `PointCloud`: a JSON header, a newline, and columns.

        A cloud has at most `limit` points, and fewer on a slow link.
        """
        name = topic_name(arguments)
        limit = _number(arguments, "limit", 200_000, MAX_POINTS)
        wanted = arguments.get("fields", [])
        if not isinstance(wanted, list) or len(wanted) > MAX_FIELDS:
            raise RequestRefused(f"fields must be a list of at most {MAX_FIELDS} names")
        fields = tuple(map(str, wanted))
        with self._shared_clouds(name).use() as clouds:
            number = -1
            points = limit
            due_s = 0.0
            while True:
                newest = clouds.watch.newest
                if newest is not None and newest.number != number and time.monotonic() >= due_s:
                    number = newest.number
                    due_s = max(due_s + CLOUD_INTERVAL_S, time.monotonic())
                    packed = await clouds.packed(newest, fields, points)
                    begin_s = time.monotonic()
                    yield packed  # execution resumes when the connection has accepted most of the cloud
                    points = fitting_points(points, limit, time.monotonic() - begin_s)
                await asyncio.sleep(SEND_INTERVAL_S)

    async def robot(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield errors until the robot description can be read; then yield its links and shapes once."""
        name = arguments.get("name", "")
        if not isinstance(name, str) or not names.is_legal(name):
            raise RequestRefused(f"name must be a parameter name, got {name!r:.100}")
        shown: Any = None
        while True:
            try:
                text = await self._system.questions.run(self._robots.text, name)
                found = await self._system.computations.run(self._robots.shapes, name, text)
            except PiprosError as error:
                found = {"error": str(error)}
            if found != shown:
                shown = found
                yield found
            if "links" in found:
                return
            await asyncio.sleep(POLL_INTERVAL_S)

    async def resource(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the content of a mesh or texture, once."""
        uri = arguments.get("uri")
        if not isinstance(uri, str) or len(uri) > 2000:
            raise RequestRefused("uri must be a string of at most 2000 characters")
        try:
            yield await self._system.computations.run(self._robots.read, uri)
        except PiprosError as error:
            raise RequestRefused(str(error)) from None

    def _is_simulated(self) -> bool:
        try:
            return bool(params.read(self._system.graph.master, "/use_sim_time"))
        except PiprosError:
            return False

    def _shared(self, name: str) -> Shared[SceneTopic]:
        if name not in self._topics:
            if len(self._topics) >= process_limits().of(PageLimits).page_topics:
                self._topics.clear()  # topics that browsers are showing stay open for these browsers
            self._topics[name] = Shared(lambda: self._open(name))
        return self._topics[name]

    @contextlib.contextmanager
    def _open(self, name: str) -> Iterator[SceneTopic]:
        with self._system.topics.watch(name) as watch:
            topic = SceneTopic(watch, _TF_HISTORY_S if name in _TF_TOPICS else 0.0)
            with watch.listening(topic.add, from_newest=True):
                yield topic

    def _shared_clouds(self, name: str) -> Shared[CloudTopic]:
        if name not in self._clouds:
            if len(self._clouds) >= process_limits().of(PageLimits).page_topics:
                self._clouds.clear()
            self._clouds[name] = Shared(lambda: self._open_clouds(name))
        return self._clouds[name]

    @contextlib.contextmanager
    def _open_clouds(self, name: str) -> Iterator[CloudTopic]:
        with self._system.topics.watch(name, queue_size=2) as watch:
            yield CloudTopic(watch, self._system.computations)

    async def _packed(
        self, messages: list[tuple[AnyMsg, float]], senders: Mapping[str, int], *, is_compressed: bool
    ) -> bytes:
        size = sum(len(message.body) for message, _ in messages)
        if size <= LARGE_BYTES:
            return batch(messages, senders, is_compressed=False)
        return await self._system.computations.run(
            lambda: batch(messages, senders, is_compressed=is_compressed)
        )


def _number(arguments: Mapping[str, object], key: str, default: int, limit: int) -> int:
    value = arguments.get(key, default)
    if not isinstance(value, int) or not 1 <= value <= limit:
        raise RequestRefused(f"{key} must be an integer from 1 to {limit}, got {value!r:.100}")
    return value


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
