"""Play bags by publishing their messages when they are due."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Container, Iterator, Sequence
from typing import Any, Protocol

from pipros.basics.names import canonicalize, is_legal_topic
from pipros.basics.printable import listed
from pipros.msg.time import NS_PER_S, Time
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros_tools.bag.connection import Connection
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.merge import merged_raw
from pipros_tools.bag.opening import open_bag
from pipros_tools.bag.options import PlayOptions
from pipros_tools.bag.playback_clock import PlaybackClock
from pipros_tools.bag.reader import BagReader

_FOUND_S = 1.1
"""Minimum lifetime of latched topics.

Genuine ROS recorders poll for new topics every second.
"""

_SLICE_NS = 20_000_000
"""Maximum duration of an uninterruptible wait."""

_MIN_SLICE_NS = 500_000

_SHORTEST_NS = 200_000
"""Minimum duration of a wait: waking up for each of many messages would cost more than publishing them."""

_LOOK_NS = 1_000_000
"""Time for which messages that are already due are published without a look at keys and clocks."""


_AT_ONCE_NS = 1_000_000_000
"""Bag time for which messages are published without a look at keys if they are not waited for."""


class Controls(Protocol):
    """A player's keyboard and display. A protocol because its implementation belongs to the command."""

    def key(self) -> str:
        """Return the next pressed key, or an empty string if there is none. Must not block."""

    def show(self, state: str, bag_ns: int, played_ns: int, whole_ns: int) -> None:
        """Show the current position. Times are in ns. This method is called often."""


