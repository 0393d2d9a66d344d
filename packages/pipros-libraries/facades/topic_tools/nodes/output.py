"""Input and output topics of any type. The first message determines the type."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import rospy
from pipros.basics import names
from pipros.basics.printable import printable
from pipros.node.any_msg import AnyMsg
from pipros_libraries.topic_tools.raw import MissingType, class_like

QUEUE_SIZE = 10


def base_name(topic: str, *others: str) -> str:
    """Return the last component of a topic, which becomes part of the node's name.

    Raises:
        SystemExit: the last component is empty, or the name of one of the topics is invalid.
    """
    name = topic.rstrip("/").rpartition("/")[2]
    if not name:
        raise SystemExit(f'Base name extracted from "{topic}" is an empty string')
    check_names("topic", topic, *others)
    if not names.is_legal_base(name):
        raise SystemExit(f"[{topic}] must end in a valid node name: a letter, then letters, digits or _")
    return name


def check_names(kind: str, *given: str) -> None:
    """Reject invalid names on the command line immediately, without waiting for a master.

    Args:
        kind: `topic` or `service`, used in the error message.

    Raises:
        SystemExit: a name is invalid.
    """
    for name in given:
        canonical = names.canonicalize(name)
        if canonical in ("", "/", "~") or not names.is_legal(canonical):
            raise SystemExit(f"invalid {kind} name: [{printable(name)}]")


class Output(rospy.SubscribeListener):
    """A topic that is advertised once the first message has determined its type. Thread-safe."""

    def __init__(self, topic: str, on_subscriber: Callable[[], object] = lambda: None) -> None:
        """Set up the topic. `on_subscriber` is called in a node thread for each new subscriber."""
        self.topic = topic
        self.has_subscriber = threading.Event()
        self._on_subscriber = on_subscriber
        self._publisher: Any = None
        self._lock = threading.Lock()
        self._refused: set[str] = set()

    @property
    def is_advertised(self) -> bool:
        return self._publisher is not None

    @property
    def subscribers(self) -> int:
        return self._publisher.get_num_connections() if self._publisher is not None else 0

    def advertise_like(self, message: AnyMsg, latch: bool) -> bool:
        """Advertise the topic with the type of a message, unless it is already advertised.

        Return whether this call advertised the topic. A message of unknown type is logged as an error.
        """
        with self._lock:
            if self._publisher is not None:
                return False
            try:
                kind = class_like(message.header)
            except MissingType as error:
                self._complain(str(error))
                return False
            self._publisher = rospy.Publisher(
                self.topic, kind, subscriber_listener=self, latch=latch, queue_size=QUEUE_SIZE
            )
            return True

    def publish(self, message: AnyMsg) -> None:
        """Publish an undecoded message. Drop messages of other types; log this once per sender and type."""
        publisher = self._publisher
        if publisher is None:
            return
        if message.header.get("md5sum") not in (publisher.md5sum, "*"):
            self._complain(
                f"[{printable(message.header.get('callerid', '?'))}] publishes "
                f"{printable(message.header.get('type', '?'))}, "
                f"which cannot be passed on: {self.topic} is {publisher.type}"
            )
            return
        publisher.publish(publisher.data_class(message.body))

    def unregister(self) -> None:
        """Stop advertising the topic."""
        with self._lock:
            publisher, self._publisher = self._publisher, None
        if publisher is not None:
            publisher.unregister()

    def peer_subscribe(self, topic_name: str, topic_publish: Any, peer_publish: Any) -> None:
        del topic_name, topic_publish, peer_publish
        self.has_subscriber.set()
        self._on_subscriber()

    def _complain(self, text: str) -> None:
        if text not in self._refused:
            self._refused.add(text)
            rospy.logerr(text)


class Input:
    """An input topic whose subscription can be switched on and off. Redundant calls have no effect."""

    def __init__(self, topic: str, callback: Callable[[AnyMsg], object]) -> None:
        self.topic = rospy.resolve_name(topic)
        self._callback = callback
        self._subscriber: Any = None
        self._lock = threading.RLock()

    def subscribe(self) -> bool:
        """Subscribe to the topic. Return False if there already was a subscription."""
        with self._lock:
            if self._subscriber is not None:
                return False
            self._subscriber = rospy.Subscriber(self.topic, AnyMsg, self._callback, queue_size=QUEUE_SIZE)
            return True

    def unsubscribe(self) -> bool:
        """Unsubscribe from the topic. Return False if there was no subscription."""
        with self._lock:
            subscriber, self._subscriber = self._subscriber, None
        if subscriber is not None:
            subscriber.unregister()
        return subscriber is not None

    def is_idle(self, output: Output) -> bool:
        """Unsubscribe if `output` has no subscribers. Return True in this case.

        Atomic with respect to `subscribe`.
        """
        with self._lock:
            if not output.subscribers and self.unsubscribe():
                rospy.logdebug("lazy mode; unsubscribing")
        return not output.subscribers


def is_latched(message: AnyMsg) -> bool:
    """Return whether a message's publisher is latching."""
    return message.header.get("latching") == "1"
