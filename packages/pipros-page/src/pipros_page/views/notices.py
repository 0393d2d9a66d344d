"""The bell at the top of the page: the changes of the last minute, and the stale sources."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import AsyncIterator, Collection, Iterator, Mapping, Sequence
from typing import Any, Final, TypeVar

from pipros_page.bounded_list import bounded_list
from pipros_page.notices import MAX_STALE, Notices
from pipros_page.shared import Shared
from pipros_page.views.console import LOG_TOPIC, Log, open_log
from pipros_page.views.diagnostics import STALE_LEVEL, TOPICS, Statuses, open_statuses, topics_of
from pipros_page.views.frames import FrameTree, open_frames
from pipros_page.watched_system import WatchedSystem
from pipros_tools.graph.observer import GraphObservation

T = TypeVar("T")
ERROR_LEVEL: Final = 2
LOGGED_ERROR: Final = 8
MAX_SCANNED_BYTES: Final = 1_000_000
"""Approximate maximum size of the log entries that are examined each second. The others follow later."""


class NoticeViews:
    """The view of the bell. It shows the running system, even while the browser shows a bag."""

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system
        self._shared = system.shared(_open)

    async def notices(self, _: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the changes of the last minute, newest first, and the stale sources, whenever they change."""
        shown: Any = None
        with self._shared.use() as collected:
            async for observation in self._system.observations():
                now_s = self._system.now_s()
                collected.update(observation, now_s)
                recent = [dataclasses.asdict(each) for each in collected.notices.recent(now_s)]
                stale = collected.notices.stale()
                values = {
                    "changes": bounded_list(recent),
                    "stale": bounded_list(stale[:MAX_STALE]),
                    "count": len(stale),
                }
                if values != shown:
                    shown = values
                    yield values


class _CollectedNotices:
    """Notices from all sources, updated once per observation, regardless of the number of browsers.

    Each topic is opened once it is published.
    """

    def __init__(self, system: WatchedSystem, stack: contextlib.ExitStack) -> None:
        self.notices = Notices()
        self._system = system
        self._stack = stack
        self._tree: FrameTree | None = None
        self._statuses: dict[str, Statuses] = {}
        self._log: Log | None = None
        self._number = 0
        self._seen: GraphObservation | None = None

    def update(self, observation: GraphObservation, now_s: float) -> None:
        if observation is self._seen or observation.error:
            return
        self._seen = observation
        self._open(observation.state.publishers.keys())
        notices = self.notices
        known = set(observation.state.topics())
        notices.forget("topic", {name for kind, name, _ in notices.stale() if kind == "topic"} - known)
        notices.note_stale("topic", self._system.activity.stale(), now_s)
        texts = {name: node.error for name, node in observation.nodes.items() if node.error}
        notices.note_failing("node", texts, now_s)
        if self._tree is not None:
            notices.note_stale("frame", self._tree.stale(now_s), now_s)
        self._note_components(topics_of(observation), now_s)
        self._note_log(now_s)

    def _open(self, published: Collection[str]) -> None:
        def use(shared: Shared[tuple[T, Any]]) -> T:
            return self._stack.enter_context(shared.use())[0]

        if self._tree is None and "/tf" in published:
            self._tree = use(self._system.shared(open_frames))
        if self._log is None and LOG_TOPIC in published:
            self._log = use(self._system.shared(open_log))
            self._number = self._log.end
        for name in TOPICS:
            if name in published and name not in self._statuses:
                self._statuses[name] = use(self._system.shared(open_statuses, name))

    def _note_components(self, topics: Sequence[str], now_s: float) -> None:
        levels: dict[str, tuple[int, float, str]] = {}
        for topic in topics:
            if topic in self._statuses:
                levels |= leaves(self._statuses[topic].levels(now_s))
        stale = {name: age_s for name, (level, age_s, _) in levels.items() if level == STALE_LEVEL}
        self.notices.note_stale("component", stale, now_s)
        wrong = {name: text for name, (level, _, text) in levels.items() if level == ERROR_LEVEL}
        self.notices.note_failing("component", wrong, now_s)

    def _note_log(self, now_s: float) -> None:
        if self._log is None:
            return
        entries, _, self._number = self._log.since(self._number, MAX_SCANNED_BYTES)
        for level, node, text, *_ in entries:
            if level >= LOGGED_ERROR:
                self.notices.note_error("node", node, text, now_s)


def leaves(levels: Mapping[str, T]) -> Mapping[str, T]:
    """Return the components, except an aggregator's groups, which repeat the levels of their members."""
    groups = {name.rpartition("/")[0] for name in levels}
    return {name: each for name, each in levels.items() if name not in groups}


@contextlib.contextmanager
def _open(system: WatchedSystem) -> Iterator[_CollectedNotices]:
    with contextlib.ExitStack() as stack:
        yield _CollectedNotices(system, stack)