class Player:
    """Player that publishes the messages in bags through a node.

    Raises:
        BagError: there are no messages to play, or a topic has an illegal name.
    """

    def __init__(
        self,
        node: Node,
        bags: Sequence[BagReader],
        options: PlayOptions,
        controls: Controls,
        say: Callable[[str], object],
    ) -> None:
        self._node = node
        self._bags = bags
        self._options = options
        self._controls = controls
        self._say = say
        self._publishers: dict[tuple[int, int], tuple[Any, Any]] = {}
        self._reached_ns, self._look_ns = -1, 0  # messages up to this bag time are due, until that time
        self._clock_publisher: Any = None
        self._clock_class: Any = None
        self._next_clock_ns = self._steps = 0
        self._advertised_s = self._rate_received_s = 0.0
        self._topics = {absolute(topic) for topic in options.topics}
        self._pause_topics = {absolute(topic) for topic in options.pause_topics}
        self._start_ns, self._end_ns = self._range()
        self._clock = PlaybackClock(self._start_ns, time.monotonic_ns(), options.rate)

    def run(self) -> None:
        """Play to the end, or until the node shuts down.

        With `loop` or `keep_alive`, return only when the node shuts down.
        """
        self._advertise()
        is_first = True
        while (is_first or self._options.loop) and not self._node.is_shutdown:
            self._clock = PlaybackClock(self._start_ns, time.monotonic_ns(), self._options.rate)
            if is_first and self._options.paused:
                self._clock.pause(time.monotonic_ns())
            is_first = False
            self._play_once()
        if any(
            connection.is_latching
            for bag in self._bags
            for connection in filter(self._is_wanted, bag.connections)
        ):
            self._node.wait_for_shutdown(max(0.0, self._advertised_s + _FOUND_S - time.monotonic()))
        while self._options.keep_alive and not self._node.is_shutdown:
            self._idle(self._clock.bag_time(time.monotonic_ns()))

    def _range(self) -> tuple[int, int]:
        """Return the bag times at which playback starts and ends."""
        filled = [bag for bag in self._bags if bag.message_count]
        if not filled:
            raise BagError("the bags have no messages")
        start_ns = min(bag.range_ns[0] for bag in filled) + _ns(self._options.start_s)
        end_ns = max(bag.range_ns[1] for bag in filled)
        if self._options.duration_s is not None:
            end_ns = min(end_ns, start_ns + _ns(self._options.duration_s))
        wanted = [each for bag in filled for each in filter(self._is_wanted, bag.connections)]
        if not wanted:
            raise BagError("No messages to play on specified topics.  Exiting.")
        for bag in filled:
            self._check_names(bag, start_ns, end_ns)
        return start_ns, end_ns

    def _check_names(self, bag: BagReader, start_ns: int, end_ns: int) -> None:
        """Refuse illegal names of topics that would be played. The others are not advertised."""
        illegal = [each for each in filter(self._is_wanted, bag.connections) if not self._is_legal(each)]
        for connection, *_ in bag.stored_fields(illegal, start_ns, end_ns) if illegal else ():
            raise BagError(
                f"[{self._options.prefix}{listed(connection.topic)}] is not a legal topic name. "
                "Play other topics with --topics"
            )

    def _is_legal(self, connection: Connection) -> bool:
        return is_legal_topic(self._played_name(connection))

    def _played_name(self, connection: Connection) -> str:
        """Return the name on which a topic is played, without doubled slashes, as rosbag plays it."""
        return canonicalize(self._options.prefix + connection.topic)

    def _is_wanted(self, connection: Connection) -> bool:
        return is_played(self._topics, connection.topic)

    # ---- publishers

    def _advertise(self) -> None:
        self._advertised_s = time.monotonic()
        taken: dict[str, str] = {}
        for number, bag in enumerate(self._bags):
            for connection in filter(self._is_legal, filter(self._is_wanted, bag.connections)):
                topic = self._played_name(connection)
                if taken.get(topic, connection.md5sum) != connection.md5sum:
                    kind = listed(connection.type)
                    self._say(f"[{topic}] has several types; messages of type {kind} are not played")
                    continue
                message_class = _class_of(connection)
                publisher = self._node.advertise(
                    topic,
                    message_class,
                    queue_size=self._options.queue_size,
                    latch=connection.is_latching,
                )
                taken[topic] = connection.md5sum
                self._publishers[number, connection.id] = publisher.publication, message_class
        if self._options.clock:
            from pipros.msg import load_message_class

            self._clock_class = load_message_class("rosgraph_msgs/Clock")
            self._clock_publisher = self._node.advertise("/clock", self._clock_class, queue_size=1)
        if self._options.rate_control_topic:
            self._node.subscribe(self._options.rate_control_topic, AnyMsg, self._on_rate_message)
        self._say(f"Waiting {self._options.delay_s:g} seconds after advertising topics...")
        self._node.wait_for_shutdown(self._options.delay_s)
        while self._options.wait_for_subscribers and not self._node.is_shutdown:
            if all(each.links or each.links_in_process for each, _ in self._publishers.values()):
                break
            self._node.wait_for_shutdown(0.05)

    def _on_rate_message(self, _: AnyMsg) -> None:
        self._rate_received_s = time.monotonic()

    # ---- playing

    def _play_once(self) -> None:
        previous_ns = self._start_ns
        skip_s = self._options.skip_empty_s
        skip_ns = None if skip_s is None else _ns(skip_s)
        self._reached_ns, nothing = -1, (None, None)
        span = self._start_ns, self._end_ns
        is_needed = None if self._pause_topics or skip_ns is not None else self._is_needed
        for number, message in merged_raw(
            self._bags, self._is_wanted, *span, as_views=True, is_needed=is_needed
        ):
            connection, at_ns, data, _, _ = message
            if skip_ns is not None and at_ns - previous_ns > skip_ns:
                self._clock.jump(at_ns, time.monotonic_ns())
                self._reached_ns = -1
            previous_ns = at_ns
            is_due = at_ns <= self._reached_ns and time.monotonic_ns() <= self._look_ns
            if not is_due and not self._wait_until(at_ns):
                return
            publication, message_class = self._publishers.get((number, connection.id), nothing)
            if publication is not None and publication.is_received:
                publication.publish(message_class(bytes(data)))
            if self._pause_topics and absolute(connection.topic) in self._pause_topics:
                self._clock.pause(time.monotonic_ns())
                self._reached_ns = -1
        self._wait_until(self._end_ns)

    def _is_needed(self, number: int, connection: Connection, at_ns: int) -> bool:
        """Return whether a message must be waited for or published."""
        if at_ns > self._reached_ns:
            return True
        publication, _ = self._publishers.get((number, connection.id), (None, None))
        return publication is not None and publication.is_received

    def _wait_until(self, at_ns: int) -> bool:
        """Wait until a bag time is due. Return False if the node shuts down while waiting.

        Set `_reached_ns` and `_look_ns`, so that this need not be called for each of many messages.
        """
        while True:
            now_ns = time.monotonic_ns()
            if self._options.immediate and not self._clock.is_paused:
                self._clock.jump(at_ns, now_ns)
            if now_ns > self._look_ns or self._clock.is_paused:
                self._handle_keys(now_ns)
                self._wait_for_rate()
                if self._node.is_shutdown:
                    return False
                if self._clock.is_paused:
                    self._reached_ns = -1
                    if self._steps:
                        self._steps -= 1
                        self._clock.jump(at_ns, now_ns)
                        self._report_time(at_ns)
                        return True
                    self._idle(self._clock.bag_time(now_ns))
                    continue
                self._report_time(min(at_ns, self._clock.bag_time(now_ns)))
                self._look_ns = now_ns + _LOOK_NS
            left_ns = self._clock.due(at_ns) - now_ns
            if left_ns <= 0:
                is_immediate = self._options.immediate
                self._reached_ns = at_ns + _AT_ONCE_NS if is_immediate else self._clock.bag_time(now_ns)
                return True
            _sleep(max(_SHORTEST_NS, min(left_ns, self._slice_ns(now_ns))))

    def _slice_ns(self, now_ns: int) -> int:
        if not self._options.clock:
            return _SLICE_NS
        return min(_SLICE_NS, max(_MIN_SLICE_NS, self._next_clock_ns - now_ns))

    def _wait_for_rate(self) -> None:
        if not self._options.rate_control_topic:
            return
        from_ns = time.monotonic_ns()
        while time.monotonic() - self._rate_received_s > self._options.rate_control_delay_s:
            if self._node.is_shutdown:
                return
            self._idle(self._clock.bag_time(from_ns))
        now_ns = time.monotonic_ns()
        if now_ns - from_ns > _SLICE_NS:
            self._clock.jump(self._clock.bag_time(from_ns), now_ns)

    def _idle(self, bag_ns: int) -> None:
        self._handle_keys(time.monotonic_ns())
        self._report_time(bag_ns)
        _sleep(_SLICE_NS)

    def _handle_keys(self, now_ns: int) -> None:
        key = self._controls.key()
        if key == " ":
            if self._clock.is_paused:
                self._clock.resume(now_ns)
            else:
                self._clock.pause(now_ns)
        elif key == "s" and self._clock.is_paused:
            self._steps += 1

    def _report_time(self, bag_ns: int) -> None:
        """Show the bag time, and publish it on /clock at the requested rate."""
        state = "PAUSED" if self._clock.is_paused else "RUNNING"
        self._controls.show(state, bag_ns, bag_ns - self._start_ns, self._end_ns - self._start_ns)
        if self._clock_publisher is None:
            return
        now_ns = time.monotonic_ns()
        if now_ns >= self._next_clock_ns:
            self._next_clock_ns = max(self._next_clock_ns + _ns(1 / self._options.clock_hz), now_ns)
            self._clock_publisher.publish(self._clock_class(Time(0, max(0, bag_ns))))


