"""`rostopic echo -b` and `rostopic list -b`: read a bag, without a master."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from pipros.basics.printable import listed
from pipros_tools.bag.errors import BagError, NotIndexed
from pipros_tools.bag.reader import BagReader
from pipros_tools.cli.runner import CommandError
from pipros_tools.graph.listening import TopicPart
from pipros_tools.graph.message_path import parse_path
from pipros_tools.graph.system_state import is_below

if TYPE_CHECKING:
    from pipros_tools.cli.rostopic.echo_options import EchoOptions


@contextmanager
def opened(path: str) -> Iterator[BagReader]:
    """Context manager that opens the bag at a path, and closes it at the end.

    Raises:
        CommandError: the file does not exist or cannot be read.
    """
    if not Path(path).is_file():
        raise CommandError(f"bag file [{path}] does not exist")
    try:
        bag = BagReader(path)
    except NotIndexed:
        raise CommandError("unable to use bag file: Unindexed bag. Run rosbag reindex") from None
    except (BagError, OSError) as error:
        raise CommandError(f"unable to use bag file: {error}") from error
    with bag:
        try:
            yield bag
        except BagError as error:
            raise CommandError(f"unable to use bag file: {error}") from error


def echo_bag(path: str, topic: str, options: EchoOptions, *, shows_all: bool) -> None:
    """Print the messages on one topic, or on all topics."""
    from pipros_tools.cli.rostopic.printing import MessagePrinter

    topic = topic if topic.startswith("/") else f"/{topic}"
    with opened(path) as bag:
        source = _part(topic, {connection.topic for connection in bag.connections})
        is_over = [False]
        printer = MessagePrinter(options, source, None, lambda: is_over.__setitem__(0, True))
        for name, message, stamp, _ in bag.messages(None if shows_all else source.topic):
            if is_over[0]:
                return
            printer.show_message(message, stamp.to_nsec(), name)


def _part(topic: str, topics: set[str]) -> TopicPart:
    """Split a path such as `/scan/ranges[0]` into a topic in the bag and the rest."""
    words = topic.split("/")
    for count in range(len(words), 1, -1):
        name = "/".join(words[:count])
        if name in topics:
            return TopicPart(name, tuple(parse_path("/".join(words[count:]))))
    return TopicPart(topic, ())


def list_bag(path: str, topic: str | None) -> None:
    """Print the topics in a bag.

    If `topic` is given, print instead the total number of messages on it and on the topics below it, with the
    times of the first and the last message.

    Raises:
        CommandError: the bag cannot be read, or contains no such messages.
    """
    with opened(path) as bag:
        if topic is None:
            print("\n".join(sorted({listed(connection.topic) for connection in bag.connections})))
            return
        seconds = [time[0] for time in bag.times(c for c in bag.connections if is_below(c.topic, topic))]
    if not seconds:
        raise CommandError(f"no messages on [{topic}] in [{path}]")
    print(f"{len(seconds)} message(s) from {_date(seconds[0])} to {_date(seconds[-1])}")


def _date(seconds: int) -> str:
    return time.strftime("%d %b %Y %H:%M:%S", time.localtime(seconds))
