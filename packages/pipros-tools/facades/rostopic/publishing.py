"""Python API of `rostopic pub`."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain, islice, repeat
from pathlib import Path
from typing import Any

import rosgraph
import rosparam
import rospy
from pipros.basics.input_file import read_text
from pipros.msg.base import Message
from pipros.safe import yaml
from pipros.safe.yaml import YamlError
from pipros_tools.graph.errors import GraphError
from pipros_tools.graph.message_from_yaml import message_from_yaml
from rospy.session import session
from rostopic.errors import ROSTopicException

SUBSCRIBER_TIMEOUT = 5.0
"""Maximum time to wait for a subscriber before publishing YAML documents, in seconds."""

ONCE_S = 3.0
POLL_PERIOD_S = 0.05

Documents = Callable[[], Iterator[list[Any]]]


def create_publisher(
    topic_name: str, topic_type: str, latch: bool, disable_rostime: bool = True
) -> tuple[rospy.Publisher[Any], type[Message]]:
    """Start an anonymous node and advertise a topic. Return the publisher and the message class.

    Raises:
        ROSTopicException: the type does not exist.
    """
    from pipros.msg.class_finder import installed_class

    message_class = installed_class(topic_type)
    if message_class is None:
        raise ROSTopicException(f"invalid message type: {topic_type}. Is its package on ROS_PACKAGE_PATH?")
    topic_name = rosgraph.names.script_resolve_name("rostopic", topic_name)
    rospy.init_node("rostopic", anonymous=True, disable_rosout=True, disable_rostime=disable_rostime)
    return rospy.Publisher(topic_name, message_class, latch=latch, queue_size=100), message_class


def publish_message(
    pub: rospy.Publisher[Any],
    msg_class: type[Message],
    pub_args: Sequence[Any],
    rate: float | None = None,
    once: bool = False,
    verbose: bool = False,
    substitute_keywords: bool = False,
) -> None:
    """Publish a message with the given values, either at a rate or latched until the node is shut down.

    Args:
        rate: rate in Hz until the node is shut down; None to publish a single message.
        once: whether to return after publishing a single message; otherwise, or if `rate` is set, block until
            the node is shut down.
        verbose: whether to print each message.
        substitute_keywords: whether to update times given as `now` and headers given as `auto` for
            each message.

    Raises:
        ROSTopicException: the values do not match the type.
    """
    make = _maker(msg_class, pub_args)
    message = make()
    if rate is None:
        _latch(pub, message, once, verbose)
        return
    for _ in _ticks(rate):
        if substitute_keywords:
            message = make()
        if verbose:
            print(f"publishing {message}", flush=True)
        pub.publish(message)


def _latch(pub: rospy.Publisher[Any], message: Message, once: bool, verbose: bool) -> None:
    shown = f"[{message}]" if verbose else "message"
    end = f" for {ONCE_S} seconds" if once else ". Press ctrl-C to terminate"
    print(f"publishing and latching {shown}{end}", flush=True)
    pub.publish(message)
    if not once:
        rospy.spin()


def argv_publish(
    pub: rospy.Publisher[Any],
    msg_class: type[Message],
    pub_args: Sequence[Any],
    rate: float | None,
    once: bool,
    verbose: bool,
    substitute_keywords: bool = False,
) -> None:
    """Like `publish_message`. If `once` is true, keep the latched message available for 3 seconds."""
    publish_message(pub, msg_class, pub_args, rate, once, verbose, substitute_keywords)
    if once:
        session.wait(ONCE_S)


def stdin_publish(
    pub: rospy.Publisher[Any],
    msg_class: type[Message],
    rate: float | None,
    once: bool,
    filename: str | None,
    verbose: bool,
) -> None:
    """Publish a message for each YAML document in a file or on standard input.

    Wait up to `SUBSCRIBER_TIMEOUT` for a subscriber first. If `once` is true, publish only the first message.
    If `rate` (Hz) is set, publish at this rate; if a file has only one document, publish it repeatedly, even
    if `once` is true. If neither is set, the first message is latched until the node is shut down.

    Raises:
        ROSTopicException: the file does not exist, the YAML is invalid, or values do not match the type.
    """
    documents = file_yaml_arg(filename) if filename else stdin_yaml_arg
    if filename is not None and rate is not None and len(list(islice(documents(), 2))) == 1:
        wait_for_subscriber(pub, SUBSCRIBER_TIMEOUT)
        print("Got one message and a rate, publishing repeatedly", flush=True)
        publish_message(pub, msg_class, next(documents()), rate, once, verbose)
        return
    wait_for_subscriber(pub, SUBSCRIBER_TIMEOUT)
    _publish_each(pub, msg_class, documents(), rate, once, verbose)


def _publish_each(
    pub: rospy.Publisher[Any],
    msg_class: type[Message],
    documents: Iterator[list[Any]],
    rate: float | None,
    once: bool,
    verbose: bool,
) -> None:
    for values, _ in zip(documents, _ticks(rate) if rate else repeat(None), strict=False):
        publish_message(pub, msg_class, values, None, rate is not None or once, verbose)
        if once or rospy.is_shutdown():
            return


def param_publish(
    pub: rospy.Publisher[Any], msg_class: type[Message], param_name: str, rate: float, verbose: bool
) -> None:
    """Publish the current value of a parameter at a rate in Hz, until the node is shut down.

    Raises:
        rosgraph.MasterError: the parameter is not set.
        ROSTopicException: the values do not match the type.
    """
    for _ in _ticks(rate):
        _publish(pub, msg_class, _values_of(param_name), verbose)


def param_publish_once(
    pub: rospy.Publisher[Any], msg_class: type[Message], param_name: str, verbose: bool
) -> None:
    """Publish the value of a parameter once; see `publish_message`."""
    publish_message(pub, msg_class, _values_of(param_name), None, True, verbose)


def wait_for_subscriber(pub: rospy.Publisher[Any], timeout: float) -> None:
    """Wait until the topic has a subscriber, for at most `timeout` seconds."""
    deadline = time.monotonic() + timeout
    while pub.get_num_connections() == 0 and time.monotonic() < deadline and not rospy.is_shutdown():
        rospy.rostime.wallsleep(POLL_PERIOD_S)


def file_yaml_arg(filename: str) -> Documents:
    """Return a generator function for the YAML documents in a file, each as a message's values.

    Raises:
        ROSTopicException: the file does not exist. The generator raises this error for invalid YAML.
    """
    if not Path(filename).is_file():
        raise ROSTopicException(f"file does not exist: {filename}")

    def documents() -> Iterator[list[Any]]:
        try:
            for document in yaml.load_all(read_text(filename), filename):
                yield [document]
        except YamlError as error:
            raise ROSTopicException(f"invalid YAML in file: {error}") from None
        except UnicodeDecodeError as error:
            raise ROSTopicException(f"cannot read {filename}: {error}") from None

    return documents


def stdin_yaml_arg() -> Iterator[list[Any]]:
    """Yield the YAML documents on standard input as they arrive, each as a message's values.

    Raises:
        ROSTopicException: a document is not valid YAML.
    """
    lines: list[str] = []
    for line in chain(sys.stdin, [] if sys.stdin.isatty() else ["---\n"]):
        if not line.startswith("---"):
            lines.append(line)
            continue
        text, lines = "".join(lines), []
        if text.strip():
            try:
                yield [yaml.load(text, "<stdin>")]
            except YamlError as error:
                raise ROSTopicException(f"invalid YAML: {error}") from None


def _values_of(param_name: str) -> list[Any]:
    value = rosparam.get_param(param_name)
    return value if isinstance(value, list) else [value]


def _publish(
    pub: rospy.Publisher[Any], msg_class: type[Message], values: Sequence[Any], verbose: bool
) -> None:
    message = _maker(msg_class, values)()
    if verbose:
        print(f"publishing {message}", flush=True)
    pub.publish(message)


def _maker(msg_class: type[Message], values: Sequence[Any]) -> Callable[[], Message]:
    def make() -> Message:
        try:
            return message_from_yaml(msg_class, list(values), rospy.get_rostime().to_nsec())
        except GraphError as error:
            raise ROSTopicException(str(error)) from None

    return make


def _ticks(rate_hz: float) -> Iterable[None]:
    """Yield immediately and then at the given rate, until the node is shut down."""
    period_s = 1.0 / rate_hz
    due = time.monotonic()
    for _ in repeat(None):
        if rospy.is_shutdown():
            return
        yield
        due += period_s
        rospy.rostime.wallsleep(due - time.monotonic())