def _class_of(connection: Connection) -> Any:
    """Return a subclass of `AnyMsg` with the connection's type, md5sum and definition.

    The topic latches the last message of each recorded publisher that latches; see `Publication`.
    """
    return type(
        "PlayedMessage",
        (AnyMsg,),
        {
            "_type": connection.type,
            "_md5sum": connection.md5sum,
            "_full_text": connection.definition,
            "_recorded_publisher": connection.callerid if connection.is_latching else None,
            "_to_buffers": _buffers,
            "__slots__": (),
        },
    )


def _buffers(message: AnyMsg) -> list[bytes]:
    return [message.body]


def absolute(topic: str) -> str:
    """Return a topic's name with a slash at its beginning, and none at its end."""
    return "/" + topic.strip("/")


def is_played(topics: Container[str], topic: str) -> bool:
    """Return whether a topic is among the absolute names, which are empty to play all."""
    return not topics or absolute(topic) in topics


def _ns(seconds: float) -> int:
    return round(seconds * NS_PER_S)


def _sleep(duration_ns: int) -> None:
    time.sleep(duration_ns / NS_PER_S)


@contextlib.contextmanager
def opened_bags(
    paths: Sequence[str], opener: Callable[[str], BagReader] = open_bag
) -> Iterator[list[BagReader]]:
    """Context manager that opens bags and closes them at the end. Raises `BagError` or `OSError`."""
    with contextlib.ExitStack() as stack:
        yield [stack.enter_context(opener(path)) for path in paths]
