"""`SimpleFilter`, the base class of filters, and `Subscriber`, which outputs a topic's messages."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import rospy


class SimpleFilter:
    """Base class of filters. Callbacks can be connected to a filter's output."""

    def __init__(self) -> None:
        self.callbacks: dict[int, tuple[Callable[..., object], tuple[Any, ...]]] = {}

    def registerCallback(self, cb: Callable[..., object], *args: Any) -> int:
        """Call `cb` with each output message, followed by `args`. Return the callback's index."""
        number = len(self.callbacks)
        self.callbacks[number] = (cb, args)
        return number

    def signalMessage(self, *msg: Any) -> None:
        """Call all callbacks with a message, in the order of their registration."""
        for callback, more in tuple(self.callbacks.values()):
            callback(*msg, *more)


class Subscriber(SimpleFilter):
    """Filter that outputs the messages received on a topic.

    It has the arguments and attributes of `rospy.Subscriber`. Callbacks run in the same threads as the
    callbacks of a `rospy.Subscriber`.
    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__()
        self.topic = args[0]
        kwargs["callback"] = self.callback
        self.sub = rospy.Subscriber(*args, **kwargs)

    def callback(self, msg: Any) -> None:
        """Pass a message from the topic to the callbacks."""
        self.signalMessage(msg)

    def getTopic(self) -> str:
        """Return the name of the topic as passed to the constructor."""
        return str(self.topic)

    def __getattr__(self, key: str) -> Any:
        if key == "sub":  # the constructor has not set the attribute yet
            raise AttributeError(key)
        return getattr(self.sub, key)


def stamp_of(msg: Any, allow_headerless: bool) -> Any:
    """Return the timestamp of a message.

    For a message without a header, return the current time if `allow_headerless` is true; otherwise log a
    warning and return None.
    """
    try:
        return msg.header.stamp
    except AttributeError:
        if allow_headerless:
            return rospy.Time.now()
    rospy.logwarn(
        "Dropped a message of type %s without a header. "
        "Pass allow_headerless=True to use the time of arrival as its stamp.",
        getattr(msg, "_type", type(msg).__name__),
    )
    return None
