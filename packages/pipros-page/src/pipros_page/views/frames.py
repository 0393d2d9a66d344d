"""Tree of coordinate frames: `rqt_tf_tree`."""

from __future__ import annotations

import asyncio
import contextlib
import math
import threading
from collections import deque
from collections.abc import AsyncIterator, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

from pipros.msg.time import NS_PER_S
from pipros.node.any_msg import AnyMsg
from pipros_libraries.transforms.buffer import TransformBuffer
from pipros_libraries.transforms.errors import TransformException
from pipros_libraries.transforms.messages import in_ns, pose_of_transform
from pipros_libraries.transforms.pose import roll_pitch_yaw
from pipros_page.bounded_list import PAGE_VIEW_BYTES
from pipros_page.messages.known_topic import LONGEST_NAME, KnownTopic, Take
from pipros_page.stale import is_stale
from pipros_page.views.graph_values import scene_values
from pipros_page.watched_system import WatchedSystem
from pipros_server.view_server import RequestRefused
from pipros_tools.graph.drawing.node_graph import Arrow, Key, NodeGraph, Vertex
from pipros_tools.graph.drawing.scene import draw

SEND_INTERVAL_S = 1.0
POSE_INTERVAL_S = 0.2
MAX_FRAMES = 2000
MAX_LINKS = 50
"""Maximum number of links in a chain that is sent."""
LONGEST_ERROR = 500
MAX_ARRIVALS = 50
"""Number of arrivals from which a frame's rate is computed."""


@dataclass(slots=True)
class Frame:
    """State of a frame.

    Attributes:
        parent: parent frame in the last transform.
        authority: node that published the last transform.
        is_static: whether the last transform was published on `/tf_static`.
        arrivals: wall times of arrival of the newest transforms.
        delay_s: time from the last transform's timestamp to its arrival; None if the timestamp is 0.
    """

    parent: str
    authority: str
    is_static: bool
    arrivals: deque[float]
    delay_s: float | None

    @property
    def last_s(self) -> float:
        return self.arrivals[-1]

    @property
    def interval_s(self) -> float | None:
        """The mean time between the newest transforms; None if it is unknown."""
        span_s = self.last_s - self.arrivals[0]
        return span_s / (len(self.arrivals) - 1) if span_s > 0 else None

    def is_stale(self, now_s: float) -> bool:
        """Return whether transforms that arrived regularly have stopped."""
        return not self.is_static and is_stale(now_s - self.last_s, self.interval_s)


class FrameTree:
    """All frames received so far. Transforms are added by the threads that receive them.

    Attributes:
        buffer: the transforms of the last seconds.
    """

    def __init__(self) -> None:
        self.buffer = TransformBuffer(limit_bytes=PAGE_VIEW_BYTES)
        self._frames: dict[str, Frame] = {}
        self._lock = threading.Lock()
        self._clock_s: float | None = None

    def set_clock(self, clock_s: float) -> None:
        """Set the simulated time, which is used to measure delays. If it jumps back, clear `buffer`."""
        if self._clock_s is not None and clock_s < self._clock_s:
            self.buffer.clear()
        self._clock_s = clock_s

    def add(self, message: Any, wall_s: float, authority: str, *, is_static: bool) -> None:
        """Add the transforms of a `tf2_msgs/TFMessage`. Long names are truncated."""
        authority = authority[:LONGEST_NAME]
        now_s = wall_s if self._clock_s is None else self._clock_s
        with self._lock:
            for transform in message.transforms:
                self.buffer.insert(
                    transform.header.frame_id[:LONGEST_NAME],
                    transform.child_frame_id[:LONGEST_NAME],
                    in_ns(transform.header.stamp),
                    pose_of_transform(transform.transform),
                    authority,
                    is_static,
                )
                child = transform.child_frame_id.lstrip("/")[:LONGEST_NAME]
                known = self._frames.get(child)
                parent = transform.header.frame_id.lstrip("/")[:LONGEST_NAME]
                stamp_s = transform.header.stamp.to_sec()
                delay_s = now_s - stamp_s if stamp_s else None
                if known is None or known.parent != parent:
                    if known is None and len(self._frames) >= MAX_FRAMES:
                        continue
                    arrivals = deque([wall_s], MAX_ARRIVALS)
                    self._frames[child] = Frame(parent, authority, is_static, arrivals, delay_s)
                    continue
                known.arrivals.append(wall_s)
                known.authority, known.is_static, known.delay_s = authority, is_static, delay_s

    def rows(self, now_s: float) -> list[Mapping[str, Any]]:
        """Return the state of each frame, sorted by name. Rates are in Hz, ages and delays in seconds.

        A stale frame has neither rate nor delay. In simulated time, which can pause, no frame is stale.
        """
        stale = self.stale(now_s)
        with self._lock:
            return [
                {
                    "frame": child,
                    "parent": frame.parent,
                    "authority": frame.authority,
                    "static": frame.is_static,
                    "stale": child in stale,
                    "rate": 1 / frame.interval_s if frame.interval_s and child not in stale else None,
                    "age": round(now_s - frame.last_s, 2),
                    "delay": None if frame.delay_s is None or child in stale else round(frame.delay_s, 3),
                }
                for child, frame in sorted(self._frames.items())
            ]

    def stale(self, now_s: float) -> Mapping[str, float]:
        """Return the stale frames with the ages (s) of their last transforms; see `rows`."""
        with self._lock:
            if self._clock_s is not None:
                return {}
            found = self._frames.items()
            return {name: now_s - frame.last_s for name, frame in found if frame.is_stale(now_s)}

    def ancestors(self, frame: str, now_s: float) -> list[Mapping[str, Any]]:
        """Return the links from a frame up to the root. Ages are in seconds; None for static transforms."""
        links: list[Mapping[str, Any]] = []
        stale = self.stale(now_s)
        with self._lock:
            seen: set[str] = set()
            while (link := self._frames.get(frame)) is not None and frame not in seen:
                seen.add(frame)
                age_s = None if link.is_static else round(now_s - link.last_s, 1)
                links.append(
                    {
                        "frame": frame,
                        "parent": link.parent,
                        "from": link.authority,
                        "age": age_s,
                        "stale": frame in stale,
                    }
                )
                frame = link.parent
        return links

    def graph(self) -> NodeGraph:
        """Return the tree as a graph with an arrow from each parent to each of its children."""
        with self._lock:
            parents = {child: frame.parent for child, frame in self._frames.items()}
        keys = [Key("frame", name) for name in sorted({*parents, *parents.values()})]
        arrows = [
            Arrow(Key("frame", parent), Key("frame", child), "") for child, parent in sorted(parents.items())
        ]
        return NodeGraph({key: Vertex(key) for key in keys}, tuple(arrows))


