"""Play a bag for one browser, whose tabs then show the bag's messages instead of the running system's.

The current playback position is called the moment.

Each jump begins a new epoch with an empty `BagSystem`. The browser then reopens its views, and each watched
topic first receives the messages that were current at the new moment. A thread reads only the watched topics,
one chunk at a time.
"""

from __future__ import annotations

import functools
import threading
import time
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S
from pipros.node.any_msg import AnyMsg
from pipros_page.bags.bag_system import BagSystem, BagTopics
from pipros_page.bags.newest import IsOver, newest_before
from pipros_page.bags.rewind import Recording
from pipros_page.bounded_list import PAGE_VIEW_BYTES
from pipros_page.topic_watch import TopicWatch
from pipros_page.watched_system import WatchedSystem
from pipros_tools.bag.connection import Connection, StoredMessage
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.layout import BagLayout
from pipros_tools.bag.playback_clock import PlaybackClock
from pipros_tools.bag.reader import BagReader
from pipros_tools.graph.observer import GraphObservation
from pipros_tools.graph.system_state import SystemState

LEAD_S: Final[Mapping[str, float | None]] = {
    "/tf": 2.0,
    "/tf_static": None,
    "/diagnostics": 5.0,
    "/diagnostics_agg": 5.0,
    "/rosout": 5.0,
    "/rosout_agg": 5.0,
}
"""Time span (s) before the moment, by topic, for which tabs need all messages; None for no limit.

For other topics, tabs need only the newest message.
"""
LEAD_OF_TYPE_S: Final[Mapping[str, float]] = dict.fromkeys(
    (
        "map_msgs/OccupancyGridUpdate",
        "visualization_msgs/InteractiveMarkerUpdate",
        "visualization_msgs/Marker",
        "visualization_msgs/MarkerArray",
    ),
    60.0,
)
"""Like `LEAD_S`, for types whose messages modify what earlier messages displayed."""
LEADING_MESSAGES: Final = 2000
"""Maximum number of messages per topic from before the moment.

Their total size is limited to `PAGE_VIEW_BYTES`.
"""
LOG_TOPICS: Final = ("/rosout_agg", "/rosout")
CLOCK_TOPIC: Final = "/clock"
ALWAYS_WATCHED: Final = (*LEAD_S, CLOCK_TOPIC)
"""Topics that views may watch even if they were not recorded, because views show that they are missing."""
TICK_S: Final = 0.1
LOWEST_SPEED: Final = 0.01
HIGHEST_SPEED: Final = 100.0


@dataclass(frozen=True, slots=True)
class PlaybackState:
    """State of a playback, as shown in the browser.

    Attributes:
        epoch: number of jumps so far; the browser reopens its views when it changes.
        moment: time in the bag (s since 1970).
        speed: seconds of bag time per second.
        error: why the rest of the bag cannot be read; empty if there was no error.
    """

    epoch: int
    moment: float
    playing: bool
    speed: float
    loop: bool
    error: str


