"""`rostopic pub`: publishes messages on a topic."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from io import TextIOWrapper
from itertools import islice
from optparse import OptionParser
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipros.basics.input_file import open_file
from pipros.basics.names import parse_arguments
from pipros_tools.cli.runner import CommandError, option_parser
from pipros_tools.graph.client import GraphClient

if TYPE_CHECKING:
    from pipros.msg.base import Message
    from pipros.node import Node, Publisher

ONCE_S = 3.0
"""Time for which a message from the command line stays available with `--once`."""
DOCUMENTS_RATE_HZ = 10.0
QUEUE_SIZE = 100
LINK_DEADLINE_S = 1.0
"""Maximum wait for existing subscribers to connect, so that they get the first message."""
SUBSCRIBER_DEADLINE_S = 5.0
"""Maximum wait for a subscriber before messages from a file or a pipe are published."""
POLL_PERIOD_S = 0.01


@dataclass(frozen=True, slots=True)
class PubOptions:
    """The messages to publish, and their rate.

    Attributes:
        topic, type_name: the topic and its type, as given on the command line.
        words: YAML values from the command line; empty if the values come from a file or a pipe.
        file: path of a file with YAML documents, one per message; None if not given.
        rate_hz: the rate; None if not given.
        once: whether to exit after one message.
        latch: whether later subscribers get the last message, even if there is a rate. Without a rate, only
            the first message from a file or pipe is published.
        verbose: whether to print each message.
        substitute: whether to replace `now` and `auto` with each message's publishing time.
        ros_time: whether to take these times from ROS time, which may be simulated.
    """

    topic: str
    type_name: str
    words: tuple[str, ...]
    file: str | None
    rate_hz: float | None
    once: bool
    latch: bool
    verbose: bool
    substitute: bool
    ros_time: bool


def publish(argv: Sequence[str]) -> int:
    parser, options = _parse(list(parse_arguments(argv).rest))
    with GraphClient("rostopic") as graph:
        graph.master.get_pid()  # fails immediately if there is no master
    from pipros_tools.cli.command_node import command_node
    from pipros_tools.cli.rostopic.pub_values import MessageTemplate, message_class_of, read_values

    message_class = message_class_of(options.type_name)
    values = read_values(parser, options.words)
    if not values and options.file is None:
        if not message_class.__slots__:
            values = []
        elif sys.stdin.isatty():
            parser.error("Please specify message values")
    template = MessageTemplate(message_class)
    with command_node("rostopic", argv) as node:
        now_ns = node.clock.now_ns if options.ros_time else time.time_ns
        run = _Publishing(node, options, message_class)
        if values is not None:
            run.publish_values(lambda: template.fill(values, now_ns()))
        else:
            run.publish_documents(
                _documents(options.file), lambda document: template.fill([document], now_ns())
            )
    return 0


class _Publishing:
    """Publication of the messages of one command."""

    def __init__(self, node: Node, options: PubOptions, message_class: type[Message]) -> None:
        self._node = node
        self._options = options
        self._message_class = message_class

    def publish_values(self, make: Callable[[], Message]) -> None:
        """Publish the message from the command line: at the rate if there is one, otherwise once, latched."""
        options, first = self._options, make()
        if options.rate_hz is None:
            publisher = self._advertise(latch=True)
            self._announce(first, ends=options.once)
            publisher.publish(first)
            self._wait(ONCE_S if options.once else None)
            return
        publisher = self._advertise(latch=options.latch)
        message = first
        for _ in self._ticks(options.rate_hz):
            if options.substitute:
                message = make()
            self._print_message(message)
            publisher.publish(message)

    def publish_documents(self, documents: Iterator[Any], make: Callable[[Any], Message]) -> None:
        """Publish the messages in order, at a rate.

        If `once` is true, or if `latch` is true and there is no rate, publish only the first message. If a
        file contains only one message, repeat it at the rate, by default 10 Hz.
        """
        options, rate_hz = self._options, self._options.rate_hz
        # queue_size=None: `publish` blocks until the message has been sent
        publisher = self._advertise(latch=rate_hz is None or options.latch, queue_size=None)
        self._wait_for_subscriber(publisher)
        if rate_hz is None and (options.once or options.latch):
            for document in islice(documents, 1):
                message = make(document)
                self._announce(message, ends=options.once)
                publisher.publish(message)
                self._wait(0 if options.once else None)
            return
        if _is_one_document(options.file):
            print("Got one message and a rate, publishing repeatedly", flush=True)
            self._repeat(publisher, make(next(documents)), rate_hz or DOCUMENTS_RATE_HZ)
            return
        for document, _ in zip(documents, self._ticks(rate_hz or DOCUMENTS_RATE_HZ), strict=False):
            message = make(document)
            self._announce(message, ends=True)
            publisher.publish(message)

    def _repeat(self, publisher: Publisher[Any], message: Message, rate_hz: float) -> None:
        for _ in self._ticks(rate_hz):
            self._print_message(message)
            publisher.publish(message)

    def _wait_for_subscriber(self, publisher: Publisher[Any]) -> None:
        """Wait up to `SUBSCRIBER_DEADLINE_S` for a subscriber.

        Subscribers that poll for topics can then receive the first message.
        """
        deadline = time.monotonic() + SUBSCRIBER_DEADLINE_S
        while publisher.connection_count == 0 and time.monotonic() < deadline and not self._node.is_shutdown:
            self._wait(POLL_PERIOD_S)

    def _advertise(self, *, latch: bool, queue_size: int | None = QUEUE_SIZE) -> Publisher[Any]:
        """Advertise the topic, and wait up to `LINK_DEADLINE_S` for its existing subscribers."""
        publisher = self._node.advertise(
            self._options.topic, self._message_class, queue_size=queue_size, latch=latch
        )
        expected = dict(self._node.master.get_system_state()[1]).get(publisher.topic, [])
        deadline = time.monotonic() + LINK_DEADLINE_S
        while publisher.connection_count < len(expected) and time.monotonic() < deadline:
            self._wait(POLL_PERIOD_S)
        if not publisher.connection_count and not self._node.is_shutdown:
            _warn_of_silence(expected)
        return publisher

    def _ticks(self, rate_hz: float) -> Iterator[None]:
        """Yield immediately, then at the given rate, until the node shuts down."""
        clock, period_s = self._node.clock, 1.0 / rate_hz
        due = time.monotonic()
        while not self._node.is_shutdown:
            yield
            due += period_s
            if clock.is_simulated and self._options.ros_time:
                clock.sleep(period_s)
            else:
                self._wait(max(due - time.monotonic(), 0))

    def _wait(self, timeout_s: float | None) -> None:
        self._node.wait_for_shutdown(timeout_s)

    def _announce(self, message: Message, *, ends: bool) -> None:
        shown = f"[{message}]" if self._options.verbose else "message"
        end = f" for {ONCE_S} seconds" if ends else ". Press ctrl-C to terminate"
        print(f"publishing and latching {shown}{end}", flush=True)

    def _print_message(self, message: Message) -> None:
        if self._options.verbose:
            print(f"publishing {message}", flush=True)


def _warn_of_silence(subscribers: Sequence[str]) -> None:
    """Warn that no registered subscriber has connected yet. Do nothing if no subscriber is registered."""
    if subscribers:
        names, verbs = (
            ", ".join(subscribers),
            ("subscribe", "have") if subscribers[1:] else ("subscribes", "has"),
        )
        print(
            f"{names} {verbs[0]}, but {verbs[1]} not connected to this publisher. If a subscriber's "
            "machine cannot reach this machine, ROS_IP is wrong or a firewall blocks it: ask `pipros doctor`",
            file=sys.stderr,
            flush=True,
        )


def _is_one_document(file: str | None) -> bool:
    return file is not None and len(list(islice(_documents(file), 2))) == 1


def _documents(file: str | None) -> Iterator[Any]:
    """Yield the YAML documents in a file, or the documents from standard input as they arrive."""
    from pipros_tools.cli.yaml_args import documents_of

    if file is None:
        yield from documents_of(sys.stdin)
        return
    try:
        with TextIOWrapper(open_file(file), encoding="utf-8") as lines:
            yield from documents_of(lines, file)
    except UnicodeDecodeError as error:
        raise CommandError(f"cannot read {file}: {error}") from None


def _parse(argv: list[str]) -> tuple[OptionParser, PubOptions]:
    parser = option_parser("rostopic", "pub /topic type [args...]")
    add = parser.add_option
    add("-v", dest="verbose", action="store_true", default=False, help="print verbose output")
    add(
        "-r",
        "--rate",
        dest="rate",
        metavar="RATE",
        help="publishing rate (hz).  For -f and stdin input, this defaults to 10.  Otherwise it is not set.",
    )
    add("-1", "--once", dest="once", action="store_true", default=False, help="publish one message and exit")
    add("-f", "--file", dest="file", metavar="FILE", help="read args from YAML file (Bagy)")
    add(
        "-l",
        "--latch",
        dest="latch",
        action="store_true",
        default=False,
        help="enable latching for -f, -r and piped input.  This latches the first message.",
    )
    add(
        "-s",
        "--substitute-keywords",
        dest="substitute",
        action="store_true",
        default=False,
        help="When publishing with a rate, performs keyword ('now' or 'auto') substitution for each message",
    )
    add(
        "--use-rostime",
        dest="ros_time",
        action="store_true",
        default=False,
        help="use rostime for time stamps, else walltime is used",
    )
    options, arguments = parser.parse_args(argv)
    rate_hz = _rate(parser, options.rate)
    if rate_hz is not None and options.once:
        parser.error("You cannot select both -r and -1 (--once)")
    if not arguments:
        parser.error("/topic must be specified")
    if len(arguments) == 1:
        parser.error("topic type must be specified")
    topic, type_name, *words = arguments
    if "/" not in type_name:
        raise CommandError(f"invalid topic type: {type_name}")
    if options.file and words:
        parser.error("args conflict with -f setting")
    if options.file and not Path(options.file).is_file():
        raise CommandError(f"file does not exist: {options.file}")
    return parser, PubOptions(
        topic,
        type_name,
        tuple(words),
        options.file,
        rate_hz,
        options.once,
        options.latch,
        options.verbose,
        options.substitute,
        options.ros_time,
    )


def _rate(parser: OptionParser, text: str | None) -> float | None:
    if text is None:
        return None
    try:
        rate_hz = float(text)
    except ValueError:
        rate_hz = math.nan
    if math.isnan(rate_hz):
        parser.error("rate must be a number")
    if rate_hz <= 0:
        parser.error("rate must be greater than zero")
    return rate_hz
