"""Keep the last message of each topic in a description, and extract its values as for a data set."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from pipros.basics.errors import PiprosError
from pipros.msg.bulk.decode import MalformedMessage, decode
from pipros.msg.bulk.plans import plan_of
from pipros.msg.language.spec import DefinitionError
from pipros.node.any_msg import AnyMsg
from pipros_data.datasets.cameras import decoded, picture_of
from pipros_data.datasets.config import CameraSource, SignalSource
from pipros_data.datasets.signals import numbers_of
from pipros_data.table import RECEIPT, Table

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from pipros.node import Node

POLL_S: Final = 0.01


class RobotSilent(PiprosError):
    """A topic of the robot has no message that is recent and complete, or a command has no subscriber."""


class LiveSource:
    """A subscription to a topic in the description, which keeps the last message.

    Attributes:
        names: the names of the numbers; empty before `numbers` is first called, and for a camera.
        type: the type of the last message that was decoded; empty before.
    """

    def __init__(self, node: Node, source: SignalSource | CameraSource, topic: str = "") -> None:
        self.source: Any = source  # Any, because each caller relies on one of the two types
        self.topic = topic or source.topic
        self.names: tuple[str, ...] = ()
        self.type = ""
        self._last: tuple[AnyMsg, float] | None = None
        self._subscriber = node.subscribe(self.topic, AnyMsg, self._receive, queue_size=1)

    def _receive(self, message: AnyMsg) -> None:
        self._last = message, time.monotonic()

    @property
    def age_s(self) -> float:
        """The time since the last message; infinite if there is no message, or no publisher is connected."""
        last = self._last
        return time.monotonic() - last[1] if last and self._subscriber.connection_count else np.inf

    def is_complete(self) -> bool:
        """Return whether the last message has all numbers, or is a valid picture.

        Raises:
            BadSettings: the message does not fit the description.
            PictureError: the encoding of the picture is not supported.
        """
        try:
            return (self.numbers() if isinstance(self.source, SignalSource) else self.picture()) is not None
        except RobotSilent:
            return False

    def numbers(self) -> NDArray[np.float64]:
        """Return the numbers in the last message, converted to the unit in the description.

        Raises:
            RobotSilent: there is no message, it is malformed, or one of its numbers is missing or NaN.
            BadSettings: the message does not fit the description.
        """
        values, self.names = numbers_of(self._table(), self.source, self.source.names)
        if np.isnan(values).any():
            raise RobotSilent(
                f"{self.source.place}: a number in the last message on {self.topic} is missing or NaN"
            )
        row: NDArray[np.float64] = values[0]
        return row

    def picture(self, size: tuple[int, int] | None = None) -> Any:
        """Return the pixels of the last picture (red, green, blue), scaled to the width and height in `size`.

        Raises:
            RobotSilent: there is no picture, or it or its message is damaged.
            PictureError: the encoding is not supported.
        """
        frame = decoded(picture_of(self._table(), 0))
        if frame is None:
            raise RobotSilent(f"{self.source.place}: the last picture on {self.topic} is damaged")
        return frame.reformat(*size or (frame.width, frame.height), "rgb24").to_ndarray()

    def _table(self) -> Table:
        if self._last is None:
            raise RobotSilent(f"{self.source.place}: no message on {self.topic}")
        message, _ = self._last
        self.type = message.header["type"]
        return table_of(self.topic, self.type, message.header["message_definition"], message.body)


def table_of(topic: str, kind: str, definition: str, body: bytes) -> Table:
    """Return a table with a single message. Raise `RobotSilent` if it does not match the definition."""
    try:
        columns = decode(_plan_of(kind, definition), body, np.array([len(body)]))
    except (MalformedMessage, DefinitionError) as error:
        raise RobotSilent(f"the last message on {topic}: {error}") from None
    return Table(topic, kind, {RECEIPT: np.zeros(1, np.int64), **columns})


_plan_of = lru_cache(maxsize=100)(plan_of)


def wait_for_all(sources: list[LiveSource], end_s: float) -> list[LiveSource]:
    """Wait until the last message of each source is complete, and return the sources.

    Raises:
        RobotSilent: a source has no complete message by the monotonic time `end_s`.
        BadSettings: a message does not fit the description.
        PictureError: the encoding of a picture is not supported.
    """
    for each in sources:
        wait_until(each.is_complete, end_s, f"no complete message on {each.topic}")
    return sources


def wait_until(condition: Callable[[], object], end_s: float, problem: str) -> None:
    """Wait for a condition. After the monotonic time `end_s`, raise `RobotSilent` with `problem`."""
    while not condition():
        if time.monotonic() > end_s:
            raise RobotSilent(f"{problem}. Start the missing node first")
        time.sleep(POLL_S)


def full_names(parts: Sequence[Any]) -> tuple[str, ...]:
    """Return the names that data sets use for the numbers of sources or commands, such as `arm.elbow`."""
    return tuple(f"{each.source.short_name}.{name}" for each in parts for name in each.names)
