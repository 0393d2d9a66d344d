"""A tool's subscriptions: wait for topics, and receive messages until the tool ends."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pipros.basics.errors import Interrupted
from pipros.basics.interruptible_wait import OnceEvent
from pipros.msg.class_finder import installed_class
from pipros.net.master_client import MasterClient
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros_tools.graph.message_path import InvalidIndex, PathStep, has_field, parse_path
from pipros_tools.graph.output import to_stderr
from pipros_tools.graph.topics import topic_type

if TYPE_CHECKING:
    from pipros.basics.printable import Say

POLL_PERIOD_S = 0.1
"""Interval for polling the master for a topic that is not registered yet."""


@dataclass(frozen=True, slots=True)
class TopicPart:
    """A topic, and optionally a field of its messages."""

    topic: str
    path: tuple[PathStep, ...]


def _never() -> bool:
    return False


def wait_for_topic(
    master: MasterClient,
    name: str,
    *,
    warn: Say = to_stderr,
    is_over: Callable[[], bool] = _never,
    pause: Callable[[float], object] = time.sleep,
) -> TopicPart:
    """Return the topic and field to which `name` refers.

    Block until a topic with this field is registered at the master, or until Ctrl-C. If none is registered
    yet, call `warn` once.

    Raises:
        Interrupted: `is_over` returned true before the topic was registered.
    """
    has_warned = False
    while not is_over():
        type_name, topic = topic_type(master, name.partition("[")[0])
        if type_name is not None:
            part = TopicPart(topic, _parse(name[len(topic) :], warn))
            message_class = installed_class(type_name)
            if message_class is None or has_field(message_class, part.path):
                return part
        if not has_warned:
            has_warned = True
            warn(f"WARNING: topic [{name}] does not appear to be published yet")
        pause(POLL_PERIOD_S)
    raise Interrupted(f"gave up waiting for topic [{name}]")


def _parse(path: str, warn: Say) -> tuple[PathStep, ...]:
    try:
        return tuple(parse_path(path))
    except InvalidIndex as error:  # as in Noetic, warn and show the whole message
        warn(str(error))
        return ()


class Listening:
    """A tool's subscriptions. A callback or the main thread may end them."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._is_over = OnceEvent()
        self._error: BaseException | None = None
        node.on_shutdown(self._is_over.set)

    def subscribe(
        self, topic: str, callback: Callable[[AnyMsg], object], *, tcp_nodelay: bool = False
    ) -> None:
        """Call `callback` with each undecoded message. `wait` reraises exceptions from the callback."""

        def guarded(message: AnyMsg) -> None:
            if self._is_over.is_set():
                return
            try:
                callback(message)
            except BaseException as error:  # `wait` reraises it
                self._error = error
                self._is_over.set()

        self._node.subscribe(topic, AnyMsg, guarded, tcp_nodelay=tcp_nodelay)

    def finish(self) -> None:
        """End the wait. No callback is called afterwards."""
        self._is_over.set()

    def wait(self, timeout_s: float | None = None) -> bool:
        """Wait until the tool should end; return False if `timeout_s` expires first.

        If a callback raised an exception, reraise it.
        """
        is_over = self._is_over.wait(timeout_s)
        if self._error is not None:
            raise self._error
        return is_over
