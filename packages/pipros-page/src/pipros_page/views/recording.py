"""Recordings started from the page."""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections.abc import AsyncIterator, Mapping
from typing import Any, Final

from pipros_page.bags.recording import BagRecording, RecordingPlan
from pipros_page.bounded_list import bounded_list
from pipros_page.views.topics import topic_name
from pipros_page.watched_system import WatchedSystem
from pipros_server.view_server import RequestRefused
from pipros_tools.bag.errors import BagError

MAX_TOPICS: Final = 1000


class RecordingViews:
    """The view and the actions of the Record section in the Bags tab.

    Args:
        recording: this page's recordings; None if the page has no bag folder.
    """

    def __init__(self, system: WatchedSystem, recording: BagRecording | None) -> None:
        self._system = system
        self._recording = recording

    async def recording(self, _: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the running system's topics, the space for a recording, and the current or last recording.

        The space is in bytes, or None if the page has no bag folder.
        """
        recording = self._recording
        observations = self._system.observations()
        async with contextlib.aclosing(observations):  # type: ignore[type-var]
            async for observation in observations:
                topics = {"topics": bounded_list(sorted(observation.types))}
                if recording is None:
                    yield {**topics, "spare": None, "recording": None}
                    continue
                spare = await self._system.questions.run(recording.spare_bytes)
                state = recording.state()
                yield {
                    **topics,
                    "spare": max(spare, 0),
                    "recording": dataclasses.asdict(state) if state is not None else None,
                }

    async def record(self, arguments: Mapping[str, object]) -> Any:
        """Start a recording of `topics`, or of all topics if the list is empty."""
        recording = self._existing()
        topics = arguments.get("topics", [])
        if not isinstance(topics, list) or len(topics) > MAX_TOPICS:
            raise RequestRefused(f"topics must be a list of at most {MAX_TOPICS} names")
        plan = RecordingPlan(
            str(arguments.get("name") or ""),
            [topic_name({"name": topic}) for topic in topics],
            round(_limit(arguments, "size")),
            _limit(arguments, "seconds"),
        )
        try:
            await self._system.questions.run(recording.start, plan, self._system.node.environment)
        except (BagError, OSError) as error:
            raise RequestRefused(str(error)) from None
        return True

    async def stop_recording(self, _: Mapping[str, object]) -> Any:
        """End the recording; see `BagRecording.stop`."""
        await self._system.questions.run(self._existing().stop)
        return True

    def _existing(self) -> BagRecording:
        if self._recording is None:
            raise RequestRefused("this page has no bag folder; start it with --bags DIR")
        return self._recording


def _limit(arguments: Mapping[str, object], key: str) -> float:
    value = arguments.get(key, 0)
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < math.inf:
        raise RequestRefused(f"{key} must be a finite number >= 0, got {value!r:.100}")
    return float(value)
