"""Receive transforms, look them up, and hold back messages until their transforms are available."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Any, Final

from pipros.basics.errors import Interrupted
from pipros.basics.throttle import Throttle
from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S
from pipros.node import Node
from pipros_libraries.transforms.buffer import DEFAULT_LENGTH, TransformBuffer
from pipros_libraries.transforms.errors import TransformException
from pipros_libraries.transforms.messages import in_ns, pose_of_transform
from pipros_libraries.transforms.pose import Pose

Deliver = Callable[[Any], object]

AHEAD_NS: Final = 10_000_000_000
"""Messages whose timestamps are further in the future than this are dropped."""
_WARN_S: Final = 10.0


class TransformListener:
    """Fills a buffer from `/tf` and `/tf_static`. Callbacks and lookups may run in several threads.

    If the clock jumps back, the buffer is cleared except for static transforms.

    Attributes:
        problems: called with the reason for each transform that the buffer rejects.
    """

    def __init__(self, node: Node, length_ns: int = DEFAULT_LENGTH) -> None:
        """Subscribe. Blocks until the master answers."""
        self.buffer = TransformBuffer(length_ns)
        self.problems: Callable[[str], object] = node.log.debug
        self._node = node
        self._now_ns = self._left_ns = self._ahead_ns = 0
        self._ahead: set[str] = set()  # frames whose times are in the future
        self._lock = threading.Lock()
        self._warnings = Throttle(node.log, _WARN_S)
        self._observers: tuple[Callable[[], object], ...] = ()
        message_class: Any = load_message_class("tf2_msgs/TFMessage")
        self._subscribers = [
            node.subscribe("/tf", message_class, self._on_moving, queue_size=100),
            node.subscribe("/tf_static", message_class, self._on_static, queue_size=100),
        ]

    def at(self, target: str, source: str, stamp_ns: int, timeout_s: float = 0.0) -> Pose:
        """Return the pose of `source` relative to `target` at a time.

        If the pose is not available, wait for it up to `timeout_s`. A time of 0 means the latest common time.

        Raises:
            TransformException: the transform is not available.
            Interrupted: the node was shut down while waiting.
        """

        def ask() -> tuple[int, str]:
            reason = self.buffer.can_transform(target, source, stamp_ns)
            return (1, "") if reason is None else (0, reason)

        if timeout_s > 0:
            self.buffer.waiter.wait(ask, round(timeout_s * 1e9), lambda: self._node.clock, self._check)
        return self.buffer.lookup(target, source, stamp_ns)[1]

    def observe(self, observer: Callable[[], object]) -> None:
        """Call `observer` after each message with transforms, in the thread that received it."""
        self._observers = (*self._observers, observer)

    def close(self) -> None:
        """Unsubscribe."""
        for each in self._subscribers:
            each.unregister()

    def _check(self) -> None:
        if self._node.is_ending:
            raise Interrupted("the node was shut down while it waited for a transform")

    def _on_moving(self, message: Any) -> None:
        self._insert(message, is_static=False)

    def _on_static(self, message: Any) -> None:
        self._insert(message, is_static=True)

    def _insert(self, message: Any, *, is_static: bool) -> None:
        """Insert transforms, but not one from the future: the buffer would drop all later ones as too old.

        If the next one is as far ahead, the clock of its computer is, and it is inserted, unless it was sent
        before the clock jumped back. When that clock has been set, the buffer is cleared. Static transforms
        have no age, and come once, for example with times of another clock.
        """
        now_ns = self._checked_ns()
        for each in message.transforms:
            stamp_ns = in_ns(each.header.stamp)
            ahead_ns = stamp_ns - now_ns if now_ns and not is_static else 0
            is_late = 0 <= self._left_ns - stamp_ns < AHEAD_NS
            if ahead_ns > AHEAD_NS and (is_late or abs(ahead_ns - self._ahead_ns) > AHEAD_NS):
                self._ahead_ns = ahead_ns
                text = "dropped a transform to %s: its time is %.0f s in the future"
                self._warnings.warning(text, each.child_frame_id, ahead_ns / NS_PER_S)
                continue
            child, pose = each.child_frame_id, pose_of_transform(each.transform)
            add = partial(self.buffer.insert, each.header.frame_id, child, stamp_ns, pose, "", is_static)
            problems = add()
            if ahead_ns > AHEAD_NS:
                self._ahead |= set() if problems else {child}
            elif problems and child in self._ahead:
                self.buffer.clear()
                self._ahead.clear()
                text = "the time of the transforms to %s moved back: all but static ones are forgotten"
                self._warnings.warning(text, child)
                problems = add()
            for problem in problems:
                self.problems(problem)
        for observer in self._observers:
            observer()

    def _checked_ns(self) -> int:
        """Return the time. If the clock has jumped back since the last call, clear the buffer."""
        with self._lock:
            before_ns, self._now_ns = self._now_ns, self._node.clock.now_ns()
            if self._now_ns < before_ns:
                self._left_ns = before_ns
                self.buffer.clear()
                self._warnings.warning("the time moved back: all transforms but static ones are forgotten")
            return self._now_ns


class TransformGate:
    """Holds back messages until they can be transformed to a target frame, like tf's message filter.

    If more than `queue_size` messages are waiting, the oldest is dropped.

    Attributes:
        tolerance_ns: the transform must be available both at a message's timestamp and `tolerance_ns` later.
    """

    def __init__(
        self,
        listener: TransformListener,
        target: str,
        queue_size: int,
        deliver: Deliver,
        on_dropped: Deliver | None = None,
        tolerance_ns: int = 0,
    ) -> None:
        self.tolerance_ns = tolerance_ns
        self._buffer, self._target = listener.buffer, target.removeprefix("/")
        self._deliver, self._on_dropped = deliver, on_dropped
        self._waiting: deque[Any] = deque()
        self._queue_size = max(queue_size, 1)
        self._lock = threading.Lock()
        listener.observe(self.check)

    def add(self, message: Any) -> None:
        """Deliver a message now, or when its transform is available."""
        dropped = None
        with self._lock:
            if len(self._waiting) >= self._queue_size:
                dropped = self._waiting.popleft()
            self._waiting.append(message)
        if dropped is not None and self._on_dropped is not None:
            self._on_dropped(dropped)
        self.check()

    def check(self) -> None:
        """Deliver the waiting messages whose transforms are available."""
        with self._lock:
            ready = [each for each in self._waiting if self._is_ready(each)]
            if not ready:
                return
            delivered = {id(each) for each in ready}
            self._waiting = deque(each for each in self._waiting if id(each) not in delivered)
        for each in ready:
            self._deliver(each)

    def _is_ready(self, message: Any) -> bool:
        source, stamp_ns = message.header.frame_id.removeprefix("/"), in_ns(message.header.stamp)
        try:
            return all(
                self._buffer.can_transform(self._target, source, at_ns) is None
                for at_ns in {stamp_ns, stamp_ns + self.tolerance_ns}
            )
        except TransformException:
            return False
