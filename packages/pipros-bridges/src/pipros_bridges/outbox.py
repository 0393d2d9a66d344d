"""Bounded queue of messages and responses for one client of a bridge. Performs no I/O.

Theory of operation. The threads that receive messages `put` them, and the event loop pops them in the same
order while the client's connection has room. A subscription may limit the number of its queued messages. If
the client's limit in bytes is exceeded, the oldest messages of any subscription are dropped and counted.
A queue of more than `UNCOUNTED_BYTES` also needs room in the client's budget, a part of the server's budget.
Throttled messages wait elsewhere, but count as part of the queue, up to half of its limit.
Responses to requests are never dropped, because the client would wait for them forever: if a response does
not fit, the outbox is overrun and the client must be disconnected.
"""

from __future__ import annotations

import threading
from collections import OrderedDict, deque
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from pipros.basics.budget import Budget

UNCOUNTED_BYTES: Final = 64 * 1024
"""Queues up to this size do not use the budget, because accounting for small messages would take time."""
FRAME_BYTES: Final = 300
"""Approximate memory for a queued frame besides its data. For fragments, it is most of the memory."""
_STEP_BYTES: Final = 256 * 1024
"""Larger queues take room from the budget in steps of this size."""


@dataclass(slots=True, eq=False)  # not frozen, because there is one for each message and client
class WebSocketFrame:
    """One WebSocket frame. May be shared by several outboxes, so it must not be changed.

    Attributes:
        parts: the data. A large body is a separate part, so that it is not copied for each client.
        is_text: whether the data is UTF-8 text.
        owner: object that must exist until the frame is sent, for example because memory is counted for it.
        size: number of bytes.
    """

    parts: tuple[bytes, ...]
    is_text: bool = False
    owner: object = None
    size: int = field(init=False)

    def __post_init__(self) -> None:
        self.size = sum(map(len, self.parts))


def text_frame(text: str) -> WebSocketFrame:
    """Return a frame that contains text."""
    return WebSocketFrame((text.encode(errors="replace"),), is_text=True)


@dataclass(slots=True)
class ClientTraffic:
    """Number and size in bytes of the messages passed to the connection, and number of lost messages."""

    messages: int = 0
    bytes: int = 0
    lost: int = 0


@dataclass(slots=True, eq=False)
class _Waiting:
    number: int  # position in the sequence of all messages and responses
    frames: Sequence[WebSocketFrame]
    size: int  # including `frame_bytes` per frame
    subscription: _Subscription | None = None  # None for responses


@dataclass(slots=True, eq=False)
class _Subscription:
    queue_length: int
    numbers: deque[int] = field(default_factory=deque)  # numbers of the subscription's queued messages
    traffic: ClientTraffic = field(default_factory=ClientTraffic)


