"""Tree of coordinate frames: `rqt_tf_tree`."""

from __future__ import annotations

import asyncio
import contextlib
import threading
import time
from collections.abc import AsyncIterator, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

from pipros.graph.drawing.node_graph import Arrow, Key, NodeGraph, Vertex
from pipros.graph.drawing.scene import draw
from pipros.node.any_msg import AnyMsg
from pipros.web.known_topic import LONGEST_NAME, KnownTopic, Take
from pipros.web.shared import Shared
from pipros.web.views.graph import scene_values
from pipros.web.watched_system import WatchedSystem

SEND_INTERVAL_S = 1.0
MOST_FRAMES = 2000


@dataclass(slots=True)
class Frame:
    """State of a frame.

    Attributes:
        parent: parent frame in the last transform.
        authority: node that published it.
        is_static: whether it was published on `/tf_static`.
        count: number of transforms since `begin_s`.
        begin_s, last_s: wall times of arrival of the first and the last transform.
        delay_s: time from the stamp of the last transform to its arrival; None for a stamp of 0.
    """

    parent: str
    authority: str
    is_static: bool
    begin_s: float
    last_s: float
    delay_s: float | None
    count: int = 1


class FrameTree:
    """All frames received so far. Transforms are added in the threads of the links."""

    def __init__(self) -> None:
        self._frames: dict[str, Frame] = {}
        self._lock = threading.Lock()
        self._clock_s: float | None = None

    def set_clock(self, clock_s: float) -> None:
        """Measure delays by simulated time from now on."""
        self._clock_s = clock_s

    def add(self, message: Any, wall_s: float, authority: str, *, is_static: bool) -> None:
        """Add a `tf2_msgs/TFMessage`; long names are cut."""
        authority = authority[:LONGEST_NAME]
        now_s = wall_s if self._clock_s is None else self._clock_s
        with self._lock:
            for transform in message.transforms:
                child = transform.child_frame_id.lstrip("/")[:LONGEST_NAME]
                known = self._frames.get(child)
                parent = transform.header.frame_id.lstrip("/")[:LONGEST_NAME]
                stamp_s = transform.header.stamp.to_sec()
                delay_s = now_s - stamp_s if stamp_s else None
                if known is None or known.parent != parent:
                    if known is None and len(self._frames) >= MOST_FRAMES:
                        continue
                    self._frames[child] = Frame(parent, authority, is_static, wall_s, wall_s, delay_s)
                    continue
                known.count += 1
                known.authority, known.is_static = authority, is_static
                known.last_s, known.delay_s = wall_s, delay_s

    def rows(self, now_s: float) -> list[Mapping[str, Any]]:
        """Return name, parent, rate (Hz) and age of the newest transform (s) for each frame, by name."""
        with self._lock:
            return [
                {
                    "frame": child,
                    "parent": frame.parent,
                    "authority": frame.authority,
                    "static": frame.is_static,
                    "rate": (frame.count - 1) / (frame.last_s - frame.begin_s)
                    if frame.last_s > frame.begin_s
                    else None,
                    "age": round(now_s - frame.last_s, 2),
                    "delay": None if frame.delay_s is None else round(frame.delay_s, 3),
                }
                for child, frame in sorted(self._frames.items())
            ]

    def graph(self) -> NodeGraph:
        """Return the tree as a graph, parents first."""
        with self._lock:
            parents = {child: frame.parent for child, frame in self._frames.items()}
        keys = [Key("frame", name) for name in sorted({*parents, *parents.values()})]
        arrows = [
            Arrow(Key("frame", parent), Key("frame", child), "") for child, parent in sorted(parents.items())
        ]
        return NodeGraph({key: Vertex(key) for key in keys}, tuple(arrows))


class FrameViews:
    """The view of the TF tab."""

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system
        self._shared = Shared(self._open)

    async def frames(self, _: Mapping[str, Any]) -> AsyncIterator[Any]:
        """Yield the frames every second, and a drawing whenever the tree changes."""
        shown = None
        with self._shared.use() as (tree, topics):
            while True:
                problems = filter(None, (topic.problem for topic in topics))
                values: dict[str, Any] = {"frames": tree.rows(time.time()), "error": "\n".join(problems)}
                graph = tree.graph()
                if graph != shown:
                    shown = graph
                    values["scene"] = scene_values(await self._system.computations.run(draw, graph))
                yield values
                await asyncio.sleep(SEND_INTERVAL_S)

    @contextlib.contextmanager
    def _open(self) -> Iterator[tuple[FrameTree, Sequence[KnownTopic]]]:
        tree = FrameTree()
        topics = []
        with ExitStack() as stack:
            for name, kind, take in (
                ("/clock", "rosgraph_msgs/Clock", _clock_taker(tree)),
                ("/tf", "tf2_msgs/TFMessage", _taker(tree, is_static=False)),
                ("/tf_static", "tf2_msgs/TFMessage", _taker(tree, is_static=True)),
            ):
                topic = KnownTopic(stack.enter_context(self._system.topics.watch(name)), kind, take)
                stack.enter_context(topic.listening())
                topics.append(topic)
            yield tree, topics


def _clock_taker(tree: FrameTree) -> Take:
    def take(message: Any, _raw: AnyMsg, _wall_s: float) -> None:
        tree.set_clock(message.clock.to_sec())

    return take


def _taker(tree: FrameTree, *, is_static: bool) -> Take:
    def take(message: Any, raw: AnyMsg, wall_s: float) -> None:
        tree.add(message, wall_s, raw.header.get("callerid", ""), is_static=is_static)

    return take
