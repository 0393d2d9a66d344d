"""Links between a publication and a subscription of the same node, which pass messages as objects.

Nothing is encoded, so all subscribers and the publisher share one message, which must not be changed after it
has been published. Nodelets use these links; other nodes that subscribe to their own topics receive copies.
"""

from __future__ import annotations

import contextlib
import copy
import threading
from collections.abc import Callable, Mapping
from functools import cache
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, Final

from pipros.basics.extras import required
from pipros.msg import load_message_class
from pipros.msg.compile.arrays import octets
from pipros.net.delivery_lock import DeliveryLock
from pipros.net.incoming import ReceiveStatistics

if TYPE_CHECKING:
    from pipros.msg.base import Message

LONGEST_QUEUE: Final = 1000
"""Maximum number of messages that wait for a subscriber without a queue size. The oldest are dropped."""


class InProcessLink:
    """Delivers a publication's messages to one subscription, in order, in its own thread.

    Attributes:
        lends: has no effect; see `IncomingLink`.
    """

    transport = "INTRAPROCESS"
    local_port = 0
    descriptor = -1

    def __init__(
        self,
        peer: str,
        *,
        deliver: Callable[[Message], object],
        delivery_lock: DeliveryLock,
        queue_size: int | None,
        on_closed: Callable[[InProcessLink], object],
    ) -> None:
        """Store the settings; `start` begins to deliver."""
        self.peer = peer
        self.queue_size = queue_size
        self.lends = False
        self.statistics = ReceiveStatistics()
        self._deliver = deliver
        self._delivery_lock = delivery_lock
        self._on_closed = on_closed
        self._waiting: SimpleQueue[Message | None] = SimpleQueue()
        self._is_closed = False
        self._thread = threading.Thread(target=self._run, name=f"in-process link of {peer}", daemon=True)

    def start(self) -> None:
        """Start the thread.

        Raises:
            RuntimeError: the system cannot start another thread.
        """
        self._thread.start()

    def put(self, message: Message) -> None:
        """Queue a message. Drop the oldest if there are more than `queue_size`. Never blocks."""
        waiting = self._waiting
        waiting.put(message)
        if waiting.qsize() > (self.queue_size or LONGEST_QUEUE):
            with contextlib.suppress(Empty):  # the link's thread may already have taken the message
                if waiting.get_nowait() is None:
                    waiting.put(None)
                self.statistics.dropped += 1

    def _run(self) -> None:
        lock, statistics, take = self._delivery_lock, self.statistics, self._waiting.get
        while (message := take()) is not None and not self._is_closed:
            lock.acquire()
            try:
                self._deliver(message)
            finally:
                lock.release()
            statistics.frames += 1
            del message  # so that the message is not kept in memory until the next one

    def close(self) -> None:
        """Stop delivering, and drop all queued messages. May be called repeatedly, from any thread."""
        if not self._is_closed:
            self._is_closed = True
            self._waiting.put(None)
            self._on_closed(self)

    def join(self, timeout_s: float) -> None:
        """Wait for the thread to end, unless the caller is that thread."""
        if self._thread.is_alive() and self._thread is not threading.current_thread():
            self._thread.join(timeout_s)


def with_octets(message: Any, *, as_arrays: bool) -> Any:
    """Return a message whose `uint8[]` and `char[]` fields have the type that a subscriber expects.

    This type is a read-only numpy array if `as_arrays` is true, otherwise `bytes`. The message itself is not
    changed: if a field has another type, the result is a shallow copy. Messages in arrays are not converted.
    """
    changed: dict[str, Any] = {}
    for name, is_message in _fields_with_octets(message.__class__).items():
        value = getattr(message, name)
        new = with_octets(value, as_arrays=as_arrays) if is_message else _octets(value, as_arrays)
        if new is not value:
            changed[name] = new
    if not changed:
        return message
    result = copy.copy(message)
    for name, value in changed.items():
        setattr(result, name, value)
    return result


def _octets(value: Any, as_array: bool) -> Any:
    if not as_array:
        return value if isinstance(value, bytes) else bytes(octets(value))
    numpy = required("numpy", "zero_copy=True needs numpy", "numpy")
    if isinstance(value, numpy.ndarray) and value.dtype == numpy.uint8 and value.ndim == 1:
        if not value.flags.writeable:
            return value
        array = value.view()
    else:
        array = numpy.frombuffer(octets(value), numpy.uint8)
    array.flags.writeable = False
    return array


def _has_octets(type_name: str) -> bool:
    message_class: Any = load_message_class(type_name)
    return bool(_fields_with_octets(message_class))


@cache
def _fields_with_octets(message_class: Any) -> Mapping[str, bool]:
    """Map the name of each field that is or contains an octet array to whether it is an embedded message."""
    found = {}
    for name, kind in zip(message_class.__slots__, message_class._slot_types, strict=False):
        base, bracket, _ = kind.partition("[")
        if bracket and base in ("uint8", "char"):
            found[name] = False
        elif not bracket and "/" in kind and _has_octets(kind):
            found[name] = True
    return found
