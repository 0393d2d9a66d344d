"""The recording of the running system's recent messages, which the Bags tab can show."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Mapping

from pipros_page.bags.rewind import KEPT_TOPICS, RecentMessages
from pipros_page.watched_system import WatchedSystem


class RewindViews:
    """The view that keeps topics recorded; `BagViews.bag` shows what was recorded."""

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system
        self._recorders = 0

    async def rewind(self, _: Mapping[str, object]) -> AsyncIterator[object]:
        """Watch the `KEPT_TOPICS` that are published. Yield the duration and size of the recorded
        messages (`seconds` and `bytes`), and the maximum duration (`span`, in seconds). If the page does not
        record messages, yield `{"span": 0}` and end.

        After the last browser has left, the messages are kept for another `span` seconds, and then dropped.
        """
        recent = self._system.recent
        if recent is None:
            yield {"span": 0}
            return
        self._recorders += 1
        try:
            with contextlib.ExitStack() as stack:
                async for observation in self._system.observations():
                    before = stack.pop_all()
                    for topic in KEPT_TOPICS & observation.state.publishers.keys():
                        stack.enter_context(self._system.topics.watch(topic))
                    before.close()
                    seconds, size = recent.figures()
                    yield {"span": recent.span_s, "seconds": round(seconds, 1), "bytes": size}
        finally:
            self._recorders -= 1
            asyncio.get_running_loop().call_later(recent.span_s, self._drop, recent)

    def _drop(self, recent: RecentMessages) -> None:
        if not self._recorders:
            recent.clear()
