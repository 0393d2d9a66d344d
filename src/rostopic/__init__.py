"""`rostopic` for Python code: the topics, their types and classes, and measuring them.

Facade of `pipros.cli.rostopic`; see http://wiki.ros.org/rostopic.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from pipros.cli.program import NO_MASTER, CommandError, Surroundings
from pipros.cli.rostopic import fields as _fields
from pipros.cli.rostopic import info as _info
from pipros.cli.rostopic import listening as _listening
from pipros.cli.rostopic import main as _main
from pipros.cli.rostopic import types as _types
from pipros.cli.rostopic.raw import installed_class
from pipros.errors import Unreachable
from pipros.graph.picture import Picture
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
def _surroundings() -> Iterator[Surroundings]:
    try:
        with Surroundings("rostopic") as here:
            yield here
    except Unreachable:
        raise ROSTopicIOException(NO_MASTER) from None
    except CommandError as error:
        raise ROSTopicException(str(error)) from None


def get_topic_type(
    topic: str, blocking: bool = False
) -> tuple[str, str, MessageEval | None] | tuple[None, None, None]:
    """The type of a topic, its full name, and what takes the field out of a message that `topic` names.

    `blocking` waits until there is such a topic. Without one, three times None.
    """
    with _surroundings() as here:
        name = here.resolve(topic)
        if blocking:
            name = _full_name(_listening.wait_for_source(here.master, name))
        type_name, real_topic = _types.topic_type(here.master, name.partition("[")[0])
    if type_name is None:
        return None, None, None
    return type_name, real_topic, msgevalgen(name[len(real_topic) :])


def _full_name(source: _listening.Source) -> str:
    return source.topic + _fields.describe_path(source.path)


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
    path = _fields.parse_path(pattern)
    return (lambda message: _fields.extract(message, path).value) if path else None


def get_topic_list(master: object = None) -> tuple[list[tuple[str, str, list[str]]], ...]:  # noqa: ARG001
    """Publications and subscriptions, each as `[(topic, type, [node, …]), …]`."""
    with _surroundings() as here:
        picture = Picture.from_state(here.master.get_system_state())
        types = dict(here.master.get_topic_types())
    return tuple(
        [(topic, types.get(topic, "unknown type"), list(nodes)) for topic, nodes in kind.items()]
        for kind in (picture.publishers, picture.subscribers)
    )


def find_by_type(topic_type: str) -> list[str]:
    """The topics of a message type."""
    with _surroundings() as here:
        return _info.topics_of_type(here.master, topic_type)


def get_info_text(topic: str) -> str:
    """What `rostopic info` prints.

    Raises:
        ROSTopicException: nobody publishes or subscribes the topic.
    """
    with _surroundings() as here:
        return _info.describe_topic(here.master, here.resolve(topic))


def rostopicmain(argv: Sequence[str] | None = None) -> None:
    """The command `rostopic`; ends the process. The first argument is the name of the program."""
    sys.exit(_main(None if argv is None else argv[1:]))