class BagPlayback:
    """Playback of a bag for one browser. Its methods are thread-safe and do not block.

    Args:
        live: the running system, whose node and thread pools are used.
        reader: reader of the bag. It is closed together with the playback. The playback of a `Recording`
            begins at the recording's end, and uses its `/clock`, if there is one.

    Raises:
        NoMessages: the bag is empty.
    """

    def __init__(self, live: WatchedSystem, reader: BagReader) -> None:
        self._live = live
        self._reader = reader
        self.recording = reader if isinstance(reader, Recording) else None
        self.begin_ns, self.end_ns = reader.range_ns
        self._changed = threading.Condition()
        self._version = 0
        self._epoch = 0
        has_clock = self.recording is not None and self._connections(CLOCK_TOPIC)
        self._ticked = set[str]() if has_clock else {CLOCK_TOPIC}
        self._moment_ns = self.begin_ns if self.recording is None else self.end_ns
        self._is_playing = self._is_looping = self._is_closed = False
        self._speed = 1.0
        self._error = ""
        self._steps: deque[tuple[int, Sequence[Connection]]] = deque(maxlen=100)
        self._fed: set[TopicWatch] = set()
        self._headers = {each.id: _header(each) for each in reader.connections}
        self.system = self._new_system()
        threading.Thread(target=self._run, name="bag", daemon=True).start()

    @property
    def layout(self) -> BagLayout | None:
        """The bag's index, so that other readers need not read it again; None for MCAP and `Recording`."""
        return self._reader.layout if self._reader.layout.chunks else None

    @property
    def state(self) -> PlaybackState:
        with self._changed:
            return PlaybackState(
                self._epoch,
                self._moment_ns / NS_PER_S,
                self._is_playing,
                self._speed,
                self._is_looping,
                self._error,
            )

    def close(self) -> None:
        with self._changed:
            self._is_closed = True
            self._change()

    def play(self, is_playing: bool) -> None:
        """Start or pause the playback. Start from the beginning if the end has been reached."""
        with self._changed:
            if is_playing and self._moment_ns >= self.end_ns:
                self._jump(self.begin_ns)
            self._is_playing = is_playing
            self._change()

    def set_speed(self, speed: float) -> None:
        with self._changed:
            self._speed = min(max(speed, LOWEST_SPEED), HIGHEST_SPEED)
            self._change()

    def set_loop(self, is_looping: bool) -> None:
        with self._changed:
            self._is_looping = is_looping
            self._change()

    def jump(self, moment_ns: int) -> None:
        with self._changed:
            self._jump(moment_ns)

    def step(self, direction: int, topics: Sequence[str]) -> None:
        """Pause, and go to the next (1) or previous (-1) message on `topics` (on any topic if empty)."""
        wanted = [each for each in self._reader.connections if not topics or each.topic in topics]
        with self._changed:
            self._is_playing = False
            self._steps.append((direction, wanted))
            self._change()

    def _change(self) -> None:
        self._version += 1
        self._changed.notify_all()

    def _jump(self, moment_ns: int) -> None:
        self._moment_ns = min(max(moment_ns, self.begin_ns), self.end_ns)
        self._epoch += 1
        self._fed.clear()
        self._error = ""
        self.system = self._new_system()
        self._change()

    def _new_system(self) -> BagSystem:
        types = {each.topic: each.type for each in self._reader.connections}
        publishers: dict[str, list[str]] = {}
        for each in self._reader.connections:
            nodes = publishers.setdefault(each.topic, [])
            if each.callerid and each.callerid not in nodes:
                nodes.append(each.callerid)
        recorded = None if self.recording is None else {*types, *ALWAYS_WATCHED}
        topics = BagTopics(self._live, self._note_change, self._now_s, recorded)
        system = BagSystem(self._live, topics, self._now_s)
        system.observation = GraphObservation(state=SystemState(publishers, {}, {}), types=types)
        return system

    def _note_change(self) -> None:
        with self._changed:
            self._change()

    def _now_s(self) -> float:
        return self._moment_ns / NS_PER_S

    def _run(self) -> None:
        try:
            while self._turn():
                pass
        finally:
            self._reader.close()

    def _turn(self) -> bool:
        """Do the pending work, or wait for work. Return False once the playback is closed."""
        with self._changed:
            version, moment_ns = self._version, self._moment_ns
            is_over = functools.partial(self._is_over, self._epoch)
            watches = self.system.topics.watches()
            self._fed &= set(watches)
            fresh = [watch for watch in watches if watch not in self._fed]
            self._fed |= set(fresh)
            step = self._steps.popleft() if self._steps else None
            if self._is_closed:
                return False
            if not fresh and step is None and not self._is_playing:
                self._changed.wait()
                return True
        try:
            for watch in fresh:
                self._lead(watch, moment_ns, is_over)
            if step is not None:
                self._step(*step, watches, moment_ns, is_over)
            elif self._is_playing:
                self._play(watches, version, moment_ns)
        except (BagError, OSError) as error:
            with self._changed:
                self._error = str(error)
                self._is_playing = False
        return True

    def _is_over(self, epoch: int) -> bool:
        """Return whether the playback was closed or has jumped since `epoch`."""
        return self._is_closed or self._epoch != epoch

    def _lead(self, watch: TopicWatch, moment_ns: int, is_over: IsOver) -> None:
        """Deliver the messages that were current at `moment_ns` to a watch of their topic."""
        connections = self._connections(watch.topic)
        if watch.topic in self._ticked:
            self._tick([watch], moment_ns, is_leading=True)
        elif connections:
            for message in self._current(watch.topic, connections, moment_ns, is_over):
                if is_over():
                    return
                self._deliver([watch], message, is_leading=True)

    def _current(
        self, topic: str, connections: Sequence[Connection], moment_ns: int, is_over: IsOver
    ) -> Sequence[StoredMessage]:
        """Return the messages that a subscriber needs when playback starts at this time, oldest first.

        If the messages exceed the limits, return only the newest, at least one. See `LEAD_S`.
        """
        lead_s = LEAD_S.get(topic, LEAD_OF_TYPE_S.get(connections[0].type, 0.0))
        if self.recording is not None and topic in LOG_TOPICS:
            lead_s = None
        found: deque[StoredMessage] = deque()
        if lead_s != 0.0:
            begin_ns = self.begin_ns if lead_s is None else moment_ns - round(lead_s * NS_PER_S)
            left_bytes = PAGE_VIEW_BYTES
            for message in self._reader.stored_messages(connections, max(begin_ns, 0), moment_ns):
                if is_over():
                    break
                found.append(message)
                left_bytes -= len(message.data)
                while len(found) > LEADING_MESSAGES or (left_bytes < 0 and len(found) > 1):
                    left_bytes += len(found.popleft().data)
        if not found and topic not in LEAD_S:
            newest = newest_before(self._reader, connections, moment_ns, is_over)
            found.extend([newest] if newest is not None else [])
        return found

    def _step(
        self,
        direction: int,
        wanted: Sequence[Connection],
        watches: Sequence[TopicWatch],
        moment_ns: int,
        is_over: IsOver,
    ) -> None:
        if direction < 0:
            found = newest_before(self._reader, wanted, moment_ns - 1, is_over)
            with self._changed:
                if not is_over():
                    self._jump(found.time_ns if found is not None else self.begin_ns)
            return
        following = next(iter(self._reader.stored_messages(wanted, moment_ns + 1)), None)
        target_ns = self.end_ns if following is None else following.time_ns
        by_topic = self._by_topic(watches)
        for message in self._reader.stored_messages(self._of(by_topic), moment_ns + 1, target_ns):
            if is_over():
                break
            self._deliver(by_topic[message.connection.topic], message)
        with self._changed:
            if is_over():
                return
            self._moment_ns = target_ns
        self._tick(watches, target_ns)

    def _play(self, watches: Sequence[TopicWatch], version: int, moment_ns: int) -> None:
        by_topic = self._by_topic(watches)
        clock = PlaybackClock(moment_ns, time.monotonic_ns(), self._speed)
        for message in self._reader.stored_messages(self._of(by_topic), moment_ns + 1):
            if not self._wait_until(message.time_ns, clock, version, watches):
                return
            self._deliver(by_topic[message.connection.topic], message)
        if not self._wait_until(self.end_ns, clock, version, watches):
            return
        with self._changed:
            if self._is_looping:
                self._jump(self.begin_ns)
            else:
                self._is_playing = False

    def _wait_until(
        self, time_ns: int, clock: PlaybackClock, version: int, watches: Sequence[TopicWatch]
    ) -> bool:
        """Wait until a message is due. Return False if a command arrives first."""
        while True:
            with self._changed:
                now_ns = time.monotonic_ns()
                left_s = (clock.due(time_ns) - now_ns) / NS_PER_S
                if version != self._version:
                    return False
                moment_ns = max(self._moment_ns, min(time_ns, clock.bag_time(now_ns)))
                # Until the message is due, stay before it: an interrupted playback must read it again.
                self._moment_ns = time_ns if left_s <= 0 else min(moment_ns, time_ns - 1)
                if left_s > 0:
                    self._changed.wait(min(left_s, TICK_S))
            if left_s <= 0:
                return True
            self._tick(watches, moment_ns)

    def _connections(self, topic: str) -> list[Connection]:
        found = [each for each in self._reader.connections if each.topic == topic]
        if not found and topic == LOG_TOPICS[0]:
            return self._connections(LOG_TOPICS[1])
        return found

    def _by_topic(self, watches: Sequence[TopicWatch]) -> dict[str, list[TopicWatch]]:
        """Map each watched topic in the bag to its watches."""
        found: dict[str, list[TopicWatch]] = {}
        for watch in watches:
            for topic in {each.topic for each in self._connections(watch.topic)} - self._ticked:
                found.setdefault(topic, []).append(watch)
        return found

    def _of(self, topics: Mapping[str, object]) -> list[Connection]:
        return [each for each in self._reader.connections if each.topic in topics]

    def _deliver(
        self, watches: Iterable[TopicWatch], stored: StoredMessage, *, is_leading: bool = False
    ) -> None:
        message = AnyMsg(stored.data)
        message._connection_header = self._headers[stored.connection.id]
        for watch in watches:
            watch.note(message, stored.time_ns / NS_PER_S, is_leading=is_leading)

    def _tick(self, watches: Iterable[TopicWatch], moment_ns: int, *, is_leading: bool = False) -> None:
        """Send the bag's time to the watches of `/clock`, unless a `Recording` contains `/clock`."""
        for watch in watches:
            if watch.topic in self._ticked:
                kind = load_message_class("rosgraph_msgs/Clock")
                seconds, nanoseconds = divmod(moment_ns, NS_PER_S)
                message = AnyMsg(seconds.to_bytes(4, "little") + nanoseconds.to_bytes(4, "little"))
                message._connection_header = {
                    "type": kind._type,
                    "md5sum": kind._md5sum,
                    "message_definition": kind._full_text,
                }
                watch.note(message, moment_ns / NS_PER_S, is_leading=is_leading)


def _header(connection: Connection) -> dict[str, str]:
    """Return a connection's fields as a publisher's header."""
    fields: Mapping[str, str] = {
        name: value.decode("utf-8", "replace") for name, value in connection.header.items()
    }
    return {"callerid": "", **fields}
