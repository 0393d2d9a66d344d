"""What all filters have in common, and the filter that a topic feeds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import rospy


class SimpleFilter:
    """Something with an output that callbacks can be connected to."""

    def __init__(self) -> None:
        self.callbacks: dict[int, tuple[Callable[..., object], tuple[Any, ...]]] = {}

    def registerCallback(self, cb: Callable[..., object], *args: Any) -> int:
        """Calls `cb` with each output, followed by `args`. Returns the number of the connection."""
        number = len(self.callbacks)
        self.callbacks[number] = (cb, args)
        return number

    def signalMessage(self, *msg: Any) -> None:
        """Passes an output to all callbacks, in the order of their connection."""
        for callback, more in tuple(self.callbacks.values()):
            callback(*msg, *more)


class Subscriber(SimpleFilter):
    """The messages of a topic. Takes the arguments of `rospy.Subscriber`, and has its attributes."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__()
        self.topic = args[0]
        kwargs["callback"] = self.callback
        self.sub = rospy.Subscriber(*args, **kwargs)

    def callback(self, msg: Any) -> None:
        """Called with each message of the topic."""
        self.signalMessage(msg)

    def getTopic(self) -> str:
        """The name of the topic, as it was given."""
        return str(self.topic)

    def __getattr__(self, key: str) -> Any:
        if key == "sub":  # not there yet, or no more
            raise AttributeError(key)
        return getattr(self.sub, key)


def stamp_of(msg: Any, allow_headerless: bool) -> Any:
    """The stamp of a message.

    The current time for one without header where that is allowed, otherwise None.
    """
    try:
        return msg.header.stamp
    except AttributeError:
        if allow_headerless:
            return rospy.Time.now()
    rospy.logwarn(
        "A message of type %s has no header with a stamp, and is dropped. "
        "With allow_headerless=True the time of its arrival counts.",
        getattr(msg, "_type", type(msg).__name__),
    )
    return None
