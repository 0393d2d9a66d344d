"""Keep, queue and batch a topic's serialized messages for the browsers that draw them."""

from __future__ import annotations

import contextlib
import struct
import threading
import zlib
from collections import deque
from collections.abc import Iterator, Mapping
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.node.any_msg import AnyMsg
from pipros_page.bounded_list import PAGE_VIEW_BYTES
from pipros_page.messages.layout import message_layout
from pipros_page.topic_watch import TopicWatch

LONGEST_QUEUE: Final = 10_000
MAX_SENDERS: Final = 200
"""Maximum number of publishers of a topic whose names are sent to one browser."""
LONGEST_SENDER: Final = 300
_MESSAGE: Final = struct.Struct("<dIH")


class SceneTopic:
    """A topic that browsers show.

    A new browser first receives the watch's current messages, and the other messages of the last `history_s`
    seconds: a paused bag sends no further ones. Messages are added by the threads that receive them.

    Attributes:
        layout: the publishers' `type` with its layout (`types`) or an `error`; None before the first message.
    """

    def __init__(self, watch: TopicWatch, history_s: float) -> None:
        self._watch = watch
        self.layout: Mapping[str, Any] | None = None
        self._history_s = history_s
        self._md5 = ""
        self._lock = threading.Lock()
        self._queues: list[PendingMessages] = []
        self._recent = PendingMessages(LONGEST_QUEUE)

    def add(self, message: AnyMsg, wall_s: float) -> None:
        """Pass a message to all browsers."""
        header = message.header
        with self._lock:
            if header.get("md5sum", "") != self._md5 or self.layout is None:
                self._md5 = header.get("md5sum", "")
                self.layout = _layout_of(header)
            if self._history_s and header.get("latching") != "1":
                self._recent.add(message, wall_s)
                self._recent.drop_before(wall_s - self._history_s)
            for queue in self._queues:
                queue.add(message, wall_s)

    @contextlib.contextmanager
    def queued(self, limit: int) -> Iterator[PendingMessages]:
        """Provide a queue of at most `limit` messages, beginning with the messages kept for new browsers."""
        queue = PendingMessages(limit)
        with self._lock:
            recent = self._recent.messages()
            known = {id(message) for message, _ in recent}
            for message, wall_s in self._watch.current_messages():
                if id(message) not in known:
                    queue.add(message, wall_s)
            for message, wall_s in recent:
                queue.add(message, wall_s)
            self._queues.append(queue)
        try:
            yield queue
        finally:
            with self._lock:
                self._queues.remove(queue)


class PendingMessages:
    """Messages for one browser. If their number or size exceeds a limit, the oldest messages are dropped."""

    def __init__(self, limit: int) -> None:
        self._lock = threading.Lock()
        self._messages: deque[tuple[AnyMsg, float]] = deque()
        self._limit = limit
        self._max_bytes = PAGE_VIEW_BYTES
        self._size_bytes = 0
        self._lost = 0

    def add(self, message: AnyMsg, wall_s: float) -> None:
        with self._lock:
            self._messages.append((message, wall_s))
            self._size_bytes += len(message.body)
            while len(self._messages) > self._limit or (
                self._size_bytes > self._max_bytes and len(self._messages) > 1
            ):
                self._drop()
                self._lost += self._limit > 1

    def drop_before(self, wall_s: float) -> None:
        """Drop messages that arrived before the given time."""
        with self._lock:
            while self._messages and self._messages[0][1] < wall_s:
                self._drop()

    def messages(self) -> list[tuple[AnyMsg, float]]:
        """Return all messages, without removing them."""
        with self._lock:
            return list(self._messages)

    def pop_all(self) -> tuple[list[tuple[AnyMsg, float]], int]:
        """Return the messages added since the last call, and how many were lost (0 if `limit` is 1)."""
        with self._lock:
            found, lost = list(self._messages), self._lost
            self._messages.clear()
            self._size_bytes = self._lost = 0
        return found, lost

    def _drop(self) -> None:
        message, _ = self._messages.popleft()
        self._size_bytes -= len(message.body)


def add_senders(known: dict[str, int], messages: list[tuple[AnyMsg, float]]) -> bool:
    """Add new senders of messages to `known`, numbered from 1. Return whether any was added."""
    before = len(known)
    for message, _ in messages:
        sender = sender_of(message)
        if sender not in known and len(known) < MAX_SENDERS:
            known[sender] = len(known) + 1
    return len(known) > before


def batch(messages: list[tuple[AnyMsg, float]], senders: Mapping[str, int], *, is_compressed: bool) -> bytes:
    """Return the messages as one batch; `SceneViews.messages` describes its format."""
    parts = []
    for message, wall_s in messages:
        number = senders.get(sender_of(message), 0)
        parts += [_MESSAGE.pack(wall_s, len(message.body), number), message.body]
    data = b"".join(parts)
    return b"\1" + zlib.compress(data, 1) if is_compressed else b"\0" + data


def sender_of(message: AnyMsg) -> str:
    """Return the name of the node that sent a message, shortened."""
    return message.header.get("callerid", "")[:LONGEST_SENDER]


def _layout_of(header: Mapping[str, str]) -> Mapping[str, Any]:
    kind = header.get("type", "")
    try:
        types = message_layout(kind, header.get("message_definition", ""))
    except PiprosError as error:
        return {"type": kind, "error": str(error)}
    return {"type": kind, "types": types}
