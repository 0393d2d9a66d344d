"""Publish the actions of a description as messages."""

from __future__ import annotations

from collections.abc import Iterator
from functools import reduce
from typing import TYPE_CHECKING, Any

import numpy as np

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros.msg.language.spec import FLOATS, NUMBERS
from pipros.msg.time import NS_PER_S, Time
from pipros.safe.settings import BadSettings
from pipros_data.datasets.config import SignalSource
from pipros_data.datasets.signals import USUAL_FIELDS, check_limits, numbers_of
from pipros_data.live.sources import table_of, wait_until
from pipros_server.policy.policy_file import POLICY_STOP_BYTES

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from pipros.node import Node

_ZERO_STOPS = ("geometry_msgs/Twist", "geometry_msgs/TwistStamped")
"""Message types for which zeros stop the robot by default."""


def is_stopped_by_zeros(source: SignalSource, kind: str) -> bool:
    """Return whether zeros stop an action with the message type `kind`.

    Without `stop` in the description, they do so if the type is in `_ZERO_STOPS`.
    """
    return source.stop == "zero" or (not source.stop and kind in _ZERO_STOPS)


class ActionRefused(PiprosError, ValueError):
    """A number of an action is not finite or outside its limits, or the count is wrong."""


class DriveCommand:
    """A publisher for an action. Creates messages from numbers in the description's unit.

    Attributes:
        source: the action in the description.
        topic, type: the resolved topic, and its message type.
        names: the names of the numbers.
        limits: the minimum and the maximum of each number; infinite if there are no limits.
        stop: the numbers that stop the robot, or None if the robot is stopped by holding its measured state.
    """

    def __init__(self, node: Node, source: SignalSource, end_s: float) -> None:
        """Advertise the topic. If the description has no type, wait until one is registered with the master.

        Raises:
            BadSettings: the description does not fit the type or does not specify how to stop the robot, or
                the message is too large.
            NotFound: the type is not installed.
            RobotSilent: no type is registered for the topic by the monotonic time `end_s`.
        """
        self.source = source
        self.topic = node.resolve(source.topic)
        wait_until(lambda: self._look_up(node), end_s, f"nothing subscribes to {self.topic}")
        message_class = self._class = load_message_class(self.type)
        kind = self.type
        self._fields = source.fields or USUAL_FIELDS.get(kind, ())
        sizes = [self._size(self._target(message_class(), path)[2]) for path in self._fields]
        self._open = len(source.names) - sum(each or 0 for each in sizes)
        if sizes.count(None) > 1 or (None in sizes and self._open < 1):
            raise BadSettings(
                f"{source.place}.names: {kind} needs names, and at most one field of variable size"
            )
        first = self.message(np.zeros(sum(self._open if each is None else each for each in sizes)))
        body = b"".join(first._to_buffers())
        if len(body) > (most := POLICY_STOP_BYTES):
            raise BadSettings(f"{source.place}: the message has {len(body)} bytes: the limit is {most} bytes")
        # Decoding this message as if it were from a bag checks the fields, and returns the names.
        table = table_of(source.topic, kind, message_class._full_text, body)
        self.names = numbers_of(table, source, source.names)[1]
        check_limits(source, len(self.names))
        self.limits = tuple(
            np.broadcast_to(limits or (default,), len(self.names))
            for limits, default in ((source.least, -np.inf), (source.most, np.inf))
        )
        self.stop = self._stop(kind)
        self.publisher = node.advertise(self.topic, message_class, queue_size=1)

    def _look_up(self, node: Node) -> bool:
        self.type = self.source.type or dict(node.master.get_topic_types()).get(self.topic, "")
        return self.type not in ("", "*")

    def check(self, values: NDArray[np.float64]) -> None:
        """Raise `ActionRefused` if the count is wrong, or a number is not finite or outside its limits."""
        if values.shape != (len(self.names),):
            raise ActionRefused(f"{self.source.name} must have {len(self.names)} numbers, got {values.size}")
        for name, value, least, most in zip(self.names, values, *self.limits, strict=True):
            if not np.isfinite(value) or not least <= value <= most:
                what = f"{self.source.name}.{name} must be a number from {least:g} to {most:g}"
                raise ActionRefused(f"{what} {self.source.unit}".rstrip() + f", got {value:g}")

    def has_subscriber(self) -> bool:
        """Return whether a subscriber is connected."""
        return self.publisher.connection_count > 0

    def message(self, values: NDArray[np.float64], now_ns: int = 0) -> Any:
        """Return a message with these numbers. If it has a header, its stamp is `now_ns`."""
        found: Any = self._class()
        if found._has_header:
            found.header.stamp = Time(*divmod(now_ns, NS_PER_S))
        if "name" in found.__slots__:
            found.name = list(self.source.names)
        numbers: Iterator[float] = iter((values / self.source.scale).tolist())
        for path in self._fields:
            target, name, kind = self._target(found, path)
            size = self._size(kind)
            convert = float if kind.partition("[")[0] in FLOATS else round
            cells = [convert(next(numbers)) for _ in range(self._open if size is None else size)]
            setattr(target, name, cells if kind.endswith("]") else cells[0])
        return found

    def _target(self, message: Any, path: str) -> tuple[Any, str, str]:
        """Return the embedded message that contains the field at `path`, with the field's name and type."""
        *above, name = path.split(".")
        try:
            target: Any = reduce(getattr, above, message)
            kind = target._slot_types[target.__slots__.index(name)]
        except (AttributeError, ValueError):
            kind = ""
        if kind.partition("[")[0] not in NUMBERS:
            what = "must be numbers" if kind else f"{message._type} has no such field"
            raise BadSettings(f"{self.source.place}.fields: {path}: {what}")
        return target, name, kind

    @staticmethod
    def _size(kind: str) -> int | None:
        """Return how many numbers a field of this type contains; None for a variable-length array."""
        length = kind.partition("[")[2][:-1]
        return 1 if not kind.endswith("]") else int(length) if length else None

    def _stop(self, kind: str) -> NDArray[np.float64] | None:
        stop = self.source.stop
        if stop == "hold":
            return None
        is_zero = is_stopped_by_zeros(self.source, kind)
        numbers = np.zeros(len(self.names)) if is_zero else np.array(stop or (), np.float64)
        if len(numbers) != len(self.names):
            raise BadSettings(
                f"{self.source.place}.stop: must be zero, hold or {len(self.names)} numbers for {kind}, got "
                f"{len(numbers) or 'nothing'}"
            )
        return numbers
