"""The log of the whole system, and the levels of loggers: `rqt_console` and `rqt_logger_level`."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Mapping
from typing import Any

from pipros.errors import PiprosError
from pipros.graph.service_call import ServiceCaller
from pipros.net.master_client import MasterClient
from pipros.node.any_msg import RawMessage
from pipros.node.service_client import OpenCalls
from pipros.web.server import RequestRefused
from pipros.web.service_calls import TOOL_CALL_S
from pipros.web.topic_watch import NewSamples, TopicWatch
from pipros.web.views.topics import topic_name
from pipros.web.watched_system import WatchedSystem

LOG_TOPIC = "/rosout_agg"
SEND_INTERVAL_S = 0.2
KEPT_ENTRIES = 20_000
"""Entries that wait for a slow browser."""
LONGEST_TEXT = 4000
LEVELS = ("debug", "info", "warn", "error", "fatal")


class ConsoleViews:
    """The views of the Console tab."""

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system

    async def console(self, _: Mapping[str, Any]) -> AsyncIterator[Any]:
        """Log entries as they come: number, level, node, text, time, file, line, function."""
        with self._system.topics.watch(LOG_TOPIC, queue_size=KEPT_ENTRIES) as watch:
            log = _Log(watch)
            with watch.listening(log.add):
                yield {"entries": [], "lost": 0}
                while True:
                    entries, lost = log.entries.pop_all()
                    if entries or lost:
                        yield {"entries": entries, "lost": lost}
                    await asyncio.sleep(SEND_INTERVAL_S)

    async def loggers(self, arguments: Mapping[str, Any]) -> Any:
        """The loggers of a node with their levels."""
        node = topic_name(arguments)
        response = await self._call(f"{node}/get_loggers", [])
        return [{"name": logger.name, "level": logger.level} for logger in response.loggers]

    async def set_logger_level(self, arguments: Mapping[str, Any]) -> Any:
        """Sets the level of a logger of a node."""
        node, logger, level = topic_name(arguments), arguments.get("logger"), arguments.get("level")
        if not isinstance(logger, str) or level not in LEVELS:
            raise RequestRefused(f"level must be one of {', '.join(LEVELS)}, got {level!r}")
        await self._call(f"{node}/set_logger_level", [logger, level])
        return True

    async def _call(self, service: str, values: list[Any]) -> Any:
        def call(master: MasterClient, calls: OpenCalls) -> Any:
            caller = ServiceCaller(master, service, calls=calls)
            return caller.call(caller.request(values), TOOL_CALL_S)

        return await self._system.calls.run(call)


class _Log:
    """Decodes entries in the thread of the link."""

    def __init__(self, watch: TopicWatch) -> None:
        self.entries = NewSamples(KEPT_ENTRIES)
        self._watch = watch

    def add(self, message: RawMessage, wall_s: float) -> None:
        try:
            entry: Any = self._watch.decode(message)
        except PiprosError:
            self.entries.lose()
            return
        stamp = entry.header.stamp.to_sec() or wall_s
        self.entries.add(
            [
                entry.level,
                entry.name[:LONGEST_TEXT],
                entry.msg[:LONGEST_TEXT],
                round(stamp, 4),
                entry.file[:LONGEST_TEXT],
                entry.line,
                entry.function[:LONGEST_TEXT],
            ]
        )
