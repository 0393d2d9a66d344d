"""Python API of `rostopic`: topics, their types and classes, and statistics.

Unless stated otherwise, functions raise `ROSTopicIOException` if the master cannot be reached.
Facade of `pipros_tools.graph`; see http://wiki.ros.org/rostopic.
"""

from __future__ import annotations

import contextlib
import errno
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any
from urllib.parse import urlsplit as _urlsplit

import rosgraph
import rospy
from pipros.basics.errors import Interrupted, NotFound, Unreachable
from pipros.msg.class_finder import installed_class
from pipros_tools.cli.rostopic import main as _main
from pipros_tools.graph import listening as _listening
from pipros_tools.graph import message_path as _message_path
from pipros_tools.graph import topics as _topics
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.errors import translated
from pipros_tools.graph.system_state import SystemState
from rostopic.echo import CallbackEcho, create_field_filter, create_value_transform
from rostopic.errors import ROSTopicException, ROSTopicIOException
from rostopic.measures import ROSTopicBandwidth, ROSTopicDelay, ROSTopicHz
from rostopic.publishing import (
    SUBSCRIBER_TIMEOUT,
    argv_publish,
    create_publisher,
    file_yaml_arg,
    param_publish,
    param_publish_once,
    publish_message,
    stdin_publish,
    stdin_yaml_arg,
    wait_for_subscriber,
)

__all__ = [
    "NAME",
    "SUBSCRIBER_TIMEOUT",
    "CallbackEcho",
    "ROSTopicBandwidth",
    "ROSTopicDelay",
    "ROSTopicException",
    "ROSTopicHz",
    "ROSTopicIOException",
    "argv_publish",
    "create_field_filter",
    "create_publisher",
    "create_value_transform",
    "file_yaml_arg",
    "find_by_type",
    "get_api",
    "get_info_text",
    "get_topic_class",
    "get_topic_list",
    "get_topic_type",
    "msgevalgen",
    "param_publish",
    "param_publish_once",
    "publish_message",
    "rostopicmain",
    "stdin_publish",
    "stdin_yaml_arg",
    "wait_for_subscriber",
]

NAME = "rostopic"

MessageEval = Callable[[Any], Any]


@contextlib.contextmanager
def _graph() -> Iterator[GraphClient]:
    with translated(ROSTopicIOException, ROSTopicException), GraphClient("rostopic") as graph:
        yield graph


def get_topic_type(
    topic: str, blocking: bool = False
) -> tuple[str, str, MessageEval | None] | tuple[None, None, None]:
    """Return a topic's type and full name, and a function that extracts the field named in `topic`.

    The function is None if `topic` does not contain a field. If the topic does not exist, return (None, None,
    None). If `blocking` is true, wait until the topic exists or the node is shut down. `topic` is not
    resolved, so a relative name never matches.
    """
    with _graph() as graph:
        name = topic
        if blocking:
            try:
                source = _listening.wait_for_topic(graph.master, name, is_over=rospy.is_shutdown)
            except Interrupted:
                return None, None, None
            name = _full_name(source)
        type_name, real_topic = _topics.topic_type(graph.master, name.partition("[")[0])
    if type_name is None:
        return None, None, None
    return type_name, real_topic, msgevalgen(name[len(real_topic) :])


def _full_name(source: _listening.TopicPart) -> str:
    return source.topic + _message_path.describe_path(source.path)


def get_topic_class(
    topic: str, blocking: bool = False
) -> tuple[type[Any], str, MessageEval | None] | tuple[None, None, None]:
    """Like `get_topic_type`, but return the message class instead of the type name.

    Raises:
        ROSTopicException: the message class cannot be loaded.
    """
    type_name, real_topic, message_eval = get_topic_type(topic, blocking)
    if type_name is None or real_topic is None:
        return None, None, None
    message_class = installed_class(type_name)
    if message_class is None:
        raise ROSTopicException(f"Cannot load message class for [{type_name}]. Are your messages built?")
    return message_class, real_topic, message_eval


def msgevalgen(pattern: str) -> MessageEval | None:
    """Return a function that extracts a field from a message: `msgevalgen("/header/stamp")(message)`.

    Return None for an empty pattern or a malformed index. Errors are printed to standard error; the function
    returns None if a message does not have the field.
    """
    try:
        path = _message_path.parse_path(pattern)
    except _message_path.InvalidIndex as error:
        print(error, file=sys.stderr)
        return None
    if not path:
        return None

    def evaluate(message: Any) -> Any:
        try:
            return _message_path.extract(message, path).value
        except (NotFound, IndexError) as error:
            print(f"{error} in {pattern}", file=sys.stderr)
            return None

    return evaluate


def get_topic_list(master: object = None) -> tuple[list[tuple[str, str, list[str]]], ...]:  # noqa: ARG001
    """Return the publications and subscriptions, each as `[(topic, type, [node, …]), …]`.

    `master` is ignored.

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


def get_api(master: rosgraph.Master, caller_id: str) -> str:
    """Return the URI of a node's slave API, or `unknown address NAME` for an unknown node.

    Raises:
        ROSTopicIOException: the master cannot be reached.
    """
    try:
        return master.lookupNode(caller_id)
    except rosgraph.MasterError:
        return f"unknown address {caller_id}"
    except OSError:
        raise ROSTopicIOException("Unable to communicate with master!") from None


def find_by_type(topic_type: str) -> list[str]:
    """Return the topics with the given message type."""
    with _graph() as graph:
        return _topics.topics_of_type(graph.master, topic_type)


def get_info_text(topic: str) -> str:
    """Return the output of `rostopic info`.

    Raises:
        ROSTopicException: the topic has neither publishers nor subscribers.
    """
    with _graph() as graph:
        return _topics.describe_topic(graph.master, graph.resolve(topic))


def rostopicmain(argv: Sequence[str] | None = None) -> None:
    """Run the command `rostopic`. `argv` starts with the program's name.

    Raises:
        SystemExit: the command failed, or its arguments are invalid.
    """
    if code := _main(None if argv is None else argv[1:]):
        sys.exit(code)


_get_topic_type = get_topic_type


_Topics = Sequence[tuple[str, str, Sequence[str]]]
_TopicsByHost = dict[str | None, list[tuple[str, str, list[str]]]]


def _rostopic_list_group_by_host(
    master: rosgraph.Master, pubs: _Topics, subs: _Topics
) -> tuple[_TopicsByHost, _TopicsByHost]:
    """Group publications and subscriptions, as returned by `get_topic_list`, by the hosts of their nodes.

    Other packages call this function. It queries the master once for each node, and raises the master's
    errors.
    """
    uris: dict[str, str] = {}

    def grouped(topics: _Topics) -> _TopicsByHost:
        hosts: dict[str | None, dict[str, tuple[str, str, list[str]]]] = {}
        for topic, type_name, nodes in topics:
            for node in nodes:
                if node not in uris:
                    uris[node] = master.lookupNode(node)
                on_host = hosts.setdefault(_urlsplit(uris[node]).hostname, {})
                on_host.setdefault(topic, (topic, type_name, []))[2].append(node)
        return {host: list(on_host.values()) for host, on_host in hosts.items()}

    return grouped(pubs), grouped(subs)
