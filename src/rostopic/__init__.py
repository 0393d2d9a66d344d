"""`rostopic` for Python code: the topics, their types and classes, and measuring them.

Facade of `pipros.graph`; see http://wiki.ros.org/rostopic.
"""

from __future__ import annotations

import contextlib
import errno
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from pipros.cli.rostopic import main as _main
from pipros.errors import Unreachable
from pipros.graph import listening as _listening
from pipros.graph import message_path as _message_path
from pipros.graph import topics as _topics
from pipros.graph.client import GraphClient
from pipros.graph.errors import translated
from pipros.graph.message_classes import installed_class
from pipros.graph.system_state import SystemState
from rostopic.measures import ROSTopicBandwidth, ROSTopicDelay, ROSTopicHz

__all__ = [
    "ROSTopicBandwidth",
    "ROSTopicDelay",
    "ROSTopicException",
    "ROSTopicHz",
    "ROSTopicIOException",
    "find_by_type",
    "get_info_text",
    "get_topic_class",
    "get_topic_list",
    "get_topic_type",
    "msgevalgen",
    "rostopicmain",
]

MessageEval = Callable[[Any], Any]


class ROSTopicException(Exception):
    """A rostopic function failed."""


class ROSTopicIOException(ROSTopicException):
    """The master does not answer."""


@contextlib.contextmanager
def _graph() -> Iterator[GraphClient]:
    with translated(ROSTopicIOException, ROSTopicException), GraphClient("rostopic") as graph:
        yield graph


def get_topic_type(
    topic: str, blocking: bool = False
) -> tuple[str, str, MessageEval | None] | tuple[None, None, None]:
    """The type of a topic, its full name, and what takes the field out of a message that `topic` names.

    `blocking` waits until there is such a topic. Without one, three times None.
    """
    with _graph() as graph:
        name = graph.resolve(topic)
        if blocking:
            name = _full_name(_listening.wait_for_topic(graph.master, name))
        type_name, real_topic = _topics.topic_type(graph.master, name.partition("[")[0])
    if type_name is None:
        return None, None, None
    return type_name, real_topic, msgevalgen(name[len(real_topic) :])


def _full_name(source: _listening.TopicPart) -> str:
    return source.topic + _message_path.describe_path(source.path)


def get_topic_class(
    topic: str, blocking: bool = False
) -> tuple[type[Any], str, MessageEval | None] | tuple[None, None, None]:
    """As `get_topic_type`, with the class instead of the type's name.

    Raises:
        ROSTopicException: the type is not on the path.
    """
    type_name, real_topic, message_eval = get_topic_type(topic, blocking)
    if type_name is None or real_topic is None:
        return None, None, None
    message_class = installed_class(type_name)
    if message_class is None:
        raise ROSTopicException(f"Cannot load message class for [{type_name}]. Are your messages built?")
    return message_class, real_topic, message_eval


def msgevalgen(pattern: str) -> MessageEval | None:
    """What takes a field out of a message: `msgevalgen("/header/stamp")(message)`. None for no field."""
    path = _message_path.parse_path(pattern)
    return (lambda message: _message_path.extract(message, path).value) if path else None


def get_topic_list(master: object = None) -> tuple[list[tuple[str, str, list[str]]], ...]:  # noqa: ARG001
    """Publications and subscriptions, each as `[(topic, type, [node, …]), …]`.

    Raises:
        ConnectionRefusedError: the master cannot be reached.
    """
    with GraphClient("rostopic") as graph:
        try:
            state = SystemState.from_state(graph.master.get_system_state())
            types = dict(graph.master.get_topic_types())
        except Unreachable as error:
            raise ConnectionRefusedError(errno.ECONNREFUSED, str(error)) from error
    return tuple(
        [(topic, types.get(topic, "unknown type"), list(nodes)) for topic, nodes in kind.items()]
        for kind in (state.publishers, state.subscribers)
    )


def find_by_type(topic_type: str) -> list[str]:
    """The topics of a message type."""
    with _graph() as graph:
        return _topics.topics_of_type(graph.master, topic_type)


def get_info_text(topic: str) -> str:
    """What `rostopic info` prints.

    Raises:
        ROSTopicException: nobody publishes or subscribes the topic.
    """
    with _graph() as graph:
        return _topics.describe_topic(graph.master, graph.resolve(topic))


def rostopicmain(argv: Sequence[str] | None = None) -> None:
    """The command `rostopic`; ends the process. The first argument is the name of the program."""
    sys.exit(_main(None if argv is None else argv[1:]))