class FrameViews:
    """The views of the TF tab."""

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system
        self._shared = system.shared(open_frames)

    async def frames(self, _: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the frames every second, and a drawing whenever the tree changes."""
        shown = None
        with self._shared.use() as (tree, topics):
            while True:
                problems = filter(None, (topic.problem for topic in topics))
                values: dict[str, Any] = {
                    "frames": tree.rows(self._system.now_s()),
                    "error": "\n".join(problems),
                }
                graph = tree.graph()
                if graph != shown:
                    shown = graph
                    values["scene"] = scene_values(await self._system.computations.run(draw, graph))
                yield values
                await asyncio.sleep(SEND_INTERVAL_S)

    async def transform(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Periodically yield the pose of the frame `source` in `target`, or an error if it is unknown.

        Each value also contains the links from both frames up to the root.
        """
        target, source = (_frame_name(arguments, key) for key in ("target", "source"))
        with self._shared.use() as (tree, _):
            while True:
                yield pose_values(tree, target, source, self._system.now_s())
                await asyncio.sleep(POSE_INTERVAL_S)


@contextlib.contextmanager
def open_frames(system: WatchedSystem) -> Iterator[tuple[FrameTree, Sequence[KnownTopic]]]:
    """Provide the frames of a system, and the topics from which they are read."""
    tree = FrameTree()
    topics = []
    with ExitStack() as stack:
        for name, kind, take in (
            ("/clock", "rosgraph_msgs/Clock", _clock_taker(tree)),
            ("/tf", "tf2_msgs/TFMessage", _taker(tree, is_static=False)),
            ("/tf_static", "tf2_msgs/TFMessage", _taker(tree, is_static=True)),
        ):
            topic = KnownTopic(stack.enter_context(system.topics.watch(name)), kind, take)
            stack.enter_context(topic.listening())
            topics.append(topic)
        yield tree, topics


def pose_values(tree: FrameTree, target: str, source: str, now_s: float) -> Mapping[str, Any]:
    """Return the pose of the frame `source` in `target`: metres, quaternion, and angles in degrees."""
    values: dict[str, Any] = {
        "target": tree.ancestors(target, now_s)[:MAX_LINKS],
        "source": tree.ancestors(source, now_s)[:MAX_LINKS],
    }
    try:
        stamp, pose = tree.buffer.lookup(target, source, 0)
    except TransformException as error:
        return {**values, "error": str(error)[:LONGEST_ERROR]}
    angles = map(math.degrees, roll_pitch_yaw(pose))
    return {
        **values,
        "stamp": stamp / NS_PER_S,
        "translation": [round(value, 4) for value in pose[:3]],
        "rotation": [round(value, 4) for value in pose[3:]],
        "angles": [round(value, 2) for value in angles],
    }


def _frame_name(arguments: Mapping[str, object], key: str) -> str:
    name = arguments.get(key)
    if not isinstance(name, str) or not name or len(name) > LONGEST_NAME:
        raise RequestRefused(f"{key} must be the name of a frame, got {name!r:.100}")
    return name.lstrip("/")


def _clock_taker(tree: FrameTree) -> Take:
    def take(message: Any, _raw: AnyMsg, _wall_s: float) -> None:
        tree.set_clock(message.clock.to_sec())

    return take


def _taker(tree: FrameTree, *, is_static: bool) -> Take:
    def take(message: object, raw: AnyMsg, wall_s: float) -> None:
        tree.add(message, wall_s, raw.header.get("callerid", ""), is_static=is_static)

    return take
