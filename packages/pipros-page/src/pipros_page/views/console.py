"""The log of all nodes, and their logger levels: `rqt_console` and `rqt_logger_level`."""

from __future__ import annotations

import asyncio
import contextlib
import sys
import threading
from collections import deque
from collections.abc import AsyncIterator, Iterator, Mapping
from itertools import islice
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.net.address import split_uri
from pipros.net.master_client import MasterClient
from pipros.net.this_machine import is_this_machine
from pipros.node.any_msg import AnyMsg
from pipros.node.open_calls import OpenCalls
from pipros_page.bounded_list import PAGE_VIEW_BYTES
from pipros_page.messages.known_topic import LONGEST_NAME, KnownTopic
from pipros_page.service_calls import TOOL_CALL_S
from pipros_page.views.topics import topic_name
from pipros_page.watched_system import WatchedSystem
from pipros_server.view_server import RequestRefused
from pipros_tools.graph.service_call import ServiceCaller
from pipros_tools.launch.log_history import Entry, log_history

LOG_TOPIC = "/rosout_agg"
SEND_INTERVAL_S = 0.2
MAX_SENT_BYTES = 1_000_000
"""Approximate maximum size of one update. The rest is sent in the next update."""
QUEUE = 20_000
LONGEST_TEXT = 4000
LEVELS = ("debug", "info", "warn", "error", "fatal")


class ConsoleViews:
    """The views of the Console tab."""

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system
        self._shared = system.shared(open_log)

    async def console(self, _: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the entries of the run's log file as `history`, then new entries as `entries`."""
        with self._shared.use() as (log, topic):
            number = log.end if self._system.is_live else 0  # for a bag, include earlier entries
            history = await self._system.questions.run(self._history)
            entries, lost, number = log.since(number, MAX_SENT_BYTES)
            written = {_identity(entry) for entry in entries}
            history = [entry for entry in history if _identity(entry) not in written]
            values: dict[str, Any] = {
                "history": history,
                "entries": entries,
                "lost": lost,
                "error": topic.problem,
            }
            while True:
                yield values
                shown = values["error"]
                while True:
                    await asyncio.sleep(SEND_INTERVAL_S)
                    entries, lost, number = log.since(number, MAX_SENT_BYTES)
                    # skip new entries that were already in the file
                    if history and entries:
                        written = {_identity(entry) for entry in history}
                        entries = [entry for entry in entries if _identity(entry) not in written]
                        history = []
                    values = {"entries": entries, "lost": lost, "error": topic.problem}
                    if entries or lost or values["error"] != shown:
                        break

    def _history(self) -> list[Entry]:
        if not self._system.is_live:
            return []
        graph = self._system.graph
        try:
            if not is_this_machine(split_uri(graph.master_uri)[0]):
                return []
            run_id = graph.master.get_param("/run_id")
        except (PiprosError, ValueError):  # the master does not respond, or has no /run_id
            return []
        return log_history(graph.environment.log_dir.expanduser(), run_id, LONGEST_TEXT, LONGEST_NAME)

    async def loggers(self, arguments: Mapping[str, object]) -> Any:
        """Return a node's loggers with their levels."""
        node = topic_name(arguments)
        response = await self._call(f"{node}/get_loggers", [])
        return [{"name": logger.name, "level": logger.level} for logger in response.loggers]

    async def set_logger_level(self, arguments: Mapping[str, object]) -> Any:
        """Set the level of a node's logger."""
        node, logger, level = topic_name(arguments), arguments.get("logger"), arguments.get("level")
        if not isinstance(logger, str) or level not in LEVELS:
            rule = f"logger must be a string, and level must be one of {', '.join(LEVELS)}"
            raise RequestRefused(f"{rule}; got {logger!r} and {level!r}")
        await self._call(f"{node}/set_logger_level", [logger, level])
        return True

    async def _call(self, service: str, values: list[Any]) -> Any:
        def call(master: MasterClient, calls: OpenCalls) -> Any:
            caller = ServiceCaller(master, service, calls=calls)
            return caller.call(caller.request(values), TOOL_CALL_S)

        return await self._system.calls.run(call)


@contextlib.contextmanager
def open_log(system: WatchedSystem) -> Iterator[tuple[Log, KnownTopic]]:
    """Provide the log of a system, and the topic from which it is read."""
    with system.topics.watch(LOG_TOPIC, queue_size=QUEUE) as watch:
        log = Log(PAGE_VIEW_BYTES)
        topic = KnownTopic(watch, "rosgraph_msgs/Log", log.add)
        with topic.listening():
            yield log, topic


def _identity(entry: Entry) -> tuple[Any, ...]:
    return entry[1], entry[3], entry[4], entry[5]


class Log:
    """Most recent log entries of all nodes. Entries are added by the threads that receive them."""

    def __init__(self, max_bytes: int) -> None:
        """Create a log of at most `max_bytes`. When it is full, the oldest entries are dropped."""
        self._max_bytes = max_bytes
        self._lock = threading.Lock()
        self._entries: deque[tuple[int, Entry]] = deque()
        self._bytes = 0
        self._end = 0

    @property
    def end(self) -> int:
        """Number of the next entry. Entries are numbered consecutively."""
        return self._end

    def add(self, message: Any, _: AnyMsg | None, wall_s: float) -> None:
        """Add a `rosgraph_msgs/Log`. Long strings are shortened."""
        entry: Entry = [
            message.level,
            message.name[:LONGEST_NAME],
            message.msg[:LONGEST_TEXT],
            round(message.header.stamp.to_sec() or wall_s, 4),
            message.file[:LONGEST_NAME],
            message.line,
            message.function[:LONGEST_NAME],
        ]
        size = sys.getsizeof(entry) + sum(map(sys.getsizeof, entry))
        with self._lock:
            self._entries.append((size, entry))
            self._bytes += size
            self._end += 1
            while self._bytes > self._max_bytes:
                self._bytes -= self._entries.popleft()[0]

    def since(self, number: int, max_bytes: int) -> tuple[list[Entry], int, int]:
        """Return the entries from `number` on, oldest first, up to about `max_bytes`.

        Returns:
            The entries, the number of dropped entries before them, and the number to continue from.
        """
        entries: list[Entry] = []
        with self._lock:
            first = max(number, self._end - len(self._entries))
            for size, entry in islice(self._entries, first - self._end + len(self._entries), None):
                entries.append(entry)
                max_bytes -= size
                if max_bytes <= 0:
                    break
        return entries, first - number, first + len(entries)