class ClientOutbox:
    """Queue of messages and responses for one client. Thread-safe; methods never block.

    Attributes:
        total: traffic of all subscriptions, current and past.
        is_overrun: whether a response did not fit.
    """

    def __init__(
        self,
        limit_bytes: int,
        wake: Callable[[], object],
        budget: Budget | None = None,
        frame_bytes: int = FRAME_BYTES,
    ) -> None:
        """Create an empty outbox.

        Args:
            limit_bytes: maximum size of the queue. An empty queue accepts one message of any size.
            wake: called in any thread when the outbox is no longer empty, or is overrun.
            budget: memory for the queue, beyond `UNCOUNTED_BYTES`.
            frame_bytes: number of bytes that are counted for a frame in addition to its data.
        """
        self.total = ClientTraffic()
        self.is_overrun = False
        self._limit_bytes = limit_bytes
        self._frame_bytes = frame_bytes
        self._wake = wake
        self._budget = budget
        self._granted_bytes = UNCOUNTED_BYTES if budget is not None else limit_bytes
        self._bytes = 0
        self._held_bytes = 0  # the part of `_bytes` that waits elsewhere
        self._next = 0
        self._messages: OrderedDict[int, _Waiting] = OrderedDict()  # keyed by `number`
        self._answers: deque[_Waiting] = deque()
        self._subscriptions: dict[Hashable, _Subscription] = {}
        self._is_closed = False
        self._lock = threading.Lock()

    def open(self, key: Hashable, queue_length: int = 0) -> None:
        """Begin a subscription, or change the maximum number of its queued messages; 0 means unlimited."""
        with self._lock:
            found = self._subscriptions.get(key)
            if found is None:
                self._subscriptions[key] = _Subscription(queue_length)
            else:
                found.queue_length = queue_length

    def forget(self, key: Hashable) -> None:
        """End a subscription: drop its queued messages without counting them as lost."""
        with self._lock:
            found = self._subscriptions.pop(key, None)
            for number in found.numbers if found is not None else ():
                self._bytes -= self._messages.pop(number).size
            self._give_back_unused()

    def put(self, key: Hashable, *frames: WebSocketFrame) -> None:
        """Add a message; its frames are sent or dropped together.

        Do nothing if the subscription is closed.
        """
        size = self._cost(frames)
        with self._lock:
            found = self._subscriptions.get(key)
            if found is None or self._is_closed:
                return
            while found.queue_length and len(found.numbers) >= found.queue_length:
                self._drop(found.numbers[0])
            if self._bytes + size > min(self._granted_bytes, self._limit_bytes):
                self._drop_until_fitting(size)
            was_empty = self._is_empty()
            number = self._next
            found.numbers.append(number)
            self._messages[number] = _Waiting(number, frames, size, found)
            self._next = number + 1
            self._bytes += size
        if was_empty:
            self._wake()

    def hold(self, size: int) -> bool:
        """Count data that waits elsewhere as queued, until `let_go`. Return False if it does not fit."""
        with self._lock:
            if self._is_closed or self._held_bytes + size > self._limit_bytes // 2 or not self._fits(size):
                return False
            self._bytes += size
            self._held_bytes += size
            return True

    def let_go(self, size: int) -> None:
        """Stop counting `size` bytes of data that `hold` has counted."""
        with self._lock:
            if self._is_closed:
                return
            self._bytes -= size
            self._held_bytes -= size
            self._give_back_unused()

    def answer(self, *frames: WebSocketFrame) -> None:
        """Add a response to a request, or another message that must not be dropped."""
        size = self._cost(frames)
        with self._lock:
            if self._is_closed:
                return
            self._drop_until_fitting(size)
            wakes = self._is_empty()
            if not self._fits(size) and not wakes:
                self.is_overrun = wakes = self._is_closed = True
                self._clear()
            else:
                self._answers.append(_Waiting(self._next, frames, size))
                self._next += 1
                self._bytes += size
        if wakes:
            self._wake()

    def pop(self) -> Sequence[WebSocketFrame] | None:
        """Remove the oldest message or response and return its frames. Return None if the outbox is empty."""
        with self._lock:
            answers = self._answers
            if answers and answers[0].number < next(iter(self._messages), self._next):
                taken = answers.popleft()
            elif self._messages:
                _, taken = self._messages.popitem(last=False)
            else:
                return None
            self._bytes -= taken.size
            if self._granted_bytes > UNCOUNTED_BYTES:
                self._give_back_unused()
            subscription = taken.subscription
            if subscription is not None:
                subscription.numbers.popleft()
                size = taken.size - self._frame_bytes * len(taken.frames)
                for traffic in (self.total, subscription.traffic):
                    traffic.messages += 1
                    traffic.bytes += size
            return taken.frames

    def close(self) -> None:
        """Discard all data, and ignore all later messages and responses."""
        with self._lock:
            self._is_closed = True
            self._clear()

    @property
    def is_closed(self) -> bool:
        """Whether the outbox discards everything."""
        return self._is_closed

    @property
    def has_answers(self) -> bool:
        """Whether the queue contains a response."""
        return bool(self._answers)

    @property
    def waiting_bytes(self) -> int:
        """Size of the queue in bytes."""
        return self._bytes

    def traffic(self) -> Mapping[Hashable, ClientTraffic]:
        """Return a copy of each open subscription's traffic, by subscription key."""
        with self._lock:
            return {key: replace(found.traffic) for key, found in self._subscriptions.items()}

    def _cost(self, frames: Sequence[WebSocketFrame]) -> int:
        data = frames[0].size if len(frames) == 1 else sum(frame.size for frame in frames)
        return data + self._frame_bytes * len(frames)

    def _is_empty(self) -> bool:
        return not self._messages and not self._answers

    def _drop_until_fitting(self, size: int) -> None:
        """Drop the oldest messages until `size` bytes fit or only responses remain."""
        while not self._fits(size) and self._messages:
            self._drop(next(iter(self._messages)))

    def _fits(self, size: int) -> bool:
        """Return whether another `size` bytes fit, after taking room for them from the budget."""
        needed = self._bytes + size
        if needed > self._limit_bytes:
            return False
        if needed > self._granted_bytes and self._budget is not None:
            missing = needed - self._granted_bytes
            step = max(missing, _STEP_BYTES)
            if not self._budget.take(step):
                step = missing
                if not self._budget.take(step):
                    return False
            self._granted_bytes += step
        return True

    def _give_back_unused(self) -> None:
        """Give room back to the budget if the queue has become empty or much shorter."""
        if self._granted_bytes <= UNCOUNTED_BYTES or self._budget is None:
            return
        unused = self._granted_bytes - max(self._bytes, UNCOUNTED_BYTES)
        if unused > (2 * _STEP_BYTES if self._bytes else 0):
            self._budget.give_back(unused)
            self._granted_bytes -= unused

    def _drop(self, number: int) -> None:
        """Drop and count the oldest message of a subscription."""
        dropped = self._messages.pop(number)
        self._bytes -= dropped.size
        self.total.lost += 1
        if dropped.subscription is not None:
            dropped.subscription.numbers.popleft()
            dropped.subscription.traffic.lost += 1

    def _clear(self) -> None:
        self._messages.clear()
        self._answers.clear()
        for found in self._subscriptions.values():
            found.numbers.clear()
        self._bytes = self._held_bytes = 0
        self._give_back_unused()
